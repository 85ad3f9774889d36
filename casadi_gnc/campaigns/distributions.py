"""Distributions of single numbers and of rows of numbers, as maps from the unit cube to values.

A map takes a point of the cube to a value by the inverse of the distribution function, so that any sampling plan may
give the points. Each is evaluated by arithmetic that has the same bits on every machine.
"""

from __future__ import annotations

import itertools
from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from casadi_gnc.errors import CampaignError
from casadi_gnc.mathematics import elementary, exact, normal


class Distribution(ABC):
    """Map points of a unit cube to values of a dispersed key."""

    #: How many numbers of the cube a case takes.
    dimensions: int
    #: How many numbers come out for a case.
    values: int

    @abstractmethod
    def at(self, points: np.ndarray) -> np.ndarray:
        """Return the values at points (cases, dimensions), each number in [0, 1], as (cases, values).

        Raises
        ------
        CampaignError
            Where a point is 0 or 1 and the distribution has no end there.
        """


@dataclass(frozen=True)
class _Each(Distribution):
    """One number for one dimension, `size` times."""

    @property
    def dimensions(self) -> int:  # pyright: ignore[reportIncompatibleVariableOverride]
        """As many as values."""
        return self.size  # pyright: ignore[reportAttributeAccessIssue]

    @property
    def values(self) -> int:  # pyright: ignore[reportIncompatibleVariableOverride]
        """The size."""
        return self.size  # pyright: ignore[reportAttributeAccessIssue]


@dataclass(frozen=True)
class Normal(_Each):
    """Normal numbers; truncated, not clipped: what lies outside is spread over what lies inside.

    Parameters
    ----------
    mean, deviation : of the normal law before it is truncated; deviation > 0.
    truncate : the values stay within so many deviations of the mean; None for no end.
    size : how many independent values.
    """

    mean: float
    deviation: float
    truncate: float | None = None
    size: int = 1

    def at(self, points: np.ndarray) -> np.ndarray:
        """Return mean + deviation z."""
        return self.mean + self.deviation * normals(points, self.truncate)


@dataclass(frozen=True)
class Uniform(_Each):
    """Numbers from low to high, all alike.

    Parameters
    ----------
    low, high : low < high.
    size : how many independent values.
    """

    low: float
    high: float
    size: int = 1

    def at(self, points: np.ndarray) -> np.ndarray:
        """Return low + (high - low) u, exact at both ends."""
        return _between(points, self.low, self.high)


@dataclass(frozen=True)
class LogUniform(_Each):
    """Positive numbers from low to high whose logarithm is uniform: each octave alike.

    Parameters
    ----------
    low, high : 0 < low < high.
    size : how many independent values.
    """

    low: float
    high: float
    size: int = 1

    def at(self, points: np.ndarray) -> np.ndarray:
        """Return low (high/low)^u."""
        ends = float(exact.log(self.low)), float(exact.log(self.high))
        inside = elementary.exp(_between(points, *ends))
        return np.where(points == 0.0, self.low, np.where(points == 1.0, self.high, inside))


@dataclass(frozen=True)
class Choice(Distribution):
    """One row of several, each with its own probability.

    Parameters
    ----------
    rows : (k, v), the values of each alternative.
    weights : (k,), not negative, not all zero; all alike if empty.
    size : how many independent choices; more than one only of rows of one value.
    """

    rows: tuple[tuple[float, ...], ...]
    weights: tuple[float, ...] = ()
    size: int = 1

    def __post_init__(self) -> None:
        lengths = {len(row) for row in self.rows}
        if len(lengths) != 1 or 0 in lengths:
            raise CampaignError(f"alternatives of {sorted(lengths)} values; expected rows of one length")
        if self.weights and (len(self.weights) != len(self.rows) or min(self.weights) < 0 or not sum(self.weights) > 0):
            raise CampaignError(
                f"{len(self.weights)} weights for {len(self.rows)} alternatives; expected one each, none below 0 and "
                "one above"
            )
        if self.size != 1 and lengths != {1}:
            raise CampaignError(f"{self.size} choices of rows of {lengths.pop()} values; rows are chosen one at a time")

    @property
    def dimensions(self) -> int:  # pyright: ignore[reportIncompatibleVariableOverride]
        """One for each choice."""
        return self.size

    @property
    def values(self) -> int:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Those of a row, or as many as choices."""
        return self.size * len(self.rows[0])

    def at(self, points: np.ndarray) -> np.ndarray:
        """Return the row in whose part of [0, 1] the point lies."""
        weights = self.weights or (1.0,) * len(self.rows)
        shares = np.array(list(itertools.accumulate(weights)))
        # Of the shares, not the weights' sum: a row without weight is not chosen, whatever is rounded.
        place = np.searchsorted(shares[:-1] / shares[-1], points, side="right")
        last = max(i for i, weight in enumerate(weights) if weight > 0)
        return np.array(self.rows)[np.minimum(place, last)].reshape(len(points), self.values)


def normals(points: np.ndarray, truncate: float | None) -> np.ndarray:
    """Return standard normal numbers at points of (0, 1), within so many deviations if `truncate` is given."""
    if truncate is None:
        if points.size and not (points.min() > 0.0 and points.max() < 1.0):
            raise CampaignError(
                "a normal number has no ends at the probabilities 0 and 1; give it `truncate`, or the plan other ends"
            )
        return normal.quantile(points)
    outside = float(normal.cumulative(np.array(-truncate)))
    # From the nearer end, where small probabilities keep their digits.
    upper = points > 0.5
    share = outside + np.where(upper, 1.0 - points, points) * (1.0 - 2.0 * outside)
    ends = (points == 0.0) | (points == 1.0)
    size = np.where(ends, truncate, np.minimum(-normal.quantile(share), truncate))
    return np.where(upper, size, -size)


def _between(points: np.ndarray, low: float, high: float) -> np.ndarray:
    return low * (1.0 - points) + high * points
