"""The functions of which a flight is made: slices of the loop, each built once and run by every engine.

========  =====================================================================================
tape      from -> to
========  =====================================================================================
start     y -> m, the law's memory at the first measurement
draw      uniform -> noise, normal numbers                      (where the plant has noise)
sense     t, [middle], x, noise -> y
before    t, [middle], y, good, m, actuators -> accepted, memory, wanted, limited, lower, upper, flags
allocate  accepted, limited, actuators, lower, upper -> told     (where the allocation is symbolic)
modulate  asked, memory -> told, kept                            (where actuators make pulses; sampled mode)
after     t, accepted, memory, wanted, limited, told -> m        (sampled mode)
rate      t, middle, x, told, noise -> slope of x, way: the slope times half a step      (sampled mode)
plant     t, x, told, noise -> x, one Runge-Kutta step: four times `rate` and what joins them, with the same words
          in one piece, four times as long                       (sampled mode)
flow      t, middle, x, accepted, memory, wanted, limited, told, noise -> slope of x and m (continuous, other
          allocation)
stage     t, middle, x, noise, good, m, actuators -> slope, accepted, memory, wanted, limited, flags, told: sense
          to flow in one that shares what they have in common   (continuous mode, symbolic allocation)
point     state, slope, length -> moved, where the next stage of the integrator is
weigh     total, slope, weight -> total, the sum of the stages' slopes
join      state, total -> state, one Runge-Kutta step later
settle    x -> x in the representation kept between steps
observe   everything of a sample -> one row of the record
tally     row, tally -> tally, the running metrics
configure p -> derived, x: what follows from the parameters alone, and the start (where there are parameters)
========  =====================================================================================

`middle` is the time in the middle of the integrator's step, where all its stages take their
decisions on time (`casadi_gnc.mathematics.jumps`); the tape `plant` knows its own.

Ports have the names of columns, so whoever runs a tape, in C or by CasADi's machine, finds its arguments by
name: `call` writes them down for the C, the engine keeps a dictionary of columns.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from casadi_gnc.errors import FlightError
from casadi_gnc.mathematics import noise
from casadi_gnc.mathematics.integrators import join, weigh
from casadi_gnc.mathematics.jumps import Timed
from casadi_gnc.missions import metrics
from casadi_gnc.missions.loop import Loop
from casadi_gnc.missions.recording import observed, row_of
from casadi_gnc.missions.requirements import Watch, watches
from casadi_gnc.missions.scheme import Scheme
from casadi_gnc.signals import Layout

if TYPE_CHECKING:
    from casadi_gnc.missions.mission import Mission
    from casadi_gnc.missions.parameters import Parameters

#: Arguments and results of a tape, expressions by name.
Ports = tuple[dict[str, Any], dict[str, Any]]


@dataclass(frozen=True, eq=False)
class Tapes:
    """Hold the functions of one mission, scheme and mode, the layouts of their columns, and what the tally watches."""

    functions: dict[str, ca.Function]
    row: Layout
    tally: Layout
    symbolic: bool
    watches: tuple[Watch, ...] = ()

    def __getattr__(self, name: str) -> ca.Function:
        try:
            return self.functions[name]
        except KeyError:
            raise AttributeError(name) from None


def function(name: str, inputs: dict[str, Any], outputs: dict[str, Any]) -> ca.Function:
    """Return an SX function with named dense ports, common subexpressions merged."""
    results = ca.cse([ca.densify(ca.SX(value)) for value in outputs.values()])
    known = {symbol.element_hash() for column in inputs.values() for symbol in ca.symvar(ca.SX(column))}
    every = ca.symvar(ca.vertcat(*map(ca.vec, results)))
    free = [symbol for symbol in every if symbol.element_hash() not in known]
    if free:
        raise FlightError(
            f"{', '.join(s.name() for s in free)} is a symbol, not a number; numbers fly, and "
            "closed_loop(parameters=[...]) takes symbols for analysis"
        )
    return ca.Function(name, list(inputs.values()), results, list(inputs), list(outputs))


def call(tape: ca.Function, places: Mapping[str, str]) -> str:
    """Return the C call of a printed tape: each column where it lies, in the order of the tape's ports."""
    return f"{tape.name()}({', '.join(places[name] for name in (*tape.name_in(), *tape.name_out()))})"


def tapes_of(mission: Mission, scheme: Scheme, parameters: Parameters | None = None) -> Tapes:
    """Return all tapes of a scheme in the mission's mode.

    With parameters there is one more, `configure`, from the parameters to the start and to `derived`: all that
    follows from them alone, which the other tapes take as one more port.
    """
    loop = Loop(mission, scheme)
    s, plant, timing, symbolic = loop.symbols(), mission.truth, mission.timing, scheme.actuation.is_symbolic
    told = {"told": s.actuators}
    sample = {"accepted": s.y, "memory": s.m, **s.ports("wanted", "limited"), **told}
    parts: dict[str, Ports] = {
        "sense": (s.ports("t", "x", "noise"), {"y": loop.sensed(s.t, s.x, s.noise)}),
        "before": (s.ports("t", "y", "good", "m", "actuators"), loop.before(s.t, s.y, s.good, s.m, s.actuators)),
        "settle": (s.ports("x"), {"settled": loop.settled(s.x)}),
        "observe": _observe(loop),
    }
    if plant.noise.size:
        uniform = ca.SX.sym("uniform", noise.uniform_count(plant.noise.size))
        drawn = noise.normals(uniform, plant.noise.size, mission.noise.truncation)
        parts["draw"] = ({"uniform": uniform}, {"noise": drawn})
    if symbolic:
        answer = loop.allocated(s.y, s.limited, s.actuators, s.lower, s.upper)
        given = {"accepted": s.y, **s.ports("limited", "actuators", "lower", "upper")}
        parts["allocate"] = (given, {"told": answer})
    if scheme.actuation.modulation is not None:
        if timing.mode != "sampled":
            raise FlightError(f'scheme {scheme.name!r} makes pulses, one a sample; fly it in mode "sampled"')
        pulses, kept = loop.modulated(s.actuators, s.m)
        parts["modulate"] = ({"asked": s.actuators, "memory": s.m}, {"told": pulses, "kept": kept})
    if timing.mode == "sampled":
        later = loop.remembered(s.t, s.y, s.m, s.wanted, s.limited, s.actuators)
        parts["after"] = ({"t": s.t, **sample}, {"m": later})
        stepped = loop.stepped(s.t, s.x, s.actuators, s.noise)
        held = {**s.ports("t", "x"), **told, "noise": s.noise}
        parts["plant"] = (held, {"stepped": stepped})
        # CasADi makes one constant of those of a slope and of the step: `way` has the words that `plant` has.
        slope, step = loop.moved(s.t, s.x, s.actuators, s.noise), timing.sample_period / timing.substeps
        parts["rate"] = _on_one_side(held, {"slope": slope, "way": step / 2 * slope})
        parts.update(_integrator(s.x.numel(), step))
    else:
        if symbolic:
            parts["stage"] = _stage(loop)
        else:
            achieved = loop.achieved(s.y, s.limited, s.actuators)
            flowing = loop.flowing(s.t, loop.seen(s.y), s.m, s.wanted, achieved)
            slope = ca.vertcat(loop.moved(s.t, s.x, s.actuators, s.noise), flowing)
            parts["flow"] = ({**s.ports("t", "x"), **sample, "noise": s.noise}, {"slope": slope})
        for name in ("sense", "before", "flow", "stage"):
            if name in parts:
                parts[name] = _on_one_side(*parts[name])
        parts.update(_integrator(s.x.numel() + s.m.numel(), timing.sample_period))
    row = row_of(loop)
    watched = watches(mission.requirements, row, timing.sample_period)
    tally, fold = metrics.fold(tuple(mission.metrics), row, watched)
    parts["start"] = (s.ports("y"), {"m": loop.started(ca.SX(0), s.y)})
    if parameters is not None:
        parts = _configured(parts, parameters, ca.SX(ca.vertcat(*mission.start)))
    built = {name: function(name, *ports) for name, ports in parts.items()}
    return Tapes({**built, "tally": fold}, row, tally, symbolic, watched)


def _configured(parts: dict[str, Ports], parameters: Parameters, start: ca.SX) -> dict[str, Ports]:
    """Return the ports of all tapes with what follows from the parameters alone moved to `configure`."""
    every = [ca.densify(ca.SX(value)) for _, outputs in parts.values() for value in outputs.values()]
    left, symbols, found = ca.extract_parametric(ca.cse(every), parameters.symbols, {"extract_trivial": True})
    derived, rest = ca.vertcat(*symbols) if symbols else ca.SX(0, 1), iter(left)
    made: dict[str, Ports] = {}
    for name, (inputs, outputs) in parts.items():
        results = {port: next(rest) for port in outputs}
        needed = ca.depends_on(ca.vertcat(*map(ca.vec, results.values())), derived)
        made[name] = ({**inputs, "derived": derived} if needed else inputs, results)
    answers = {"derived": ca.vertcat(*found) if found else ca.SX(0, 1), "x": start}
    return {**made, "configure": ({"p": parameters.symbols}, answers)}


def _observe(loop: Loop) -> Ports:
    """Return the ports of the tape that lays out one row of the record, status bits completed."""
    s = loop.symbols()
    flags, report = ca.SX.sym("flags"), loop.actuation.allocator.report.symbol("report")
    given = {**s.ports("t", "x"), "accepted": s.y, "memory": s.m, **s.ports("wanted", "limited")}
    given |= {"told": s.actuators, "flags": flags, "report": report}
    asked = s.actuators
    if loop.actuation.modulation is not None:
        given["asked"] = asked = loop.plant.inputs.symbol("asked")
    return given, {"row": observed(loop, s, asked, flags, report)}


def _stage(loop: Loop) -> Ports:
    """Return the controller at a point of the integrator, and the rates of plant and memory that follow."""
    s = loop.symbols()
    given = s.ports("t", "x", "good", "m", "actuators", "noise")
    first = loop.before(s.t, loop.sensed(s.t, s.x, s.noise), s.good, s.m, s.actuators)
    y, limited = first["accepted"], first["limited"]
    told = loop.allocated(y, limited, s.actuators, first["lower"], first["upper"])
    effort, seen = loop.achieved(y, limited, told), loop.seen(y)
    moved = loop.flowing(s.t, seen, first["memory"], first["wanted"], effort)
    slope = ca.vertcat(loop.moved(s.t, s.x, told, s.noise), moved)
    kept = {name: first[name] for name in ("accepted", "memory", "wanted", "limited", "flags")}
    return given, {"slope": slope, **kept, "told": told}


def _on_one_side(inputs: dict[str, Any], outputs: dict[str, Any]) -> Ports:
    """Return the ports of a part of a stage, `middle` among them, its decisions on time taken there."""
    middle, columns = ca.SX.sym("middle"), {name: symbol for name, symbol in inputs.items() if name != "t"}
    timed = Timed(ca.vertcat(*map(ca.vec, outputs.values())), inputs["t"], columns)
    if timed.decides:
        ends = np.cumsum([ca.SX(value).numel() for value in outputs.values()])
        parts = ca.vertsplit(timed.at(inputs["t"], middle, columns), [0, *ends.tolist()])
        outputs = dict(zip(outputs, parts, strict=True))
    return {"t": inputs["t"], "middle": middle, **columns}, outputs


def _integrator(size: int, h: float) -> dict[str, Ports]:
    """Return the ports of what goes around the rates of a step of length h."""
    state, slope, total = (ca.SX.sym(name, size) for name in ("state", "slope", "total"))
    length, weight = ca.SX.sym("length"), ca.SX.sym("weight")
    return {
        "point": ({"state": state, "slope": slope, "length": length}, {"moved": state + length * slope}),
        "weigh": ({"total": total, "slope": slope, "weight": weight}, {"weighed": weigh(total, weight, slope)}),
        "join": ({"state": state, "total": total}, {"joined": join(state, h, total)}),
    }
