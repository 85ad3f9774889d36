"""Functions for analysis: a mission's plant, law, controller step and closed loop, ports named.

They are slices of the same loop as what flies, so what is linearised, differentiated or optimised here is what
flies.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import casadi as ca

from casadi_gnc.errors import FlightError
from casadi_gnc.missions import tapes
from casadi_gnc.missions.loop import Loop, Symbols
from casadi_gnc.missions.scheme import Scheme

if TYPE_CHECKING:
    from casadi_gnc.missions.mission import Mission


def plant_rate(mission: Mission) -> ca.Function:
    """Return (t, x, actuators) -> rate of the plant, without noise."""
    loop = Loop(mission, mission.scheme())
    s = loop.symbols()
    rate = loop.moved(s.t, s.x, s.actuators, mission.quiet())
    return tapes.function("plant", s.ports("t", "x", "actuators"), {"rate": rate})


def law_function(mission: Mission, scheme: Scheme, parameters: Sequence[ca.SX] = ()) -> ca.Function:
    """Return (t, y, m, achieved, [p]) -> (wanted, memory_rate, shown signals...)."""
    loop, law = Loop(mission, scheme), scheme.flown
    s = loop.symbols()
    seen = loop.seen(s.y)
    told = ca.SX.sym("achieved", scheme.actuation.effort.size)
    wanted = law.command(s.t, seen, s.m)
    outputs: dict[str, Any] = {"wanted": wanted, "memory_rate": loop.flowing(s.t, seen, s.m, wanted, told)}
    outputs.update(law.show(s.t, seen, s.m))
    return _function("law", {**s.ports("t", "y", "m"), "achieved": told}, outputs, parameters)


def _function(name: str, ports: dict[str, Any], outputs: dict[str, Any], parameters: Sequence[ca.SX]) -> ca.Function:
    if parameters:
        ports = {**ports, "p": ca.vertcat(*parameters)}
    return tapes.function(name, ports, outputs)


def _controller(loop: Loop, s: Symbols) -> dict[str, Any]:
    """Return accepted measurement, memory, actuators, efforts and flags of one sample, as expressions."""
    if not loop.actuation.is_symbolic:
        raise FlightError(
            f"scheme {loop.scheme.name!r} allocates by an iterative solver, which has no closed form; "
            'take a scheme whose allocation is an expression ("pinv"), or law() and plant() and close the loop yourself'
        )
    if loop.mission.timing.mode != "sampled":
        raise FlightError('step() and closed_loop() are of a sampled mission; use with_timing(mode="sampled")')
    return loop.controller(s)


def step_function(mission: Mission, scheme: Scheme, parameters: Sequence[ca.SX] = ()) -> ca.Function:
    """Return (t, y, good, m, actuators, [p]) -> (actuators_next, m_next, good_next, wanted, limited, status)."""
    loop = Loop(mission, scheme)
    s = loop.symbols()
    c = _controller(loop, s)
    outputs = {"actuators_next": c["actuators"], "m_next": c["memory_next"], "good_next": c["accepted"]}
    outputs.update(wanted=c["wanted"], limited=c["limited"], status=c["flags"])
    return _function("step", s.ports("t", "y", "good", "m", "actuators"), outputs, parameters)


def closed_loop_function(mission: Mission, scheme: Scheme, parameters: Sequence[ca.SX] = ()) -> ca.Function:
    """Return (t, x, m, actuators, good, [p]) -> (x_next, m_next, actuators_next, good_next, wanted, limited)."""
    loop = Loop(mission, scheme)
    s, quiet = loop.symbols(), mission.quiet()
    ports = s.ports("t", "x", "m", "actuators", "good")
    s.y = loop.sensed(s.t, s.x, quiet)
    c = _controller(loop, s)
    x = loop.held(s.t, s.x, c["actuators"], quiet)
    outputs = {"x_next": loop.settled(x), "m_next": c["memory_next"], "actuators_next": c["actuators"]}
    outputs.update(good_next=c["accepted"], wanted=c["wanted"], limited=c["limited"])
    return _function("closed_loop", ports, outputs, parameters)


def loop_start(mission: Mission, scheme: Scheme) -> dict[str, ca.DM]:
    """Return x, m, actuators and good at t = 0: the mission's start, the law's first memory, actuators at rest."""
    y = mission.first_measurement()
    memory = ca.DM(Loop(mission, scheme).started(0.0, y))
    return {"x": ca.DM(mission.start), "m": memory, "actuators": ca.DM.zeros(mission.truth.inputs.size), "good": y}
