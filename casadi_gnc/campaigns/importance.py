"""A plan that prefers one region, with the weights that undo it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from casadi_gnc.campaigns.plan import Plan
from casadi_gnc.campaigns.plans import Independent
from casadi_gnc.errors import CampaignError
from casadi_gnc.mathematics import elementary, normal

#: The ends of the open unit interval, for points that rounding puts on the edge.
_LOWEST, _HIGHEST = 2.0**-53, 1.0 - 2.0**-53


@dataclass(frozen=True)
class Importance(Plan):
    """Move most cases along a direction, and weigh every case so that shares and means stay right.

    In standard normal coordinates z (each dimension's quantile) most cases are shifted by `shift` deviations along the
    direction a; a part of them is left where it was. A case at z has the weight

        w = 1 / (c + (1 - c) exp(shift a'z - shift^2/2)),    c the part left,

    the density that is meant over the one that was drawn. The part left bounds every weight by 1/c: without it one
    case from the far side could outweigh all (Owen and Zhou 2000, doi:10.1080/01621459.2000.10473909).

    Parameters
    ----------
    direction : (d,), of any length; where in the cube it goes wrong, in deviations.
    shift : how many deviations, best the distance at which it begins to go wrong.
    left : c, part of the cases that is drawn as meant.
    base : plan of d + 1 dimensions that is moved, the last to choose which cases are left; independent if None.
    """

    direction: tuple[float, ...]
    shift: float
    left: float = 0.1
    base: Plan | None = None

    def __post_init__(self) -> None:
        length = math.hypot(*self.direction)
        if not 0.0 < length < math.inf:
            raise CampaignError(f"the direction of importance is {list(self.direction)}; expected a vector, not zero")
        if not 0.0 <= self.shift <= 8.0:
            raise CampaignError(f"a shift by {self.shift:g} deviations; expected 0 to 8, beyond which numbers run out")
        if not 0.0 < self.left <= 1.0:
            raise CampaignError(f"{self.left:g} of the cases are left; expected a part above 0, up to 1")
        if self.base is not None and self.base.dimensions != self.dimensions + 1:
            raise CampaignError(
                f"the plan that is moved has {self.base.dimensions} dimensions; expected {self.dimensions + 1}, "
                "one more than the direction"
            )

    @property
    def dimensions(self) -> int:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Of the cube."""
        return len(self.direction)

    @property
    def cases(self) -> int | None:
        """Those of the plan that is moved."""
        return self._base.cases

    def weights(self, seed: int, first: int, last: int) -> np.ndarray:
        """Return the weight of each case, (last - first,), above 0 and at most 1/left; their mean tends to 1."""
        drawn = normal.quantile(self.points(seed, first, last))
        along = np.zeros(len(drawn))
        for unit, column in zip(self._unit, drawn.T, strict=True):  # BLAS sums differently for other numbers of rows
            along += unit * column
        ratio = elementary.exp(self.shift * along - 0.5 * self.shift * self.shift)
        return 1.0 / (self.left + (1.0 - self.left) * ratio)

    def _points(self, seed: int, first: int, last: int) -> np.ndarray:
        base = self._base.points(seed, first, last)
        moved = np.where(base[:, -1] < self.left, 0.0, self.shift)
        points = base[:, :-1].copy()
        for dimension, unit in enumerate(self._unit):
            if unit != 0.0:
                shifted = normal.cumulative(normal.quantile(points[:, dimension]) + moved * unit)
                column = np.minimum(np.maximum(shifted, _LOWEST), _HIGHEST)
                points[:, dimension] = np.where(moved > 0.0, column, points[:, dimension])
        return points

    @property
    def _base(self) -> Plan:
        return Independent(self.dimensions + 1) if self.base is None else self.base

    @property
    def _unit(self) -> tuple[float, ...]:
        length = math.sqrt(sum(each * each for each in self.direction))
        return tuple(each / length for each in self.direction)
