"""Functions for analysis: a mission's plant, law, controller step and closed loop, ports named.

They are made of the same expressions as the tapes that fly, so what is linearised, differentiated
or optimised here is what flies.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import casadi as ca

from casadi_gnc.errors import FlightError
from casadi_gnc.integrators import runge_kutta
from casadi_gnc.laws import advance
from casadi_gnc.missions import tapes
from casadi_gnc.missions.mission import Mission, Scheme


def plant_rate(mission: Mission) -> ca.Function:
    """Return (t, x, force) -> rate of the plant."""
    plant, t = mission.truth, ca.SX.sym("t")
    x, force = plant.state.symbol("x"), plant.inputs.symbol("force")
    return tapes.function("plant", {"t": t, "x": x, "force": force}, {"rate": plant.rate(t, x, force)})


def law_function(mission: Mission, scheme: Scheme, parameters: Sequence[ca.SX] = ()) -> ca.Function:
    """Return (t, y, m, achieved, [p]) -> (wanted, memory_rate, shown signals...)."""
    s, law = tapes.Symbols(mission, scheme), scheme.law
    seen = tapes.law_inputs(mission, scheme, s.y)
    told = ca.SX.sym("achieved", scheme.actuation.effectiveness.shape[0])
    wanted = law.command(s.t, seen, s.m)
    outputs = {"wanted": wanted, "memory_rate": law.rate(s.t, seen, s.m, wanted, told), **law.show(s.t, seen, s.m)}
    return _function("law", {"t": s.t, "y": s.y, "m": s.m, "achieved": told}, outputs, parameters)


def _function(name: str, ports: dict[str, Any], outputs: dict[str, Any], parameters: Sequence[ca.SX]) -> ca.Function:
    if parameters:
        ports = {**ports, "p": ca.vertcat(*parameters)}
    return tapes.function(name, ports, outputs)


def _controller(mission: Mission, scheme: Scheme, s: Any) -> dict[str, Any]:
    """Return accepted measurement, memory, force and efforts of one sample, as expressions."""
    if not scheme.actuation.is_symbolic:
        raise FlightError(
            f"scheme {scheme.name!r} allocates by an iterative solver, which has no closed form; "
            'take a scheme with allocation "pinv", or law() and plant() and close the loop yourself'
        )
    if mission.timing.mode != "sampled":
        raise FlightError('step() and closed_loop() are of a sampled mission; use with_timing(mode="sampled")')
    first = tapes.before(mission, scheme, s)
    force = scheme.actuation.allocator.expression(first["limited"], s.force, first["lower"], first["upper"])
    seen = tapes.law_inputs(mission, scheme, first["accepted"])
    told = tapes.achieved(scheme, first["limited"], force)
    memory = advance(scheme.law, s.t, seen, first["memory"], first["wanted"], told)
    return {**first, "force": force, "memory_next": memory}


def step_function(mission: Mission, scheme: Scheme, parameters: Sequence[ca.SX] = ()) -> ca.Function:
    """Return (t, y, good, m, force, [p]) -> (force_next, m_next, good_next, wanted, limited, status)."""
    s = tapes.Symbols(mission, scheme)
    c = _controller(mission, scheme, s)
    outputs = {"force_next": c["force"], "m_next": c["memory_next"], "good_next": c["accepted"]}
    outputs.update(wanted=c["wanted"], limited=c["limited"], status=c["flags"])
    return _function("step", {"t": s.t, "y": s.y, "good": s.good, "m": s.m, "force": s.force}, outputs, parameters)


def closed_loop_function(mission: Mission, scheme: Scheme, parameters: Sequence[ca.SX] = ()) -> ca.Function:
    """Return (t, x, m, force, good, [p]) -> (x_next, m_next, force_next, good_next, wanted, limited)."""
    s = tapes.Symbols(mission, scheme)
    ports = {"t": s.t, "x": s.x, "m": s.m, "force": s.force, "good": s.good}
    s.y = mission.truth.measure(s.t, s.x)
    c = _controller(mission, scheme, s)
    x, h = s.x, mission.timing.sample_period / mission.timing.substeps
    for i in range(mission.timing.substeps):
        x = runge_kutta(lambda t, at: mission.truth.rate(t, at, c["force"]), s.t + i * h, x, h)
    outputs = {"x_next": mission.truth.settle(x), "m_next": c["memory_next"], "force_next": c["force"]}
    outputs.update(good_next=c["accepted"], wanted=c["wanted"], limited=c["limited"])
    return _function("closed_loop", ports, outputs, parameters)


def loop_start(mission: Mission, scheme: Scheme) -> dict[str, ca.DM]:
    """Return x, m, force and good at t = 0: the mission's start, the law's first memory, forces at rest."""
    x = ca.DM(mission.start)
    y = ca.DM(mission.truth.measure(0.0, x))
    memory = ca.DM(scheme.law.start(0.0, tapes.law_inputs(mission, scheme, y)))
    return {"x": x, "m": memory, "force": ca.DM.zeros(mission.truth.inputs.size), "good": y}
