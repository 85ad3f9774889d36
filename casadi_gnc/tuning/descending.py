"""Downhill from a flight: projected quasi-Newton steps, and sampling where a slope leads nowhere.

A step asks for the slope, by differences side by side, and for a few points at once: on the way to where the linearised
number is least in the set, and along the quasi-Newton direction (BFGS; Nocedal and Wright (2006),
doi:10.1007/978-0-387-40065-5, section 6.1), moved into the set. Clips, switches and sampled times make
numbers of flights flat or kinked: where the slope is flat at a small step, it is taken over a tenth of the set; where
no point on its way is lower, points around are flown instead.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from casadi_gnc.campaigns.plans import Sobol
from casadi_gnc.tuning.flights import Flights, Trial
from casadi_gnc.tuning.reach import Reach

#: Steps of differences, in standard units: a small one, and one for numbers that go in stairs.
_STEPS = (0.02, 0.3)
#: A coordinate whose slope is below this part of the largest tells nothing.
_TELLING = 0.05
#: Most steps of a descent.
_MOST = 12
#: Parts of the way to the linearised least, first alone and then together; the last where none of them is lower.
_WAYS = ((1.0,), (0.5, 0.25, 0.1), (0.03, 0.01))
#: A descent ends where a step gains less than this part of the nominal robustness.
_GAIN = 0.002


@dataclass
class Effort:
    """Count what a search tried."""

    plan: int = 0
    descents: int = 0
    sampled: int = 0


def probe(flights: Flights, reach: Reach, start: Trial) -> Trial:
    """Return the lower of a flight and that where its linearised number is least: a slope, and one flight."""
    slope = _slope(flights, start, None)
    if slope is None:
        return start
    found = flights.best(start.of, reach.lowest(slope, start.point)[None, :])
    return flights.note("descent", found) if found.value < start.value else start


def descend(flights: Flights, reach: Reach, start: Trial, scale: float, seed: int, effort: Effort) -> Trial:
    """Return the lowest flight that a descent finds; it ends at the first that breaks the requirement.

    Parameters
    ----------
    flights : what flies.
    reach : where points may be.
    start : where it begins.
    scale : size of the number, such as that at the nominal.
    seed : of the points around, where slopes lead nowhere.
    effort : what is counted.
    """
    effort.descents += 1
    now, size = start, reach.space.size
    inverse, before = np.eye(size), None
    for number in range(_MOST):
        if now.broken:
            return now
        slope = _slope(flights, now, None if before is None else before[1])
        if slope is None:
            lower = _around(flights, reach, now, seed + number, effort)
        else:
            partly = before is not None
            if before is not None:
                inverse = _updated(inverse, now.point - before[0], slope - before[1])
            before = now.point, slope
            lower = _along(flights, reach, now, slope, inverse)
            if lower is None and partly:
                before = None  # with the whole slope once more
                continue
            if lower is None:
                lower, inverse, before = _around(flights, reach, now, seed + number, effort), np.eye(size), None
        if lower is None:
            return now
        gain = now.value - lower.value
        now = flights.note("descent", lower)
        if gain < _GAIN * scale:
            return now
    return now


def _slope(flights: Flights, at: Trial, before: np.ndarray | None) -> np.ndarray | None:
    """Return the slope, of the smaller step that has one; None where it is flat, or a flight has no number.

    After a step, coordinates that told nothing before keep their slope: it would cost as many flights to hear it again.
    """
    if before is not None:
        telling = np.abs(before) > _TELLING * np.abs(before).max()
        slope = flights.slope(at, _STEPS[0], telling)
        slope = np.where(telling, slope, before)
        if np.isfinite(slope).all() and slope[telling].any():
            return slope
    for step in _STEPS:
        slope = flights.slope(at, step)
        if np.isfinite(slope).all() and slope.any():
            return slope
    return None


def _along(flights: Flights, reach: Reach, at: Trial, slope: np.ndarray, inverse: np.ndarray) -> Trial | None:
    """Return a lower flight on the way downhill, None where there is none."""
    low = reach.lowest(slope, at.point)
    newton = reach.nearest(np.array([at.point - share * (inverse @ slope) for share in (1.0, 0.25)]))
    bent = not np.array_equal(inverse, np.eye(len(slope)))
    for ways in _WAYS:
        points = np.array([at.point + way * (low - at.point) for way in ways])
        if bent and ways is not _WAYS[-1]:
            points = np.vstack([points, newton])
        found = flights.best(at.of, points)
        if found.value < at.value:
            return found
    return None


def _around(flights: Flights, reach: Reach, at: Trial, seed: int, effort: Effort) -> Trial | None:
    """Return the lowest flight of some around a point where it is lower, None where none is."""
    effort.sampled += 1
    size = reach.space.size
    count = 4 + 2 * size
    cube = Sobol(size).points(seed, 0, count)
    for wide in (0.5, 0.1):
        moved = wide * (2.0 * cube - 1.0) * reach.ends
        found = flights.best(at.of, reach.nearest(at.point + np.where(reach.space.discrete, 0.0, moved)))
        if found.value < at.value:
            return found
    return None


def _updated(inverse: np.ndarray, moved: np.ndarray, turned: np.ndarray) -> np.ndarray:
    """Return the inverse Hessian after a step (BFGS); the unit matrix where its curvature is not positive."""
    moved = np.where(np.isnan(moved), 0.0, moved)
    along = float(moved @ turned)
    if not along > 1e-12 * float(np.sqrt((moved @ moved) * (turned @ turned))):
        return np.eye(len(moved))
    unit = np.eye(len(moved)) - np.outer(moved, turned) / along
    return unit @ inverse @ unit.T + np.outer(moved, moved) / along
