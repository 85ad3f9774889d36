"""Does a mission ask for what can be meant: windows inside the flight, thresholds in reach, pushes that a step sees?

Told only where something is odd: a file may say such things, and its flight then means little.
"""

from __future__ import annotations

from collections.abc import Iterator

import casadi as ca
import numpy as np

from casadi_gnc.checks import Check
from casadi_gnc.missions.linear_plant import rows_of, target_state
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.scheme import Scheme

#: A threshold beyond this is met by every signal that no sensor limits.
_BEYOND = 1e12
#: Steps that are looked at, drawn over the flight, and points in each, its ends included.
_STEPS, _POINTS = 101, 9
#: Part of what a push ranges over that may lie between the ends of a step unseen: a wave at 1.4 rad a step.
_UNSEEN = 0.25


def checks(mission: Mission, scheme: Scheme) -> Iterator[Check]:
    """Yield windows after the end, thresholds that nothing exceeds, and pushes that change within a step."""
    timing, measured = mission.timing, mission.truth.measurement
    last = (timing.samples - 1) * timing.sample_period
    for metric in mission.metrics:
        if metric.after > last:
            yield Check(
                f"sense.window.{metric.name}",
                metric.after,
                last,
                "s",
                "warn",
                "The window of the metric begins after the flight has ended: it has no value.",
                "Begin it earlier (after_s), or fly longer.",
                "begin of the window against the time of the last sample",
            )
        known = measured.signal(metric.signal).limit if metric.signal in measured else float("inf")
        most = known if np.isfinite(known) else _BEYOND
        if metric.threshold > most:
            yield Check(
                f"sense.threshold.{metric.name}",
                metric.threshold,
                most,
                metric.unit if metric.unit != "s" else "",
                "warn",
                "The signal of the metric never exceeds its threshold: it is met before the flight begins.",
                "Correct the threshold; look at its unit.",
                "threshold against the largest credible value of the signal",
            )
    unseen = unseen_push(mission)
    if unseen > _UNSEEN:
        yield Check(
            "sense.push",
            unseen,
            _UNSEEN,
            "-",
            "warn",
            f"What acts from outside changes within a step of {timing.sample_period:g} s: the flight sees part of it.",
            "Correct the frequency, or shorten sample_period_s.",
            "largest departure inside a step from the line between its ends, median of steps, over the whole range",
        )


def unseen_push(mission: Mission) -> float:
    """Return the part of the range of what acts at the target that lies between the ends of a step, of most steps.

    A jump, of a fault or a profile, lies in a few steps and does not count.
    """
    plant, rows, h = mission.truth, rows_of(mission), mission.timing.sample_period / mission.timing.substeps
    if not rows:
        return 0.0
    t = ca.SX.sym("t")
    still = ca.DM.zeros(plant.inputs.size), ca.DM.zeros(plant.noise.size)
    rate = ca.SX(plant.rate(t, ca.DM(target_state(mission)), *still))[rows]
    begins = h * np.unique(np.linspace(0, max(1, round(mission.timing.duration / h) - 1), _STEPS).round())
    times = begins[:, None] + h * np.linspace(0.0, 1.0, _POINTS)
    found = np.array(ca.Function("pushed", [t], [rate]).map(times.size)(times.ravel())).T.reshape(*times.shape, -1)
    if not np.isfinite(found).all():
        return 0.0
    share = np.linspace(0.0, 1.0, _POINTS)[None, :, None]
    line = found[:, :1] * (1 - share) + found[:, -1:] * share
    departure = np.median(np.abs(found - line).max(axis=1), axis=0)
    span = np.ptp(found.reshape(-1, found.shape[-1]), axis=0)
    size = np.abs(found).max(axis=(0, 1))
    counts = span > 1e-9 * np.maximum(size, 1e-300)  # less is rounding
    return float((departure[counts] / span[counts]).max(initial=0.0))
