"""Plans without chance: corners, grid, one at a time.

They look where it may go wrong. Shares and percentiles of their cases mean nothing, and all cases fly in the same
noise, so that what differs between them comes from their inputs.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from casadi_gnc.campaigns.draws import MOST_CASES
from casadi_gnc.campaigns.plan import Plan, check_dimensions
from casadi_gnc.errors import CampaignError

#: Probabilities of a normal number to be below -3 and below 3 deviations.
THREE_SIGMA = (0.0013498980316300946, 0.9986501019683699)


class _Design(Plan):
    """A plan without chance."""

    representative = False

    def noise_numbers(self, first: int, last: int) -> np.ndarray:
        """Return zeros: all cases fly in the same noise."""
        return np.zeros(last - first, dtype=np.int64)


@dataclass(frozen=True)
class Corners(_Design):
    """Fly every combination of a low and a high value: 2^d cases; the last dimension changes first.

    Parameters
    ----------
    dimensions : of the cube, d; at most 32.
    ends : probabilities of the low and the high value; by default those of -3 and 3 deviations of a normal number. 0
        and 1 are the ends of a range, where the distribution has them.
    """

    dimensions: int
    ends: tuple[float, float] = THREE_SIGMA

    def __post_init__(self) -> None:
        check_dimensions(self.dimensions)
        _check_ends(self.ends)
        _check_size(2**self.dimensions if self.dimensions < 64 else MOST_CASES + 1, f"{self.dimensions} dimensions")

    @property
    def cases(self) -> int:
        """2^d."""
        return 2**self.dimensions

    def _points(self, seed: int, first: int, last: int) -> np.ndarray:
        return np.array(self.ends)[_digits((2,) * self.dimensions, first, last)]


@dataclass(frozen=True)
class Grid(_Design):
    """Fly every combination of some values of each dimension; the last dimension changes first.

    Parameters
    ----------
    levels : how many values each dimension has, d numbers from 1 on.
    ends : probabilities of the first and the last value; None takes the middles of cells of equal probability. A
        dimension with one level is at 0.5.
    """

    levels: tuple[int, ...]
    ends: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        check_dimensions(len(self.levels))
        if min(self.levels) < 1:
            raise CampaignError(f"a grid of {min(self.levels)} values in one dimension; expected 1 or more")
        if self.ends is not None:
            _check_ends(self.ends)
        _check_size(self.cases, " x ".join(map(str, self.levels)))

    @property
    def dimensions(self) -> int:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Of the cube."""
        return len(self.levels)

    @property
    def cases(self) -> int:
        """The product of the levels."""
        return math.prod(self.levels)

    def _points(self, seed: int, first: int, last: int) -> np.ndarray:
        digits = _digits(self.levels, first, last)
        points = np.empty(digits.shape)
        for dimension, level in enumerate(self.levels):
            points[:, dimension] = self._values(level)[digits[:, dimension]]
        return points

    def _values(self, level: int) -> np.ndarray:
        steps = np.arange(level, dtype=float)
        if self.ends is None or level == 1:
            return (steps + 0.5) / level
        low, high = self.ends
        share = steps / (level - 1)
        return low * (1.0 - share) + high * share


@dataclass(frozen=True)
class OneAtATime(_Design):
    """Fly the middle of all, then each dimension at each of some values while the others stay in the middle.

    1 + d k cases: case 0 is the middle, cases 1 ... k move the first dimension.

    Parameters
    ----------
    dimensions : of the cube, d.
    values : k probabilities; by default those of -3 and 3 deviations of a normal number.
    """

    dimensions: int
    values: tuple[float, ...] = THREE_SIGMA

    def __post_init__(self) -> None:
        check_dimensions(self.dimensions)
        if not self.values or not all(0.0 <= value <= 1.0 for value in self.values):
            raise CampaignError(f"one at a time takes {list(self.values)}; expected probabilities from 0 to 1")
        _check_size(self.cases, f"{self.dimensions} dimensions with {len(self.values)} values")

    @property
    def cases(self) -> int:
        """1 + d k."""
        return 1 + self.dimensions * len(self.values)

    def _points(self, seed: int, first: int, last: int) -> np.ndarray:
        points = np.full((last - first, self.dimensions), 0.5)
        moved = np.arange(max(first, 1), last)
        dimension, value = np.divmod(moved - 1, len(self.values))
        points[moved - first, dimension] = np.array(self.values)[value]
        return points


def _digits(bases: tuple[int, ...], first: int, last: int) -> np.ndarray:
    """Return numbers first ... last - 1 written with digits of these bases, (last - first, digits)."""
    rest = np.arange(first, last)
    digits = np.empty((last - first, len(bases)), dtype=np.int64)
    for place in range(len(bases) - 1, -1, -1):
        rest, digits[:, place] = np.divmod(rest, bases[place])
    return digits


def _check_ends(ends: tuple[float, float]) -> None:
    low, high = ends
    if not 0.0 <= low < high <= 1.0:
        raise CampaignError(f"ends are {low:g} and {high:g}; expected probabilities, 0 <= low < high <= 1")


def _check_size(cases: int, told: str) -> None:
    if cases > MOST_CASES:
        raise CampaignError(f"{told} make more than {MOST_CASES} cases; take fewer dimensions, or a random plan")
