"""Search for a flight that breaks a requirement: choices, downhill from the nominal, a plan, downhill from its lowest.

The order is that of cost. The nominal and each choice by itself are a few flights side by side; a slope at each of
them leads, where the number is smooth, to a break with as many flights as there are dispersions, and the ends of single
coordinates find what is far and hidden from slopes. What that misses, a Sobol plan over the whole set looks for, twice
as large each time, with descents from its lowest flights.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import numpy as np

from casadi_gnc.campaigns.plans import Sobol
from casadi_gnc.tuning.descending import MOST, TELLING, Effort, descend, probe
from casadi_gnc.tuning.flights import Flights, SpentError, Trial
from casadi_gnc.tuning.reach import Reach

#: Flights of the first plan, at least.
_PLAN = 16
#: Descents after each plan.
_DESCENTS = 3
#: Steps of a descent while ends are not flown yet, and in how many parts these are flown.
_SHORT, _PARTS = 3, 4
#: Choices, the nominal among them, of each of which a step downhill is taken.
_BRANCHES = 8
#: Choices are combined up to so many combinations.
_MOST_COMBINED = 256


def branches(flights: Flights, changes: int) -> Iterator[tuple[int, np.ndarray]]:
    """Yield build and point, (p,), of every combination with so many choices unlike the nominal, all else nominal.

    The builds are one choice, and each dispersion that is a choice is another.
    """
    space = flights.space
    groups = [each for each in space.groups if each.discrete]
    options: list[list[tuple[int, int, float]]] = [[(-1, of, 0.0) for of in range(1, len(flights.builds))]]
    for group in groups:
        point = np.full((1, space.size), np.nan)
        own = space.rows(point)
        found = []
        for coordinate in space.alternatives(group):
            point[:, group.dimensions] = coordinate
            if not np.array_equal(space.rows(point), own):
                found.append((group.dimensions.start, 0, float(coordinate)))
        options.append(found)
    for chosen in itertools.combinations(options, changes):
        for combined in itertools.product(*chosen):
            point, of = np.full(space.size, np.nan), 0
            for dimension, build, coordinate in combined:
                if dimension < 0:
                    of = build
                else:
                    point[dimension] = coordinate
            yield of, point


def search(flights: Flights, reach: Reach, seed: int, effort: Effort) -> Trial | None:
    """Return the first flight that is found to break the requirement, None where the budget ends before.

    Parameters
    ----------
    flights : what flies, with its budget.
    reach : where points may be.
    seed : of the plan.
    effort : what is counted.
    """
    try:
        return _search(flights, reach, seed, effort)
    except SpentError:
        return flights.lowest if flights.lowest is not None and flights.lowest.broken else None


def _search(flights: Flights, reach: Reach, seed: int, effort: Effort) -> Trial | None:
    space = flights.space
    blank = np.full(space.size, np.nan)
    nominal = flights.note("nominal", flights.best(0, blank[None, :]))
    scale = abs(nominal.value) if np.isfinite(nominal.value) else 1.0
    smooth = not space.discrete.all()
    choices = sum(1 for each in space.groups if each.discrete) + (len(flights.builds) > 1)
    known = [nominal]
    for changes in range(1, choices + 1):
        told = _each(flights, list(itertools.islice(branches(flights, changes), _MOST_COMBINED)))
        if told:
            known += told
            lowest = min(told, key=lambda each: each.value)
            if lowest.broken:
                return flights.note("choice", lowest)
        if changes == 1 and smooth:
            found = _downhill(flights, reach, known, scale, seed, effort)
            if found is not None:
                return found
    if not choices:
        found = _downhill(flights, reach, known, scale, seed, effort)
        if found is not None:
            return found
    return _planned(flights, reach, scale, seed, effort) if smooth else None


def _downhill(
    flights: Flights, reach: Reach, known: list[Trial], scale: float, seed: int, effort: Effort
) -> Trial | None:
    """Step downhill from the nominal and from each choice, fly the ends of each coordinate there, then descend.

    Returns the first break, None without. A slope tells of what is near, the ends of what is far.
    """
    starts = [known[0], *sorted(known[1:], key=lambda each: each.value)][:_BRANCHES]
    lower = []
    for start in starts:
        lower.append(probe(flights, reach, _moved(flights, start), effort))
        if lower[-1].broken:
            return lower[-1]
    parts = [_ends(flights, reach, start) for start in starts]
    for number in range(_PARTS):
        fresh = number == 0 and any(len(each[1]) for each in parts)
        for start, ends in zip(starts, parts, strict=True):
            if len(ends[number]):
                fresh = True
                lower.append(flights.best(start.of, np.where(flights.space.discrete, start.point, ends[number])))
                if lower[-1].broken:
                    return flights.note("end", lower[-1])
        last = number == _PARTS - 1
        for start in sorted(lower, key=lambda each: each.value)[: _DESCENTS if last else int(fresh)]:
            found = descend(flights, reach, start, scale, seed, effort, MOST if last else _SHORT)
            if found.broken:
                return found
    return None


def _ends(flights: Flights, reach: Reach, start: Trial) -> list[np.ndarray]:
    """Return the points with one coordinate at its end and all others nominal, `_PARTS` parts, first to last.

    Together they are (2 (p - choices), p). The first part is empty; then come those downhill, those uphill of
    coordinates that tell something, and the rest. Where no derivatives tell which is which, all are in the last.
    """
    space = flights.space
    moved = np.flatnonzero(~space.discrete)
    places, found = np.arange(len(moved)), np.tile(space.start, (2 * len(moved), 1))
    found[places, moved], found[len(moved) + places, moved] = reach.ends[moved], -reach.ends[moved]
    found = reach.nearest(found)
    slope = flights.derivatives(_moved(flights, start))
    if slope is None:
        return [found[:0]] * (_PARTS - 1) + [found]
    part = np.full((2, len(moved)), 3)
    part[:, np.abs(slope[moved]) > TELLING * np.abs(slope).max()] = 2
    part[0, slope[moved] < 0] = part[1, slope[moved] > 0] = 1
    return [found[part.ravel() == number] for number in range(_PARTS)]


def _moved(flights: Flights, at: Trial) -> Trial:
    """Return a flight of the nominal with its coordinates in the place of blanks, where they can be moved."""
    point = np.where(flights.space.discrete, at.point, flights.space.start)
    same = np.array_equal(flights.space.rows(point[None, :]), flights.space.rows(at.point[None, :]))
    return Trial(at.of, point, at.value) if same else flights.best(at.of, point[None, :])


def _each(flights: Flights, places: list[tuple[int, np.ndarray]]) -> list[Trial]:
    """Return the flights of builds and points, those of one build side by side."""
    found = []
    for of in sorted({each[0] for each in places}):
        points = np.array([point for one, point in places if one == of])
        values = flights.fly(of, points)
        found += [Trial(of, point, float(value)) for point, value in zip(points, values, strict=True)]
    return found


def _planned(flights: Flights, reach: Reach, scale: float, seed: int, effort: Effort) -> Trial | None:
    """Fly a growing plan, and descend from its lowest flights, until one breaks."""
    space = flights.space
    told: list[Trial] = []
    plan = Sobol(space.size + 1)
    first, last = 0, 2 ** int(np.ceil(np.log2(max(_PLAN, 2 * space.size))))
    begun: set[int] = set()
    while True:
        cube = plan.points(seed, first, last)
        points = reach.filled(cube[:, :-1])
        for group in space.groups:
            if group.discrete:
                known = space.alternatives(group)
                place = group.dimensions.start
                points[:, place] = known[np.minimum((cube[:, place] * len(known)).astype(int), len(known) - 1)]
        builds = np.minimum((cube[:, -1] * len(flights.builds)).astype(int), len(flights.builds) - 1)
        told += _each(flights, list(zip(builds.tolist(), points, strict=True)))
        effort.plan = last
        told.sort(key=lambda each: each.value)
        if told[0].broken:
            return flights.note("plan", told[0])
        for start in [each for each in told if id(each) not in begun][:_DESCENTS]:
            begun.add(id(start))
            found = descend(flights, reach, start, scale, seed + len(begun), effort)
            if found.broken:
                return found
        first, last = last, 2 * last
