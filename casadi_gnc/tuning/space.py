"""One vector in standard units for all that varies, whatever its distribution.

=================  ===============================================================  ==================
distribution       a coordinate                                                     its ends
=================  ===============================================================  ==================
normal             (value - mean) / deviation                                       none, or +-truncate
correlated         the same of the independent numbers z of mean + L z              none
uniform            (value - middle) / half width                                    +-1
log_uniform        the same of the logarithm                                        +-1
direction,         the dimensions of their cube (`Distribution.at`), 0 ... 1 drawn  +-1
rotation, others   out to -1 ... 1; a normal angle in deviations
choice             the place in the cube of an alternative; only the centre of
                   each is used                                                     +-1
=================  ===============================================================  ==================

A coordinate that is NaN stands for the file's own number, which need not lie where the distribution does.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from casadi_gnc.campaigns.correlated import Correlated, factor
from casadi_gnc.campaigns.distributions import Choice, Distribution, LogUniform, Normal, Uniform
from casadi_gnc.campaigns.orientations import Rotation
from casadi_gnc.mathematics import normal

#: Standard deviations of a uniform number in its half width.
_OF_UNIFORM = math.sqrt(3.0)
#: Step of differences of the numbers by the coordinates, which are smooth.
_TURN = 1e-5


@dataclass(frozen=True, eq=False)
class Group:
    """Name what varies by itself: a number, or a block that is drawn as one.

    Parameters
    ----------
    key : as it was given, or of its number.
    distribution : of the dispersion it belongs to.
    dimensions, values : its places in a point, and in a row of numbers.
    """

    key: str
    distribution: Distribution
    dimensions: slice
    values: slice

    @property
    def discrete(self) -> bool:
        """Whether it is a choice."""
        return isinstance(self.distribution, Choice)


class Space:
    """Map points in standard units to the numbers of a case.

    Parameters
    ----------
    keys : the whole path of each number, (P,).
    given : the key of each dispersion.
    distributions : of each dispersion; their values are the numbers, one after the other.
    nominal : (P,), the file's own numbers.
    """

    def __init__(
        self, keys: Sequence[str], given: Sequence[str], distributions: Sequence[Distribution], nominal: np.ndarray
    ) -> None:
        self.keys, self.distributions = tuple(keys), tuple(distributions)
        #: (P,), the file's own numbers.
        self.nominal = np.asarray(nominal, dtype=float)
        self.groups = tuple(_groups(self.keys, given, self.distributions))
        #: (p,), the largest and smallest coordinates; infinite where a normal number has no end.
        self.high = np.concatenate([_ends(each) for each in self.distributions] or [np.zeros(0)])
        self.low = -self.high

    @property
    def size(self) -> int:
        """p, the number of coordinates."""
        return len(self.high)

    @cached_property
    def discrete(self) -> np.ndarray:
        """Which coordinates are choices, (p,)."""
        found = np.zeros(self.size, dtype=bool)
        for group in self.groups:
            found[group.dimensions] = group.discrete
        return found

    @cached_property
    def units(self) -> np.ndarray:
        """Standard deviations in a coordinate's unit, (p,): 1 of a normal number, sqrt(3) of a uniform one."""
        found = np.where(self.dense, 1.0, _OF_UNIFORM)
        found[self.discrete] = 0.0
        return found

    @cached_property
    def dense(self) -> np.ndarray:
        """Which coordinates are normal, (p,): their density falls away from the middle."""
        parts = []
        for each in self.distributions:
            mark = np.zeros(each.dimensions, dtype=bool)
            if isinstance(each, (Normal, Correlated)):
                mark[:] = True
            elif isinstance(each, Rotation) and each.deviation_rad is not None:
                mark[2] = True
            parts.append(mark)
        return np.concatenate(parts or [np.zeros(0, dtype=bool)])

    @cached_property
    def start(self) -> np.ndarray:
        """The coordinates of the file's own numbers, (p,); 0, the middle, where no coordinate says them."""
        found, at = np.zeros(self.size), 0
        value = 0
        for each in self.distributions:
            own = self.nominal[value : value + each.values]
            coordinates = _inverse(each, own)
            if coordinates is not None:
                found[at : at + each.dimensions] = coordinates
            at, value = at + each.dimensions, value + each.values
        return np.clip(found, self.low, self.high)

    def alternatives(self, group: Group) -> np.ndarray:
        """Return the coordinate of each alternative of a choice that can be drawn, in their order."""
        assert isinstance(group.distribution, Choice)
        rows, weights = group.distribution.rows, group.distribution.weights
        shares = np.array(weights or (1.0,) * len(rows), dtype=float)
        upper = np.cumsum(shares) / shares.sum()
        centres = 2.0 * (upper - 0.5 * shares / shares.sum()) - 1.0
        return centres[shares > 0]

    def rows(self, points: np.ndarray) -> np.ndarray:
        """Return the numbers, (n, P), at points, (n, p); a block with a NaN among its coordinates is the file's."""
        points = np.asarray(points, dtype=float).reshape(-1, self.size)
        blank = np.isnan(points)
        known = np.clip(np.where(blank, 0.0, points), self.low, self.high)
        columns, at = [], 0
        for each in self.distributions:
            columns.append(_values(each, known[:, at : at + each.dimensions]))
            at += each.dimensions
        found = np.hstack(columns) if columns else np.empty((len(points), 0))
        for group in self.groups:
            own = blank[:, group.dimensions].any(axis=1)
            found[np.ix_(own, np.arange(group.values.start, group.values.stop))] = self.nominal[group.values]
        return found

    def slope(self, point: np.ndarray, gradient: np.ndarray) -> np.ndarray:
        """Return derivatives by the coordinates at a point, (p,), from those by the numbers, (P,).

        They are 0 of choices, and of coordinates that are NaN.
        """
        found = np.zeros(self.size)
        for i in np.flatnonzero(~(self.discrete | np.isnan(point))):  # most laws are linear in it, the others smooth
            ends = np.tile(point, (2, 1))
            ends[0, i] = min(point[i] + _TURN, self.high[i])
            ends[1, i] = max(point[i] - _TURN, self.low[i])
            ahead, behind = self.rows(ends)
            found[i] = gradient @ (ahead - behind) / (ends[0, i] - ends[1, i])
        return found

    def distance(self, points: np.ndarray) -> np.ndarray:
        """Return how far points are from the file's own numbers, (n,), in standard deviations; choices do not count."""
        points = np.asarray(points, dtype=float).reshape(-1, self.size)
        away = np.where(np.isnan(points), 0.0, points - self.start) * self.units
        return np.sqrt((away * away).sum(axis=1))


def _groups(keys: tuple[str, ...], given: Sequence[str], distributions: tuple[Distribution, ...]) -> list[Group]:
    found: list[Group] = []
    at = value = 0
    for key, each in zip(given, distributions, strict=True):
        alone = each.dimensions == each.values and not isinstance(each, (Correlated, Rotation))
        if alone:
            found += [
                Group(keys[value + i], each, slice(at + i, at + i + 1), slice(value + i, value + i + 1))
                for i in range(each.dimensions)
            ]
        else:
            found.append(Group(key, each, slice(at, at + each.dimensions), slice(value, value + each.values)))
        at, value = at + each.dimensions, value + each.values
    return found


def _ends(distribution: Distribution) -> np.ndarray:
    """Return the largest coordinates of a distribution."""
    if isinstance(distribution, Correlated):
        return np.full(distribution.dimensions, math.inf)
    if isinstance(distribution, Normal):
        return np.full(distribution.dimensions, distribution.truncate or math.inf)
    ends = np.ones(distribution.dimensions)
    if isinstance(distribution, Rotation) and distribution.deviation_rad is not None:
        ends[2] = distribution.truncate or math.inf
    return ends


def _values(distribution: Distribution, points: np.ndarray) -> np.ndarray:
    """Return numbers at coordinates; of normal ones directly, which keeps the digits of their tails."""
    if isinstance(distribution, Normal):
        return distribution.mean + distribution.deviation * points
    if isinstance(distribution, Correlated):
        return np.array(distribution.mean) + points @ np.array(factor(distribution.covariance)).T
    cube = 0.5 * (1.0 + points)
    if isinstance(distribution, Rotation) and distribution.deviation_rad is not None:
        cube[:, 2] = _probability(points[:, 2], distribution.truncate)
    return distribution.at(cube)


def _probability(deviations: np.ndarray, truncate: float | None) -> np.ndarray:
    """Return where in (0, 1) a normal law, truncated or not, has these numbers."""
    if truncate is None:
        return normal.cumulative(np.clip(deviations, -8.0, 8.0))
    outside = float(normal.cumulative(np.array(-truncate)))
    share = (normal.cumulative(deviations) - outside) / (1.0 - 2.0 * outside)
    return np.clip(share, 0.0, 1.0)


def _inverse(distribution: Distribution, values: np.ndarray) -> np.ndarray | None:
    """Return the coordinates of numbers; None where there are none, or they are not single numbers."""
    if isinstance(distribution, Normal):
        return (values - distribution.mean) / distribution.deviation
    if isinstance(distribution, Uniform):
        middle, half = 0.5 * (distribution.low + distribution.high), 0.5 * (distribution.high - distribution.low)
        return (values - middle) / half
    if isinstance(distribution, LogUniform):
        if not (values > 0).all():
            return None
        low, high = math.log(distribution.low), math.log(distribution.high)
        return (np.log(values) - 0.5 * (low + high)) / (0.5 * (high - low))
    if isinstance(distribution, Correlated):
        lower = np.array(factor(distribution.covariance))
        return np.linalg.lstsq(lower, values - np.array(distribution.mean), rcond=None)[0]
    return None
