"""The functions of which a flight is made, each built once and run by every engine.

    measure -> before -> allocate -> after -> plant

========  =====================================================================================
tape      from -> to
========  =====================================================================================
start     y -> m, the law's memory at the first measurement
sense     t, x -> y
before    t, y, good, m, force -> accepted, m, wanted, limited, lower, upper, flags
allocate  limited, force, lower, upper -> force              (where the allocation is symbolic)
after     t, y, m, wanted, limited, force -> m               (sampled mode)
plant     t, x, force -> x, one Runge-Kutta step             (sampled mode)
flow      t, x, y, m, wanted, limited, force -> x', m'       (continuous mode)
point     s, slope, length -> s, an integrator stage         (continuous mode)
join      s, k1, k2, k3, k4 -> s, the stages' sum            (continuous mode)
settle    x -> x in the representation kept between steps
observe   everything of a sample -> one row of the record
tally     row, tally -> tally, the running metrics
========  =====================================================================================

`wanted` is the law's command, `limited` the same inside the virtual-control box, `force` what the
actuators are told, `good` the last accepted measurement. Of these, before, allocate and after fly.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

from casadi_gnc import bounds
from casadi_gnc.errors import FlightError
from casadi_gnc.integrators import join, runge_kutta
from casadi_gnc.laws import advance
from casadi_gnc.missions import metrics
from casadi_gnc.missions.mission import Mission, Scheme
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
        plant, rows = mission.truth, scheme.actuation.effectiveness.shape[0]
        self.t = ca.SX.sym("t")
        self.x = plant.state.symbol("x")
        self.y = plant.measurement.symbol("y")
        self.good = plant.measurement.symbol("good")
        self.m = scheme.law.memory.symbol("m")
        self.force = plant.inputs.symbol("force")
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


def achieved(scheme: Scheme, limited: Any, force: Any) -> Any:
    """Return the effort that the law is told was made, (R,)."""
    if scheme.feedback == "wanted":
        return limited
    return ca.mtimes(scheme.actuation.effectiveness, force)


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
    if actuation.rate < float("inf"):
        # Clipped to the amplitude box, which wins where a previous force lies outside it.
        reach = actuation.rate * mission.timing.sample_period
        least, most = bounds.clip(s.force - reach, lower, upper), bounds.clip(s.force + reach, lower, upper)
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


def row_layout(mission: Mission, scheme: Scheme) -> Layout:
    """Return the columns of a record."""
    rows = scheme.actuation.effectiveness.shape[0]
    return Layout(
        (
            Signal("time", 1, "s"),
            *mission.truth.state.signals,
            Signal("wanted", rows, "N m"),
            Signal("limited", rows, "N m"),
            Signal("achieved", rows, "N m"),
            *mission.truth.inputs.signals,
            *scheme.law.outputs.signals,
            *_funnel_signals(mission),
            *scheme.actuation.allocator.report.signals,
            Signal("status", 1),
        )
    )


def _funnel_signals(mission: Mission) -> tuple[Signal, ...]:
    if mission.funnel is None:
        return ()
    watched = mission.truth.measurement.signal(mission.funnel.signal)
    walls = (Signal(name, watched.size, watched.unit) for name in ("funnel_lower", "funnel_upper"))
    return (*walls, Signal("funnel_use"))


def _watch_funnel(mission: Mission, s: Any) -> tuple[dict[str, Any], Any]:
    """Return the walls and the use of the mission's funnel, and whether the signal has left it."""
    if mission.funnel is None:
        return {}, ca.SX(0)
    funnel, watched = mission.funnel.bounds, s.y[mission.truth.measurement.place(mission.funnel.signal)]
    lower, upper = funnel.walls(s.t)
    shown = {"funnel_lower": lower, "funnel_upper": upper, "funnel_use": funnel.use(s.t, watched)}
    return shown, funnel.left(s.t, watched)


def _observe(mission: Mission, scheme: Scheme, s: Any) -> ca.Function:
    """Return the tape that lays out one row of the record, status bits completed."""
    report = scheme.actuation.allocator.report
    flags, allocation, noted = ca.SX.sym("flags"), ca.SX.sym("allocation_flags"), report.symbol("report")
    seen = law_inputs(mission, scheme, s.y)
    made = ca.mtimes(scheme.actuation.effectiveness, s.force)
    limits = bounds.maximum(-ca.DM(scheme.actuation.limit_below), ca.DM(scheme.actuation.limit_above))
    short = bounds.any_of(ca.fabs(s.limited - made) > SHORTAGE * limits)
    shown = scheme.law.show(s.t, seen, s.m)
    diverged = ca.logic_not(bounds.all_of(ca.fabs(s.x) <= CREDIBLE))
    flags_of_flight = StepStatus.EFFORT_SHORT.value * short + StepStatus.DIVERGED.value * diverged
    walls, left = _watch_funnel(mission, s)
    if StepStatus.FUNNEL_LEFT not in scheme.law.status(s.t, seen, s.m):
        flags_of_flight += StepStatus.FUNNEL_LEFT.value * left
    row = row_layout(mission, scheme).pack(
        time=s.t,
        **vars(mission.truth.state.split(s.x)),
        wanted=s.wanted,
        limited=s.limited,
        achieved=made,
        **vars(mission.truth.inputs.split(s.force)),
        **shown,
        **walls,
        **vars(report.split(noted)),
        status=flags + allocation + flags_of_flight,
    )
    ports = {"t": s.t, "x": s.x, "y": s.y, "m": s.m, "wanted": s.wanted, "limited": s.limited, "force": s.force}
    return function("observe", {**ports, "flags": flags, "allocation_flags": allocation, "report": noted}, {"row": row})


def build(mission: Mission, scheme: Scheme) -> Tapes:
    """Return all tapes of a scheme in the mission's mode."""
    s, plant, law, timing = Symbols(mission, scheme), mission.truth, scheme.law, mission.timing
    loop = {"t": s.t, "y": s.y, "m": s.m, "wanted": s.wanted, "limited": s.limited, "force": s.force}
    told = achieved(scheme, s.limited, s.force)
    seen = law_inputs(mission, scheme, s.y)
    tapes = {
        "sense": function("sense", {"t": s.t, "x": s.x}, {"y": plant.measure(s.t, s.x)}),
        "before": function(
            "before", {"t": s.t, "y": s.y, "good": s.good, "m": s.m, "force": s.force}, before(mission, scheme, s)
        ),
        "settle": function("settle", {"x": s.x}, {"settled": plant.settle(s.x)}),
        "observe": _observe(mission, scheme, s),
    }
    if scheme.actuation.is_symbolic:
        forces = scheme.actuation.allocator.expression(s.limited, s.force, s.lower, s.upper)
        ports = {"limited": s.limited, "force": s.force, "lower": s.lower, "upper": s.upper}
        tapes["allocate"] = function("allocate", ports, {"allocated": forces})
    if timing.mode == "sampled":
        tapes["after"] = function("after", loop, {"memory": advance(law, s.t, seen, s.m, s.wanted, told)})
        stepped = runge_kutta(lambda t, x: plant.rate(t, x, s.force), s.t, s.x, timing.sample_period / timing.substeps)
        tapes["plant"] = function("plant", {"t": s.t, "x": s.x, "force": s.force}, {"stepped": stepped})
    else:
        slope = ca.vertcat(plant.rate(s.t, s.x, s.force), law.rate(s.t, seen, s.m, s.wanted, told))
        tapes["flow"] = function(
            "flow", {"t": s.t, "x": s.x, **{k: v for k, v in loop.items() if k != "t"}}, {"slope": slope}
        )
        tapes.update(_integrator(s.x.numel() + s.m.numel(), timing.sample_period))
    row = row_layout(mission, scheme)
    tally, fold = metrics.fold(mission.metrics, row)
    tapes["tally"] = fold
    tapes["start"] = function("start", {"y": s.y}, {"m": law.start(ca.SX(0), seen)})
    return Tapes(tapes, row, tally, scheme.actuation.is_symbolic)


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
