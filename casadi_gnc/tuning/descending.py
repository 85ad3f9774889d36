"""Downhill from a flight: projected quasi-Newton steps, and sampling where a slope leads nowhere.

A step asks for the slope, of one flight there and back or by differences side by side (`slopes`), and for a few points
at once: on the way to where the linearised number is least in the set, and along the quasi-Newton direction (BFGS;
Nocedal and Wright (2006), doi:10.1007/978-0-387-40065-5, section 6.1), moved into the set. Clips, switches and sampled
times make numbers of flights flat or kinked: where the slope is flat at a small step, or no point on its way is lower,
it is taken over a tenth of the set; where no slope leads on, points around are flown instead.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from casadi_gnc.campaigns.plans import Sobol
from casadi_gnc.tuning.flights import Flights, Trial
from casadi_gnc.tuning.reach import Reach

#: Steps of differences, in standard units: a small one, and one for numbers that go in stairs.
_STEPS = (0.02, 0.3)
#: A coordinate whose slope is below this part of the largest tells nothing.
TELLING = 0.05
#: Most steps of a descent.
MOST = 12
#: Parts of the way to the linearised least, first alone and then together; the last where none of them is lower.
_WAYS = ((1.0,), (0.5, 0.25, 0.1), (0.03, 0.01))
#: A descent ends where a step gains less than this part of the nominal robustness.
_GAIN = 0.002


@dataclass
class Effort:
    """Count what a search tried: flights of a plan, descents, slopes of both kinds, and samplings without one."""

    plan: int = 0
    descents: int = 0
    sampled: int = 0
    derivatives: int = 0
    differences: int = 0


def probe(flights: Flights, reach: Reach, start: Trial, effort: Effort) -> Trial:
    """Return the lower of a flight and that where its linearised number is least: a slope, and one flight."""
    slope = next(slopes(flights, start, None, effort), None)
    if slope is None:
        return start
    found = flights.best(start.of, reach.lowest(slope, start.point)[None, :])
    return flights.note("descent", found) if found.value < start.value else start


def descend(
    flights: Flights, reach: Reach, start: Trial, scale: float, seed: int, effort: Effort, most: int = MOST
) -> Trial:
    """Return the lowest flight that a descent finds; it ends at the first that breaks the requirement.

    Parameters
    ----------
    flights : what flies.
    reach : where points may be.
    start : where it begins.
    scale : size of the number, such as that at the nominal.
    seed : of the points around, where slopes lead nowhere.
    effort : what is counted.
    most : steps.
    """
    effort.descents += 1
    now, size = start, reach.space.size
    inverse, before = np.eye(size), None
    for number in range(most):
        if now.broken:
            return now
        lower = None
        for slope in slopes(flights, now, None if before is None else before[1], effort):
            if before is not None:
                inverse = _updated(inverse, now.point - before[0], slope - before[1])
            before = now.point, slope
            lower = _along(flights, reach, now, slope, inverse)
            if lower is not None:
                break
        else:
            lower, inverse, before = _around(flights, reach, now, seed + number, effort), np.eye(size), None
        if lower is None:
            return now
        gain = now.value - lower.value
        now = flights.note("descent", lower)
        if gain < _GAIN * scale:
            return now
    return now


def slopes(
    flights: Flights, at: Trial, before: np.ndarray | None, effort: Effort, steps: tuple[float, ...] = _STEPS
) -> Iterator[np.ndarray]:
    """Yield slopes at a flight, (p,), one after the other where none before it led on; flat ones and those of flights
    without a number are left out.

    The first is that of one flight there and back, where it costs fewer flights than differences and says anything.
    Then come differences, over the larger step alone where derivatives said what a small one would.

    Parameters
    ----------
    before : the slope before a step, by differences: coordinates that told nothing in it keep theirs, for it would cost
        as many flights to hear it again.
    steps : of differences.
    """
    exact = flights.derivatives(at)
    if exact is not None:
        effort.derivatives += 1
        if _says(exact):
            yield exact
            steps = steps[1:]
    elif before is not None:
        telling = np.abs(before) > TELLING * np.abs(before).max()
        effort.differences += 1
        slope = np.where(telling, flights.slope(at, steps[0], telling), before)
        if _says(slope) and slope[telling].any():
            yield slope
    for step in steps:
        effort.differences += 1
        slope = flights.slope(at, step)
        if _says(slope):
            yield slope


def _says(slope: np.ndarray) -> bool:
    return bool(np.isfinite(slope).all() and slope.any())


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
