"""What flies of a mission's scheme: a controller that `casadi_gnc.embedded` can make C of.

    before -> allocate -> judge -> (modulate) -> after

These are slices of the loop (`casadi_gnc.missions.loop`) that a simulated flight is made of. Gains named as
tunable become symbols; all that depends on them alone is taken out of the step (`extract_parametric`)
and computed once, when they change.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from casadi_gnc.allocation import OnlineInFlight
from casadi_gnc.embedded.controller import Controller, Tunable
from casadi_gnc.embedded.faults import Faults
from casadi_gnc.embedded.named_nodes import Mark, marks
from casadi_gnc.errors import PackageError, offer
from casadi_gnc.laws import gains_of
from casadi_gnc.mathematics import bounds
from casadi_gnc.mathematics.exact import array
from casadi_gnc.missions import tapes
from casadi_gnc.missions.loop import CREDIBLE, Loop, Symbols
from casadi_gnc.missions.onboard_monitor import monitor_of
from casadi_gnc.missions.onboard_names import listened
from casadi_gnc.missions.onboard_notes import notes
from casadi_gnc.missions.scheme import Scheme
from casadi_gnc.status import StepStatus

if TYPE_CHECKING:
    from casadi_gnc.missions.mission import Mission

#: Name of a tape -> its ports and its results.
_Made = dict[str, tuple[dict[str, Any], dict[str, Any]]]


def describe(
    mission: Mission, scheme: str | None = None, tunable: Sequence[str] = (), *, monitored: bool = False
) -> Controller:
    """Return the sampled controller of a scheme.

    Parameters
    ----------
    mission : a continuous one is taken at its sample period.
    scheme : its name; the first one by default.
    tunable : gains of the law that stay variables of the C.
    monitored : with the monitor of the mission's requirements.

    Raises
    ------
    PackageError
        For a scheme whose allocation cannot fly, or a tunable that is no gain of the law.
    """
    mission = sampled(mission)
    chosen = mission.scheme(scheme)
    allocator = chosen.actuation.allocator
    if not chosen.actuation.is_symbolic and not isinstance(allocator, OnlineInFlight):
        raise PackageError(
            f"scheme {chosen.name!r} allocates by a solver that does not fly; "
            'take backend = "online", or an allocation that is an expression ("pinv")'
        )
    parameters = [_parameter(chosen, name) for name in dict.fromkeys(tunable)]
    symbols = [ca.SX.sym(one.name, len(one.default)) for one in parameters]
    if parameters:
        values = {one.name: symbol for one, symbol in zip(parameters, symbols, strict=True)}
        mission = mission.with_scheme(chosen.name, **values)
        chosen = mission.scheme(chosen.name)
    actuation, truth = chosen.actuation, mission.truth
    raised = Loop(mission, chosen).raised()
    faults = _faults(mission, chosen, raised, fades=bool(parameters))
    functions, named = _tapes(Loop(mission, chosen), symbols, fades=faults is not None and faults.fade > 0)
    return Controller(
        title=mission.title or mission.name,
        source=mission.source,
        scheme=chosen.name,
        period=mission.timing.sample_period,
        measured=truth.measurement,
        memory=chosen.flown.memory,
        carry=carried_over(chosen),
        wanted=actuation.named("wanted"),
        limited=actuation.named("limited"),
        actuators=truth.inputs,
        report=allocator.report,
        lower=tuple(float(value) for value in actuation.lower),
        upper=tuple(float(value) for value in actuation.upper),
        least=tuple(float(value) for value in actuation.limit_below),
        most=tuple(float(value) for value in actuation.limit_above),
        tapes=functions,
        faults=faults,
        statuses={bit.value: (str(bit.name), bit.sentences[0]) for bit in raised},
        tunables=tuple(parameters),
        allocation=allocator.problem if isinstance(allocator, OnlineInFlight) else None,
        notes=notes(Loop(mission, chosen)),
        marks=named,
        monitor=monitor_of(mission, Loop(mission, chosen), ca.vertcat(*symbols)) if monitored else None,
    )


def _parameter(scheme: Scheme, name: str) -> Tunable:
    """Return the description of a gain, with the file's value as default."""
    declared = {key: field for key, field in gains_of(type(scheme.law)).items() if "choices" not in field.metadata}
    if name not in declared:
        raise PackageError(f"{name!r} is no gain of scheme {scheme.name!r}; {offer(name, declared)}")
    value, about = getattr(scheme.law, name), declared[name].metadata
    if value is None:
        raise PackageError(f"{name!r} is not given in scheme {scheme.name!r}; give it a value to make it tunable")
    numbers = np.array(ca.DM(value)).ravel(order="F")
    if ca.DM(value).shape[1] > 1:
        raise PackageError(f"{name!r} is a matrix; only numbers and lists can be tunable")
    return Tunable(
        name, about["unit"], about["note"], tuple(float(n) for n in numbers), about["minimum"], about["above"]
    )


def _faults(mission: Mission, scheme: Scheme, raised: Sequence[StepStatus], *, fades: bool) -> Faults | None:
    """Return what the package does with faults; new gains fade in where there are gains to be changed."""
    if mission.fault_handling is None:
        return None
    found = mission.fault_handling.faults(scheme, mission.truth.measurement, raised, mission.timing.sample_period)
    return found if fades else replace(found, fade=0)


def _tapes(
    loop: Loop, parameters: list[ca.SX], *, fades: bool
) -> tuple[dict[str, ca.Function], dict[str, tuple[Mark, ...]]]:
    """Return the tapes of the controller, and what the law names on the way.

    What allocate, judge and after need that does not depend on the new actuators is computed in
    `before`, where it shares subexpressions with the law, and carried over in a column.
    """
    with listened() as named:
        s, made, inputs = _expressions(loop, fades=fades)
    p, known = ca.vertcat(*parameters), {**inputs, **s.ports("limited", "lower", "upper")}
    made, e, functions = _without_parameters(made, p)
    taken = ca.SX(made["before"][1]["accepted"])
    made = _carried(made, ca.vertcat(*inputs.values(), *([e["e"]] if e else [])))
    for name, (ports, outputs) in made.items():
        functions[name] = tapes.function(name, {**ports, **e}, outputs)
    known |= {"told": made["after"][0]["told"], "p": p}
    seen = zip(loop.plant.measurement.signals, notes(loop)["before"]["accepted"], strict=True)
    accepted = [(what, taken[loop.plant.measurement.place(signal.name)]) for signal, (_, what) in seen]
    return functions, marks(functions, [*accepted, *named], known)


def _expressions(loop: Loop, *, fades: bool) -> tuple[Symbols, _Made, dict[str, Any]]:
    """Return the columns of a sample, the tapes as expressions, and what is known before the allocation."""
    s = loop.symbols()
    first = loop.before(s.t, s.y, s.good, s.m, s.actuators)
    inputs = s.ports("t", "y", "good", "m", "actuators")
    if fades:
        inputs |= _fading(loop, first)
    y, limited = first["accepted"], first["limited"]
    told = loop.plant.inputs.symbol("told")
    pulses, kept = loop.modulated(told, first["memory"])
    late = {"judge": {"verdict": loop.judged(y, limited, told)}}
    if loop.actuation.modulation is not None:
        late["modulate"] = {"pulses": pulses, "carry": kept[-loop.actuation.modulation.memory.size :]}
    # What pulses carry over is known from then on, and the last of the memory.
    memory = loop.remembered(s.t, y, first["memory"], first["wanted"], limited, told)
    late["after"] = {"memory": memory[: memory.shape[0] - carried_over(loop.scheme)]}
    early = ("accepted", "wanted", "limited", "lower", "upper", "flags", "shifted")
    now = {key: first[key] for key in early if key in first}
    made: _Made = {"start": (s.ports("t", "y"), {"m": loop.started(s.t, s.y)}), "before": (inputs, now)}
    if loop.actuation.is_symbolic:
        allocated = loop.allocated(y, s.limited, s.actuators, s.lower, s.upper)
        made["allocate"] = (s.ports("limited", "actuators", "lower", "upper"), {"allocated": allocated})
    made |= {name: ({"told": told}, outputs) for name, outputs in late.items()}
    return s, made, inputs


def _fading(loop: Loop, first: dict[str, Any]) -> dict[str, ca.SX]:
    """Let the limited effort of a sample move from that of the old gains to that of the new ones; return the ports.

    Where the gains were changed (`changed` is 1), `shifted` is the last effort less the one that the new gains ask for;
    `share` of it is added, from 1 to 0, and the sum kept inside the limits.
    """
    rows = loop.actuation.effort.size
    ports = {"last": ca.SX.sym("last", rows), "offset": ca.SX.sym("offset", rows)}
    ports |= {"share": ca.SX.sym("share"), "changed": ca.SX.sym("changed")}
    shifted = ca.if_else(ports["changed"] > 0.5, ports["last"] - first["limited"], ports["offset"])
    first["shifted"] = ca.if_else(ca.fabs(shifted) <= CREDIBLE, shifted, 0.0)
    below, above = array(loop.actuation.limit_below), array(loop.actuation.limit_above)
    first["limited"] = bounds.clip(first["limited"] + ports["share"] * first["shifted"], below, above)
    return ports


def carried_over(scheme: Scheme) -> int:
    """Return how many numbers of a scheme's memory, the last ones, are what pulses carry over."""
    modulation = scheme.actuation.modulation
    return 0 if modulation is None else modulation.memory.size


def sampled(mission: Mission) -> Mission:
    """Return the mission as it flies on board: sampled."""
    return mission if mission.timing.mode == "sampled" else mission.with_timing(mode="sampled")


def _all_of(made: _Made) -> list[ca.SX]:
    return [ca.densify(ca.SX(value)) for _, outputs in made.values() for value in outputs.values()]


def _replaced(made: _Made, results: list[ca.SX]) -> _Made:
    rest = iter(results)
    return {name: (ports, {key: next(rest) for key in outputs}) for name, (ports, outputs) in made.items()}


def _without_parameters(made: _Made, p: ca.SX) -> tuple[_Made, dict[str, ca.SX], dict[str, ca.Function]]:
    """Return the tapes in terms of `e`, that port, and `derive`, which computes it from the parameters."""
    if not p.numel():
        return made, {}, {}
    results, symbols, derived = ca.extract_parametric(ca.cse(_all_of(made)), p, {"extract_trivial": True})
    if not derived:
        raise PackageError("the controller does not depend on the tunable parameters")
    derive = tapes.function("derive", {"p": p}, {"derived": ca.vertcat(*derived)})
    return _replaced(made, results), {"e": ca.vertcat(*symbols)}, {"derive": derive}


def _carried(made: _Made, known: ca.SX) -> _Made:
    """Return the tapes with all that is known before the allocation moved into `before`."""
    early = {name: made[name] for name in ("start", "before")}
    late = {name: tape for name, tape in made.items() if name not in early}
    results, symbols, values = ca.extract_parametric(ca.cse(_all_of(late)), known, {"extract_trivial": True})
    late = _replaced(late, results)
    column = ca.vertcat(*symbols) if symbols else ca.SX(0, 1)
    ports, outputs = early["before"]
    early["before"] = (ports, {**outputs, "carried": ca.vertcat(*values) if values else ca.SX(0, 1)})
    return early | {name: ({**own, "carried": column}, results) for name, (own, results) in late.items()}
