"""Does what a metric waits for ever come to rest, with actuators that do what they are told?

A metric of the kind settling whose window is open asks that a signal stays below a threshold to the end of the flight.
The linear loop at the target, under what pushes the plant, says how far from the target the signal is held then.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from casadi_gnc.checking.linear import driven_at_the_end
from casadi_gnc.checks import Check
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.scheme import Metric, Scheme

#: Part of the flight, at its end, that is looked at.
_LAST = 0.1


def settled_at_the_end(mission: Mission) -> list[Metric]:
    """Return the metrics of the kind settling whose window is open to the end of the flight."""
    return [one for one in mission.metrics if one.kind == "settling" and one.until >= mission.timing.duration]


def checks(mission: Mission, scheme: Scheme) -> Iterator[Check]:
    """Yield, for every signal that is to settle, the largest error at the end of the flight."""
    asked = [each for each in settled_at_the_end(mission) if each.signal in mission.target]
    path = driven_at_the_end(mission, scheme, _LAST) if asked else None
    if path is None or np.isnan(path).any():
        return  # no slope at the target: nothing linear can be said
    names = [name for name, values in mission.target.items() for _ in values]
    for metric in asked:
        signal = path[:, [name == metric.signal for name in names]]
        size = np.abs(signal).max(axis=1) if metric.norm == "max" else np.linalg.norm(signal, axis=1)
        yield Check(
            f"settling.{metric.name}",
            float(size.max()),
            metric.threshold,
            mission.truth.state.signal(metric.signal).unit,
            "fail",
            "What acts from outside holds the signal beyond the threshold of the metric: it never settles.",
            "Raise the gains, let an observer estimate the disturbance, or ask for less.",
            "linearised loop at the target under the plant's own disturbance, last tenth of the flight",
        )
