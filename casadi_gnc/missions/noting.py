"""What is told of a flight beside its numbers: cautions before it, metrics without a value, funnels that were left."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from casadi_gnc.missions import tapes
from casadi_gnc.missions.recording import funnel_signals
from casadi_gnc.missions.scheme import Scheme
from casadi_gnc.status import StepStatus

if TYPE_CHECKING:
    from casadi_gnc.missions.mission import Mission


def cautions(scheme: Scheme) -> tuple[str, ...]:
    """Return what the law of a scheme says against its sample period before it flies, a sentence each."""
    found = (check for check in scheme.law.checks() if check.name.startswith("sampling."))
    return tuple(f"{check.consequence} {check.remedy}" for check in found if check.verdict in ("warn", "fail"))


def undefined(
    mission: Mission, values: dict[str, float | None], raised: dict[StepStatus, tuple[int, float]]
) -> tuple[str, ...]:
    """Return a sentence for every metric that has no value."""
    if StepStatus.DIVERGED in raised:
        return (f"diverged at {raised[StepStatus.DIVERGED][1]:g} s: no metric of this flight has a value",)
    end, notes = mission.timing.duration, []
    for metric in mission.metrics:
        last = min(end, metric.until)
        if metric.after > end:
            notes.append(f"{metric.name}: none; it looks from {metric.after:g} s on, and the flight ends at {end:g} s")
        elif values[metric.name] is None and metric.kind == "settling":
            notes.append(f"{metric.name}: never; at {last:g} s {metric.signal} was still above {metric.threshold:g}")
        elif values[metric.name] is None:
            told = f"no finite sample of {metric.signal} from {metric.after:g} to {last:g} s"
            notes.append(f"{metric.name}: none; {told}")
    return tuple(notes)


def left_funnels(mission: Mission, built: tapes.Tapes, record: np.ndarray) -> tuple[str, ...]:
    """Return for every funnel that was left, as far as samples were kept, when and on which axis first."""
    notes, time = [], record[:, built.row.place("time")][:, 0]
    for funnel in mission.funnels:
        if funnel.signal not in built.row:
            continue
        lower, upper = (record[:, built.row.place(name)] for name in funnel_signals(mission, funnel).names[:2])
        signal = record[:, built.row.place(funnel.signal)]
        outside = ~((signal > lower) & (signal < upper))
        if outside.any():
            first = int(outside.any(axis=1).argmax())
            axes = " and ".join(str(axis) for axis in np.flatnonzero(outside[first]) + 1)
            notes.append(f"{funnel.signal} was outside its funnel from {time[first]:g} s on axis {axes} on")
    return tuple(notes)
