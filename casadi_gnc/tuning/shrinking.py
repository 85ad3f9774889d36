"""From a flight that breaks a requirement to the smallest one, and to the fewest dispersions that do.

The boundary is found on the straight way from the nominal; then the nearest point of the linearised boundary is asked
for, again and again (Hasofer and Lind (1974); Rackwitz and Fiessler (1978), doi:10.1016/0045-7949(78)90046-9), with
flights at several lengths along that direction, so that no step is believed that no flight confirms. Where slopes do
not help, points around the boundary are drawn closer.
"""

from __future__ import annotations

import numpy as np

from casadi_gnc.campaigns.plans import Sobol
from casadi_gnc.tuning.descending import Effort, slopes
from casadi_gnc.tuning.flights import Flights, SpentError, Trial
from casadi_gnc.tuning.reach import Reach

#: Flights side by side on a way, and how often the part between two of them is divided again.
_SIDE_BY_SIDE, _DIVIDED = 8, 2
#: Most steps, and the part of the distance that one must gain.
_MOST, _GAIN = 8, 0.01
#: Mixtures of the present direction with that to the linearised nearest point, and lengths of each.
_TURNS = (1.0, 0.5, 0.2)
_LENGTHS = (0.6, 0.8, 0.9, 0.97)
#: By how much a break that leaves dispersions out may be longer.
_LONGER = (1.0, 1.1, 1.25)


def smallest(flights: Flights, reach: Reach, broken: Trial, seed: int, effort: Effort) -> Trial:
    """Return the break nearest to the nominal that is found from one, choices as they are; at least the one given.

    A budget that ends while it goes on ends it with what was found.
    """
    best = broken
    try:
        best = flights.note("boundary", _on_the_way(flights, broken))
        for number in range(_MOST):
            closer = _closer(flights, reach, best, seed + number, effort)
            if closer is None:
                break
            gained = 1.0 - _size(flights, closer) / _size(flights, best)
            best = flights.note("boundary", closer)
            if gained < _GAIN:
                break
    except SpentError:
        pass
    return best


def _size(flights: Flights, at: Trial) -> float:
    return float(flights.space.distance(at.point)[0])


def _on_the_way(flights: Flights, broken: Trial) -> Trial:
    """Return the break nearest to the nominal of those flown on the straight way to one."""
    start = np.where(flights.space.discrete, broken.point, flights.space.start)
    if np.isnan(broken.point[~flights.space.discrete]).any() or not _size(flights, broken) > 0:
        return broken
    low, high, best = 0.0, 1.0, broken
    for _ in range(1 + _DIVIDED):
        shares = np.linspace(low, high, _SIDE_BY_SIDE + 1)[1:-1]
        points = start + shares[:, None] * (broken.point - start)
        values = flights.fly(broken.of, points)
        under = np.flatnonzero(values < 0)
        if len(under):
            high, best = float(shares[under[0]]), Trial(broken.of, points[under[0]], float(values[under[0]]))
            low = low if under[0] == 0 else float(shares[under[0] - 1])
        else:
            low = float(shares[-1])
    return best


def way_to(flights: Flights, broken: Trial) -> tuple[tuple[float, float], ...]:
    """Return distance and number at eighths of the straight way from the nominal to a break, both ends included.

    None of them where a break is one by choices alone, or the budget does not allow their flights.
    """
    start = np.where(flights.space.discrete, broken.point, flights.space.start)
    if np.isnan(broken.point[~flights.space.discrete]).any() or not _size(flights, broken) > 0:
        return ()
    points = start + np.linspace(0.0, 1.0, _SIDE_BY_SIDE + 1)[:, None] * (broken.point - start)
    try:
        values = flights.fly(broken.of, points)
    except SpentError:
        return ()
    return tuple(zip(flights.space.distance(points).tolist(), values.tolist(), strict=True))


def _closer(flights: Flights, reach: Reach, at: Trial, seed: int, effort: Effort) -> Trial | None:
    """Return a break that is nearer to the nominal, on the boundary of its own way; None where none is found."""
    space = flights.space
    start = np.where(space.discrete, at.point, space.start)
    units = np.where(space.discrete, 1.0, space.units)
    away = np.where(space.discrete, 0.0, (at.point - start) * units)
    length = float(np.sqrt(away @ away))
    if not length > 0 or np.isnan(length):
        return None
    directions = []
    slope = next(slopes(flights, at, None, effort, (0.02,)), None)
    if slope is not None:
        slope = slope / units
        size = float(slope @ slope)
        nearest = (float(slope @ away) - at.value) / size * slope
        ways = [(1.0 - turn) * away + turn * nearest for turn in _TURNS]
        directions = [way / np.sqrt(way @ way) for way in ways if way.any()]
    found = _nearest_broken(flights, reach, at, start, units, directions, length)
    if found is None:
        effort.sampled += 1
        cube = Sobol(space.size).points(seed, 0, 6 + 2 * space.size)
        spread = np.where(space.discrete, 0.0, (2.0 * cube - 1.0) * units) * length / np.sqrt(space.size)
        ways = away + 0.5 * spread
        directions = [way / np.sqrt(way @ way) for way in ways if way.any()]
        found = _nearest_broken(flights, reach, at, start, units, directions, length, lengths=(0.9,))
    return None if found is None else _on_the_way(flights, found)


def _nearest_broken(
    flights: Flights,
    reach: Reach,
    at: Trial,
    start: np.ndarray,
    units: np.ndarray,
    directions: list[np.ndarray],
    length: float,
    lengths: tuple[float, ...] = _LENGTHS,
) -> Trial | None:
    """Return the nearest break of flights along directions, at parts of a length; None where none breaks."""
    if not directions:
        return None
    points = np.array([start + part * length * way / units for part in lengths for way in directions])
    points = reach.nearest(points)
    values = flights.fly(at.of, points)
    sizes = flights.space.distance(points)
    sizes[~(values < 0)] = np.inf
    place = int(np.argmin(sizes))
    if not sizes[place] < length:
        return None
    return Trial(at.of, points[place], float(values[place]))


def fewest(flights: Flights, reach: Reach, broken: Trial) -> Trial:
    """Return a break with as few dispersions as are found, all others at the file's own numbers.

    Choices that are not needed go first; then dispersions go by their share of the distance, smallest first, where the
    rest, up to a quarter longer, still breaks.
    """
    try:
        point = _without_choices(flights, broken)
        return _without_dispersions(flights, reach, point)
    except SpentError:
        return broken


def _without_choices(flights: Flights, broken: Trial) -> Trial:
    now = broken
    for group in flights.space.groups:
        if group.discrete and not np.isnan(now.point[group.dimensions]).any():
            point = now.point.copy()
            point[group.dimensions] = np.nan
            value = float(flights.fly(now.of, point[None, :])[0])
            if value < 0:
                now = Trial(now.of, point, value)
    return now


def _without_dispersions(flights: Flights, reach: Reach, broken: Trial) -> Trial:
    space = flights.space
    groups = [each for each in space.groups if not each.discrete and not np.isnan(broken.point[each.dimensions]).any()]
    away = np.nan_to_num((broken.point - space.start) * space.units)
    shares = [float(away[each.dimensions] @ away[each.dimensions]) for each in groups]
    ordered = [groups[i] for i in np.argsort(shares, kind="stable")[::-1]]
    points = []
    for count in range(len(ordered)):
        for longer in _LONGER if count else (1.0,):
            moved = space.start + longer * (broken.point - space.start)
            point = np.where(space.discrete, broken.point, reach.nearest(moved[None, :])[0])
            for group in ordered[count:]:
                point[group.dimensions] = np.nan
            points.append(point)
    if not points:
        return broken
    values = flights.fly(broken.of, np.array(points))
    place = next((i for i, value in enumerate(values) if value < 0), None)
    return broken if place is None else Trial(broken.of, points[place], float(values[place]))
