"""The plan behind sensitivity indices: pairs of cases that share all inputs but one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from casadi_gnc.campaigns.plan import Plan
from casadi_gnc.errors import CampaignError


@dataclass(frozen=True)
class PickFreeze(Plan):
    """Fly blocks of g + 2 cases: A, B, and for each of g groups of dimensions A with that group taken from B.

    Saltelli et al. (2010), doi:10.1016/j.cpc.2009.09.018, radial arrangement. Block k is cases k (g + 2) ...; any whole
    blocks serve `casadi_gnc.campaigns.sensitivity.indices`. A and B are the halves of a point of the base plan.

    Parameters
    ----------
    base : plan of 2 d dimensions; Sobol is the usual one.
    groups : how many dimensions each group has, together d: one of several for what is dispersed as a whole, such as a
        direction or a correlated block.
    """

    base: Plan
    groups: tuple[int, ...]
    #: Cases of a block share inputs, so bounds for independent ones do not hold.
    representative = False

    def __post_init__(self) -> None:
        if not self.groups or min(self.groups) < 1:
            raise CampaignError(f"groups of {list(self.groups)} dimensions; expected one or more, of at least 1 each")
        if self.base.dimensions != 2 * sum(self.groups):
            raise CampaignError(
                f"the base plan has {self.base.dimensions} dimensions; expected {2 * sum(self.groups)}, twice those "
                "of the groups"
            )

    @property
    def dimensions(self) -> int:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Of the cube."""
        return sum(self.groups)

    @property
    def block(self) -> int:
        """Cases of a block, g + 2."""
        return len(self.groups) + 2

    @property
    def cases(self) -> int | None:
        """A block for each case of the base plan."""
        return None if self.base.cases is None else self.base.cases * self.block

    def noise_numbers(self, first: int, last: int) -> np.ndarray:
        """Return the numbers of blocks: noise is the same within a block, and none of it is taken for an input's."""
        return np.arange(first, last) // self.block

    def _points(self, seed: int, first: int, last: int) -> np.ndarray:
        block, member = np.divmod(np.arange(first, last), self.block)
        pairs = self.base.points(seed, int(block[0]), int(block[-1]) + 1)[block - block[0]]
        a, b = pairs[:, : self.dimensions], pairs[:, self.dimensions :]
        group = np.repeat(np.arange(len(self.groups)), self.groups)
        from_b = (member[:, None] == 1) | (member[:, None] == group + 2)
        return np.where(from_b, b, a)
