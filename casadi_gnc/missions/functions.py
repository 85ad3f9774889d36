"""Functions for analysis: a mission's plant, law, controller step and closed loop, ports named.

They are made of the same expressions as the tapes that fly, so what is linearised, differentiated
or optimised here is what flies.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import casadi as ca

from casadi_gnc.errors import FlightError
from casadi_gnc.laws import advance
from casadi_gnc.missions import tapes
from casadi_gnc.missions.mission import Mission, Scheme


def plant_rate(mission: Mission) -> ca.Function:
    """Return (t, x, actuators) -> rate of the plant, without noise."""
    plant, t = mission.truth, ca.SX.sym("t")
    x, actuators = plant.state.symbol("x"), plant.inputs.symbol("actuators")
    ports = {"t": t, "x": x, "actuators": actuators}
    return tapes.function("plant", ports, {"rate": plant.rate(t, x, actuators, _quiet(mission))})


def _quiet(mission: Mission) -> ca.DM:
    """Return noise that is zero."""
    return ca.DM.zeros(mission.truth.noise.size)


def law_function(mission: Mission, scheme: Scheme, parameters: Sequence[ca.SX] = ()) -> ca.Function:
    """Return (t, y, m, achieved, [p]) -> (wanted, memory_rate, shown signals...)."""
    s, law = tapes.Symbols(mission, scheme), scheme.law
    seen = tapes.law_inputs(mission, scheme, s.y)
    told = ca.SX.sym("achieved", scheme.actuation.effort.size)
    wanted = law.command(s.t, seen, s.m)
    outputs = {"wanted": wanted, "memory_rate": law.rate(s.t, seen, s.m, wanted, told), **law.show(s.t, seen, s.m)}
    return _function("law", {"t": s.t, "y": s.y, "m": s.m, "achieved": told}, outputs, parameters)


def _function(name: str, ports: dict[str, Any], outputs: dict[str, Any], parameters: Sequence[ca.SX]) -> ca.Function:
    if parameters:
        ports = {**ports, "p": ca.vertcat(*parameters)}
    return tapes.function(name, ports, outputs)


def _controller(mission: Mission, scheme: Scheme, s: Any) -> dict[str, Any]:
    """Return accepted measurement, memory, actuators, efforts and flags of one sample, as expressions."""
    if not scheme.actuation.is_symbolic:
        raise FlightError(
            f"scheme {scheme.name!r} allocates by an iterative solver, which has no closed form; "
            'take a scheme whose allocation is an expression ("pinv"), or law() and plant() and close the loop yourself'
        )
    if mission.timing.mode != "sampled":
        raise FlightError('step() and closed_loop() are of a sampled mission; use with_timing(mode="sampled")')
    first = tapes.before(mission, scheme, s)
    y, limited = first["accepted"], first["limited"]
    told = tapes.allocated(mission, scheme, y, limited, s.actuators, first["lower"], first["upper"])
    seen = tapes.law_inputs(mission, scheme, y)
    achieved = tapes.achieved(mission, scheme, y, limited, told)
    memory = advance(scheme.law, s.t, seen, first["memory"], first["wanted"], achieved)
    flags = first["flags"] + tapes.judge(mission, scheme, y, limited, told)
    return {**first, "actuators": told, "memory_next": memory, "flags": flags}


def step_function(mission: Mission, scheme: Scheme, parameters: Sequence[ca.SX] = ()) -> ca.Function:
    """Return (t, y, good, m, actuators, [p]) -> (actuators_next, m_next, good_next, wanted, limited, status)."""
    s = tapes.Symbols(mission, scheme)
    c = _controller(mission, scheme, s)
    outputs = {"actuators_next": c["actuators"], "m_next": c["memory_next"], "good_next": c["accepted"]}
    outputs.update(wanted=c["wanted"], limited=c["limited"], status=c["flags"])
    ports = {"t": s.t, "y": s.y, "good": s.good, "m": s.m, "actuators": s.actuators}
    return _function("step", ports, outputs, parameters)


def closed_loop_function(mission: Mission, scheme: Scheme, parameters: Sequence[ca.SX] = ()) -> ca.Function:
    """Return (t, x, m, actuators, good, [p]) -> (x_next, m_next, actuators_next, good_next, wanted, limited)."""
    s = tapes.Symbols(mission, scheme)
    ports = {"t": s.t, "x": s.x, "m": s.m, "actuators": s.actuators, "good": s.good}
    s.y = mission.truth.measure(s.t, s.x, _quiet(mission))
    c = _controller(mission, scheme, s)
    x, h = s.x, mission.timing.sample_period / mission.timing.substeps
    for i in range(mission.timing.substeps):
        x = tapes.plant_step(mission, s.t + i * h, x, c["actuators"], _quiet(mission))
    outputs = {"x_next": mission.truth.settle(x), "m_next": c["memory_next"], "actuators_next": c["actuators"]}
    outputs.update(good_next=c["accepted"], wanted=c["wanted"], limited=c["limited"])
    return _function("closed_loop", ports, outputs, parameters)


def loop_start(mission: Mission, scheme: Scheme) -> dict[str, ca.DM]:
    """Return x, m, actuators and good at t = 0: the mission's start, the law's first memory, actuators at rest."""
    x = ca.DM(mission.start)
    y = ca.DM(mission.truth.measure(0.0, x, _quiet(mission)))
    memory = ca.DM(scheme.law.start(0.0, tapes.law_inputs(mission, scheme, y)))
    return {"x": x, "m": memory, "actuators": ca.DM.zeros(mission.truth.inputs.size), "good": y}
