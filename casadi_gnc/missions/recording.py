"""What is recorded of a sample: one row, with the status that is seen from outside."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import casadi as ca

from casadi_gnc.errors import LawError
from casadi_gnc.mathematics import bounds
from casadi_gnc.missions import asking
from casadi_gnc.missions.loop import CREDIBLE, Loop, Symbols, weighed
from casadi_gnc.missions.scheme import Funnel
from casadi_gnc.signals import Layout, Signal
from casadi_gnc.status import StepStatus

if TYPE_CHECKING:
    from casadi_gnc.missions.mission import Mission


def row_of(loop: Loop) -> Layout:
    """Return the columns of a record; raise `LawError` where two of them have one name."""
    effort, plant = loop.actuation.named, loop.plant
    owners = {
        "time": (Signal("time", 1, "s"),),
        f"{type(plant).__name__}.state": plant.state.signals,
        "wanted": effort("wanted").signals,
        "limited": effort("limited").signals,
        "achieved": effort("achieved").signals,
        f"{type(plant).__name__}.inputs": plant.inputs.signals,
        f"{type(plant).__name__}.outputs": plant.outputs.signals,
        f"{type(loop.law).__name__}.outputs": loop.law.outputs.signals,
        "funnels": tuple(s for each in loop.mission.funnels for s in funnel_signals(loop.mission, each).signals),
        "allocator": loop.actuation.allocator.report.signals,
        "status": (Signal("status", 1),),
    }
    taken: dict[str, str] = {}
    for owner, signals in owners.items():
        for signal in signals:
            if signal.name in taken:
                raise LawError(
                    f"{owner} names a signal {signal.name!r}, and so does {taken[signal.name]}: a record has one "
                    "of each; rename it"
                )
            taken[signal.name] = owner
    return Layout(tuple(signal for signals in owners.values() for signal in signals))


def watched(loop: Loop, t: Any, y: Any) -> tuple[dict[str, Any], Any]:
    """Return the walls and the use of the mission's funnels, and whether a signal has left its own."""
    shown, left = {}, ca.SX(0)
    for funnel in loop.mission.funnels:
        watched = y[loop.plant.measurement.place(funnel.signal)]
        values = (*funnel.bounds.walls(t), funnel.bounds.use(t, watched))
        shown.update(zip(funnel_signals(loop.mission, funnel).names, values, strict=True))
        left = ca.logic_or(left, funnel.bounds.left(t, watched))
    return shown, left


def observed(loop: Loop, s: Symbols, asked: Any, flags: Any, report: Any) -> Any:
    """Return one row of the record, its status completed by what is seen from outside.

    `asked` is what the allocation asked of the actuators; what they are told may be pulses.
    """
    plant, law, actuation = loop.plant, loop.law, loop.actuation
    seen = loop.seen(s.y)
    outside = {
        StepStatus.DIVERGED: ca.logic_not(bounds.all_of(ca.fabs(s.x) <= CREDIBLE)),
        **asking.flags(plant, "status", asking.ask(plant, "status", s.t, s.x, s.actuators)),
    }
    shown, left = watched(loop, s.t, s.y)
    if loop.mission.funnels and StepStatus.FUNNEL_LEFT not in law.status(s.t, seen, s.m):
        outside[StepStatus.FUNNEL_LEFT] = left
    efforts = {"wanted": s.wanted, "limited": s.limited, "achieved": loop.made(s.y, s.actuators)}
    for stage, value in efforts.items():
        shown.update(vars(actuation.named(stage).split(value)))
    return row_of(loop).pack(
        time=s.t,
        **vars(plant.state.split(s.x)),
        **vars(plant.inputs.split(s.actuators)),
        **asking.shown(plant, asking.ask(plant, "show", s.t, s.x, s.actuators), plant.outputs),
        **asking.shown(law, asking.ask(law, "show", s.t, seen, s.m), law.outputs),
        **shown,
        **vars(actuation.allocator.report.split(report)),
        status=flags + loop.judged(s.y, s.limited, asked) + weighed(outside),
    )


def funnel_signals(mission: Mission, funnel: Funnel) -> Layout:
    """Return what is recorded of a funnel: lower wall, upper wall, use; with its signal's name if there are several."""
    watched = mission.truth.measurement.signal(funnel.signal)
    ending = f"_{funnel.signal}" if len(mission.funnels) > 1 else ""
    walls = (Signal(f"funnel_{name}{ending}", watched.size, watched.unit) for name in ("lower", "upper"))
    return Layout((*walls, Signal(f"funnel_use{ending}")))
