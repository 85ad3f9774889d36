"""The set in which a search may go: what the dispersions allow, and how far the normal ones.

==========  ===========================================================================================
set         points
==========  ===========================================================================================
contour     normal coordinates together within a radius, all others within their ends: where the density
            is no less than on the contour through so many standard deviations
box         every coordinate by itself: normal ones within the radius, all others within their ends
ellipsoid   all coordinates together: the largest ellipsoid in that box
==========  ===========================================================================================
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from casadi_gnc.errors import CampaignError
from casadi_gnc.tuning.space import Space

Kind = Literal["contour", "box", "ellipsoid"]


@dataclass(frozen=True, eq=False)
class Reach:
    """Hold a set of points in standard units.

    Parameters
    ----------
    space : of the points.
    kind : see above.
    radius : in standard deviations of what is normal, above 0.

    Raises
    ------
    CampaignError
        For another kind, and a radius that is none.
    """

    space: Space
    kind: Kind = "contour"
    radius: float = 4.0

    def __post_init__(self) -> None:
        if self.kind not in get_args(Kind):
            raise CampaignError(f"the set is {self.kind!r}; expected one of {', '.join(get_args(Kind))}")
        if not 0 < self.radius < 8:
            raise CampaignError(f"the set reaches {self.radius:g} standard deviations; expected above 0 and below 8")

    @property
    def ends(self) -> np.ndarray:
        """The largest coordinates, (p,)."""
        return np.minimum(self.space.high, self.radius)

    def nearest(self, points: np.ndarray) -> np.ndarray:
        """Return points, (n, p), moved into the set; those that are inside stay."""
        ends = self.ends
        found = np.clip(points, -ends, ends)
        if self.kind == "box":
            return found
        together = self.space.dense if self.kind == "contour" else ~self.space.discrete
        scale = self.radius if self.kind == "contour" else ends
        size = np.sqrt((np.where(together & ~np.isnan(found), found / scale, 0.0) ** 2).sum(axis=1, keepdims=True))
        return np.where(together, found / np.maximum(size, 1.0), found)

    def filled(self, cube: np.ndarray) -> np.ndarray:
        """Return points of the set for points of the unit cube, (n, p), that fill it."""
        return self.nearest((2.0 * cube - 1.0) * self.ends)

    def lowest(self, slope: np.ndarray, start: np.ndarray) -> np.ndarray:
        """Return where in the set a linear function of this slope is least, (p,); coordinates without slope stay."""
        ends, flat = self.ends, slope == 0.0
        corner = -np.sign(slope) * ends
        if self.kind != "box":
            together = self.space.dense if self.kind == "contour" else ~self.space.discrete
            scale = np.full(self.space.size, self.radius) if self.kind == "contour" else ends
            weighed = np.where(together, slope * scale, 0.0)
            size = float(np.sqrt((weighed * weighed).sum()))
            corner = np.where(together, -weighed * scale / (size or 1.0), corner)
        return self.nearest(np.where(flat, start, corner)[None, :])[0]
