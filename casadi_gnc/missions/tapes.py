"""The functions of which a flight is made, each built once and run by every engine.

    measure -> before -> allocate -> after -> plant

========  =====================================================================================
tape      from -> to
========  =====================================================================================
start     y -> m, the law's memory at the first measurement
draw      uniform -> noise, normal numbers                      (where the plant has noise)
sense     t, x, noise -> y
before    t, y, good, m, actuators -> accepted, m, wanted, limited, lower, upper, flags
allocate  y, limited, actuators, lower, upper -> actuators      (where the allocation is symbolic)
after     t, y, m, wanted, limited, actuators -> m              (sampled mode)
plant     t, x, actuators, noise -> x, one Runge-Kutta step     (sampled mode)
flow      t, x, y, m, wanted, limited, actuators, noise -> x', m'     (continuous mode, other allocation)
stage     t, x, good, m, actuators, noise -> x', m', accepted, m, wanted, limited, flags, actuators: sense
          to flow in one that shares what they have in common   (continuous mode, symbolic allocation)
point     s, slope, length -> s, an integrator stage         (continuous mode)
join      s, k1, k2, k3, k4 -> s, the stages' sum            (continuous mode)
settle    x -> x in the representation kept between steps
observe   everything of a sample -> one row of the record
tally     row, tally -> tally, the running metrics
========  =====================================================================================

`wanted` is the law's command, `limited` the same inside the virtual-control box, `actuators` what
they are told, `good` the last accepted measurement. Of these, before, allocate and after fly, and
what `judge` adds to the status.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

from casadi_gnc.errors import FlightError
from casadi_gnc.laws import advance
from casadi_gnc.mathematics import bounds, noise
from casadi_gnc.mathematics.integrators import join, runge_kutta
from casadi_gnc.missions import metrics
from casadi_gnc.missions.mission import Funnel, Mission, Scheme
from casadi_gnc.signals import Layout, Signal
from casadi_gnc.status import StepStatus

#: Share of the virtual-control limit that may be missing before a step reports EFFORT_SHORT.
SHORTAGE = 0.05
#: Magnitude beyond which no state of a craft is true; false for NaN too.
CREDIBLE = 1e12


@dataclass(frozen=True, eq=False)
class Tapes:
    """Hold the functions of one mission, scheme and mode, and the layouts of their columns."""

    functions: dict[str, ca.Function]
    row: Layout
    tally: Layout
    symbolic: bool

    def __getattr__(self, name: str) -> ca.Function:
        try:
            return self.functions[name]
        except KeyError:
            raise AttributeError(name) from None


class Symbols:
    """Symbols of one sample; an SX each, named as the ports are."""

    def __init__(self, mission: Mission, scheme: Scheme) -> None:
        plant, rows = mission.truth, scheme.actuation.effort.size
        self.t = ca.SX.sym("t")
        self.x = plant.state.symbol("x")
        self.y = plant.measurement.symbol("y")
        self.good = plant.measurement.symbol("good")
        self.m = scheme.law.memory.symbol("m")
        self.actuators = plant.inputs.symbol("actuators")
        self.noise = plant.noise.symbol("noise")
        self.wanted, self.limited = ca.SX.sym("wanted", rows), ca.SX.sym("limited", rows)
        self.lower, self.upper = plant.inputs.symbol("lower"), plant.inputs.symbol("upper")


def function(name: str, inputs: dict[str, Any], outputs: dict[str, Any]) -> ca.Function:
    """Return an SX function with named dense ports, common subexpressions merged."""
    results = ca.cse([ca.densify(ca.SX(value)) for value in outputs.values()])
    free = [
        s for s in ca.symvar(ca.vertcat(*map(ca.vec, results))) if not ca.depends_on(ca.vertcat(*inputs.values()), s)
    ]
    if free:
        raise FlightError(
            f"{', '.join(s.name() for s in free)} is a symbol, not a number; numbers fly, and "
            "closed_loop(parameters=[...]) takes symbols for analysis"
        )
    return ca.Function(name, list(inputs.values()), results, list(inputs), list(outputs))


def law_inputs(mission: Mission, scheme: Scheme, y: Any) -> Any:
    """Return those rows of the measurement that the law reads, in its order."""
    parts = mission.truth.measurement.split(y)
    return ca.vertcat(*(getattr(parts, name) for name in scheme.law.inputs.names))


def accept(mission: Mission, y: Any, good: Any) -> tuple[Any, Any]:
    """Return the measurement with each incredible signal replaced by its last good value, and a flag.

    The comparison |y| <= limit is false for NaN, whatever the limit.
    """
    layout, accepted, flag = mission.truth.measurement, [], ca.SX(0)
    for signal in layout.signals:
        rows = layout.place(signal.name)
        limit = min(signal.limit, 1e150)
        credible = bounds.all_of(ca.fabs(y[rows]) <= limit)
        # Before there is a good value, or if it was lost, zero is the last resort.
        last = ca.if_else(ca.fabs(good[rows]) <= limit, good[rows], 0.0)
        accepted.append(ca.if_else(credible, y[rows], last))
        flag = ca.logic_or(flag, ca.logic_not(credible))
    return ca.vertcat(*accepted), flag


def _sound_memory(law: Any, t: Any, seen: Any, m: Any) -> tuple[Any, Any]:
    """Return the memory, or a fresh one where some of it is not credible, and a flag for that."""
    if not law.memory.size:
        return m, ca.SX(0)
    sound = bounds.all_of(ca.fabs(m) <= CREDIBLE)
    return ca.if_else(sound, m, ca.SX(law.start(t, seen))), ca.logic_not(sound)


def made(mission: Mission, scheme: Scheme, y: Any, actuators: Any) -> Any:
    """Return the effort that the actuators make as far as the flight software knows, (R,)."""
    return ca.mtimes(scheme.actuation.matrix(mission.truth.measurement.split(y)), actuators)


def achieved(mission: Mission, scheme: Scheme, y: Any, limited: Any, actuators: Any) -> Any:
    """Return the effort that the law is told was made, (R,)."""
    return limited if scheme.feedback == "wanted" else made(mission, scheme, y, actuators)


def allocated(mission: Mission, scheme: Scheme, y: Any, limited: Any, previous: Any, lower: Any, upper: Any) -> Any:
    """Return what the actuators are told, (N,), where the allocation is an expression."""
    actuation, seen = scheme.actuation, mission.truth.measurement.split(y)
    asked = limited if actuation.inverse is None else actuation.inverse(seen, limited)
    return actuation.allocator.expression(asked, previous, lower, upper, actuation.matrix(seen))


def before(mission: Mission, scheme: Scheme, s: Any) -> dict[str, Any]:
    """Return what one sample computes before the allocation."""
    law, actuation = scheme.law, scheme.actuation
    accepted, replaced = accept(mission, s.y, s.good)
    seen = law_inputs(mission, scheme, accepted)
    kept, lost = _sound_memory(law, s.t, seen, s.m)
    memory = law.jump(s.t, seen, kept)
    asked = law.command(s.t, seen, memory)
    wanted = ca.if_else(ca.fabs(asked) <= CREDIBLE, asked, 0.0)
    below, above = ca.DM(actuation.limit_below), ca.DM(actuation.limit_above)
    limited = bounds.clip(wanted, below, above)
    flags = {
        StepStatus.MEASUREMENT_REPLACED: replaced,
        StepStatus.COMMAND_LIMITED: bounds.outside(wanted, below, above),
        StepStatus.MEMORY_RESET: lost,
        StepStatus.COMMAND_REPLACED: ca.logic_not(bounds.all_of(ca.fabs(asked) <= CREDIBLE)),
        **law.status(s.t, seen, memory),
    }
    lower, upper = ca.SX(ca.DM(actuation.lower)), ca.SX(ca.DM(actuation.upper))
    if actuation.reach is not None:
        # The amplitude box wins: a bound outside it becomes its edge.
        measured = mission.truth.measurement.split(accepted)
        least, most = actuation.reach(measured, mission.timing.sample_period)
        lower, upper = bounds.clip(least, lower, upper), bounds.clip(most, lower, upper)
    if actuation.rate < float("inf"):
        # Clipped to the amplitude box, which wins where a previous force lies outside it.
        reach = actuation.rate * mission.timing.sample_period
        least, most = bounds.clip(s.actuators - reach, lower, upper), bounds.clip(s.actuators + reach, lower, upper)
        lower, upper = least, most
    return {
        "accepted": accepted,
        "memory": memory,
        "wanted": wanted,
        "limited": limited,
        "lower": lower,
        "upper": upper,
        "flags": sum(bit.value * flag for bit, flag in flags.items()),
    }


def judge(mission: Mission, scheme: Scheme, y: Any, limited: Any, actuators: Any) -> Any:
    """Return the flags that the flight software raises once it knows what the actuators will do."""
    actuation = scheme.actuation
    limits = bounds.maximum(-ca.DM(actuation.limit_below), ca.DM(actuation.limit_above))
    missing = ca.fabs(limited - made(mission, scheme, y, actuators))
    flags = {StepStatus.EFFORT_SHORT: bounds.any_of(missing > SHORTAGE * limits)}
    if actuation.judge is not None:
        flags.update(actuation.judge(mission.truth.measurement.split(y), limited, actuators))
    return sum(bit.value * flag for bit, flag in flags.items())


def row_layout(mission: Mission, scheme: Scheme) -> Layout:
    """Return the columns of a record."""
    effort, truth = scheme.actuation.named, mission.truth
    return Layout(
        (
            Signal("time", 1, "s"),
            *truth.state.signals,
            *effort("wanted").signals,
            *effort("limited").signals,
            *effort("achieved").signals,
            *truth.inputs.signals,
            *truth.outputs.signals,
            *scheme.law.outputs.signals,
            *(signal for funnel in mission.funnels for signal in funnel_signals(mission, funnel).signals),
            *scheme.actuation.allocator.report.signals,
            Signal("status", 1),
        )
    )


def funnel_signals(mission: Mission, funnel: Funnel) -> Layout:
    """Return what is recorded of a funnel: lower wall, upper wall, use; with its signal's name if there are several."""
    watched = mission.truth.measurement.signal(funnel.signal)
    ending = f"_{funnel.signal}" if len(mission.funnels) > 1 else ""
    walls = (Signal(f"funnel_{name}{ending}", watched.size, watched.unit) for name in ("lower", "upper"))
    return Layout((*walls, Signal(f"funnel_use{ending}")))


def _watch_funnels(mission: Mission, s: Any) -> tuple[dict[str, Any], Any]:
    """Return the walls and the use of the mission's funnels, and whether a signal has left its own."""
    shown, left = {}, ca.SX(0)
    for funnel in mission.funnels:
        watched = s.y[mission.truth.measurement.place(funnel.signal)]
        values = (*funnel.bounds.walls(s.t), funnel.bounds.use(s.t, watched))
        shown.update(zip(funnel_signals(mission, funnel).names, values, strict=True))
        left = ca.logic_or(left, funnel.bounds.left(s.t, watched))
    return shown, left


def _observe(mission: Mission, scheme: Scheme, s: Any) -> ca.Function:
    """Return the tape that lays out one row of the record, status bits completed."""
    truth, actuation = mission.truth, scheme.actuation
    report = actuation.allocator.report
    flags, noted = ca.SX.sym("flags"), report.symbol("report")
    seen = law_inputs(mission, scheme, s.y)
    outside = {
        StepStatus.DIVERGED: ca.logic_not(bounds.all_of(ca.fabs(s.x) <= CREDIBLE)),
        **truth.status(s.t, s.x, s.actuators),
    }
    shown, left = _watch_funnels(mission, s)
    if mission.funnels and StepStatus.FUNNEL_LEFT not in scheme.law.status(s.t, seen, s.m):
        outside[StepStatus.FUNNEL_LEFT] = left
    efforts = {"wanted": s.wanted, "limited": s.limited, "achieved": made(mission, scheme, s.y, s.actuators)}
    for stage, value in efforts.items():
        shown.update(vars(actuation.named(stage).split(value)))
    row = row_layout(mission, scheme).pack(
        time=s.t,
        **vars(truth.state.split(s.x)),
        **vars(truth.inputs.split(s.actuators)),
        **truth.show(s.t, s.x, s.actuators),
        **scheme.law.show(s.t, seen, s.m),
        **shown,
        **vars(report.split(noted)),
        status=flags
        + judge(mission, scheme, s.y, s.limited, s.actuators)
        + sum(bit.value * flag for bit, flag in outside.items()),
    )
    ports = {"t": s.t, "x": s.x, "y": s.y, "m": s.m, "wanted": s.wanted, "limited": s.limited}
    return function("observe", {**ports, "actuators": s.actuators, "flags": flags, "report": noted}, {"row": row})


def build(mission: Mission, scheme: Scheme) -> Tapes:
    """Return all tapes of a scheme in the mission's mode."""
    s, plant, law, timing = Symbols(mission, scheme), mission.truth, scheme.law, mission.timing
    loop = {"t": s.t, "y": s.y, "m": s.m, "wanted": s.wanted, "limited": s.limited, "actuators": s.actuators}
    told = achieved(mission, scheme, s.y, s.limited, s.actuators)
    seen = law_inputs(mission, scheme, s.y)
    before_ports = {"t": s.t, "y": s.y, "good": s.good, "m": s.m, "actuators": s.actuators}
    tapes = {
        "sense": function("sense", {"t": s.t, "x": s.x, "noise": s.noise}, {"y": plant.measure(s.t, s.x, s.noise)}),
        "before": function("before", before_ports, before(mission, scheme, s)),
        "settle": function("settle", {"x": s.x}, {"settled": plant.settle(s.x)}),
        "observe": _observe(mission, scheme, s),
    }
    if plant.noise.size:
        uniform = ca.SX.sym("uniform", noise.uniform_count(plant.noise.size))
        drawn = noise.normals(uniform, plant.noise.size, mission.noise.truncation)
        tapes["draw"] = function("draw", {"uniform": uniform}, {"noise": drawn})
    if scheme.actuation.is_symbolic:
        answer = allocated(mission, scheme, s.y, s.limited, s.actuators, s.lower, s.upper)
        ports = {"y": s.y, "limited": s.limited, "actuators": s.actuators, "lower": s.lower, "upper": s.upper}
        tapes["allocate"] = function("allocate", ports, {"allocated": answer})
    if timing.mode == "sampled":
        tapes["after"] = function("after", loop, {"memory": advance(law, s.t, seen, s.m, s.wanted, told)})
        ports = {"t": s.t, "x": s.x, "actuators": s.actuators, "noise": s.noise}
        tapes["plant"] = function("plant", ports, {"stepped": plant_step(mission, s.t, s.x, s.actuators, s.noise)})
    else:
        if scheme.actuation.is_symbolic:
            tapes["stage"] = _stage(mission, scheme)
        else:
            slope = ca.vertcat(plant.rate(s.t, s.x, s.actuators, s.noise), law.rate(s.t, seen, s.m, s.wanted, told))
            ports = {"t": s.t, "x": s.x, **{k: v for k, v in loop.items() if k != "t"}, "noise": s.noise}
            tapes["flow"] = function("flow", ports, {"slope": slope})
        tapes.update(_integrator(s.x.numel() + s.m.numel(), timing.sample_period))
    row = row_layout(mission, scheme)
    tally, fold = metrics.fold(mission.metrics, row)
    tapes["tally"] = fold
    tapes["start"] = function("start", {"y": s.y}, {"m": law.start(ca.SX(0), seen)})
    return Tapes(tapes, row, tally, scheme.actuation.is_symbolic)


def plant_step(mission: Mission, t: Any, x: Any, actuators: Any, noise_: Any) -> Any:
    """Return x one substep later, by one Runge-Kutta step under held actuators and noise."""
    step = mission.timing.sample_period / mission.timing.substeps
    return runge_kutta(lambda at, state: mission.truth.rate(at, state, actuators, noise_), t, x, step)


def _stage(mission: Mission, scheme: Scheme) -> ca.Function:
    """Return the controller at a point of the integrator, and the rates of plant and memory that follow."""
    s, plant, law = Symbols(mission, scheme), mission.truth, scheme.law
    ports = {"t": s.t, "x": s.x, "good": s.good, "m": s.m, "actuators": s.actuators, "noise": s.noise}
    s.y = plant.measure(s.t, s.x, s.noise)
    first = before(mission, scheme, s)
    y, limited = first["accepted"], first["limited"]
    told = allocated(mission, scheme, y, limited, s.actuators, first["lower"], first["upper"])
    effort, seen = achieved(mission, scheme, y, limited, told), law_inputs(mission, scheme, y)
    moved = law.rate(s.t, seen, first["memory"], first["wanted"], effort)
    slope = ca.vertcat(plant.rate(s.t, s.x, told, s.noise), moved)
    kept = {name: first[name] for name in ("accepted", "memory", "wanted", "limited", "flags")}
    return function("stage", ports, {"slope": slope, **kept, "told": told})


def _integrator(size: int, h: float) -> dict[str, ca.Function]:
    state, slope, length = ca.SX.sym("state", size), ca.SX.sym("slope", size), ca.SX.sym("length")
    k = [ca.SX.sym(f"k{i}", size) for i in range(1, 5)]
    joined = join(state, h, *k)
    return {
        "point": function(
            "point", {"state": state, "slope": slope, "length": length}, {"moved": state + length * slope}
        ),
        "join": function("join", {"state": state, "k1": k[0], "k2": k[1], "k3": k[2], "k4": k[3]}, {"joined": joined}),
    }
