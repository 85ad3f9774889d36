"""What a sampling plan is: a function from (seed, range of cases) to points of the unit cube."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np

from casadi_gnc.campaigns.draws import MOST_CASES, check_seed
from casadi_gnc.errors import CampaignError


class Plan(ABC):
    """Give each case of a campaign a point of the unit cube.

    A case's point depends on the seed, the plan and the number of the case alone: any split of a range gives the same
    rows bit for bit, on every machine.
    """

    #: Of the cube.
    dimensions: int
    #: Whether cases stand for what happens, so that shares, percentiles and drivers of them mean something.
    representative: bool = True

    @property
    def cases(self) -> int | None:
        """How many cases the plan has; None where any number will do."""
        return None

    def points(self, seed: int, first: int, last: int) -> np.ndarray:
        """Return the points of the cases first ... last - 1, (last - first, dimensions), each number in [0, 1].

        Raises
        ------
        CampaignError
            For a seed beyond 64 bits, or a range that the plan does not have.
        """
        self._check(seed, first, last)
        return self._points(seed, first, last) if first < last else np.empty((0, self.dimensions))

    def weights(self, seed: int, first: int, last: int) -> np.ndarray:
        """Return how much each case counts, (last - first,): 1 unless the plan prefers some region."""
        self._check(seed, first, last)
        return np.ones(last - first)

    def noise_numbers(self, first: int, last: int) -> np.ndarray:
        """Return the numbers by which noise is drawn, (last - first,): cases with the same one fly in the same noise.

        The case's own number, unless the plan compares cases with each other.
        """
        return np.arange(first, last)

    def _check(self, seed: int, first: int, last: int) -> None:
        check_seed(seed)
        most = MOST_CASES if self.cases is None else self.cases
        if not 0 <= first <= last <= most:
            raise CampaignError(f"cases {first} to {last - 1} are asked for; the plan has cases 0 to {most - 1}")

    @abstractmethod
    def _points(self, seed: int, first: int, last: int) -> np.ndarray:
        """Return the points of a range that is known to be good and not empty."""


def check_dimensions(dimensions: int) -> None:
    """Raise `CampaignError` for a cube without dimensions, or with more than the generator tells apart."""
    if not 1 <= dimensions < 2**24:
        raise CampaignError(f"a plan of {dimensions} dimensions; expected 1 to {2**24 - 1}")


def check_cases(cases: int) -> None:
    """Raise `CampaignError` for a number of cases that no campaign has."""
    if not 1 <= cases <= MOST_CASES:
        raise CampaignError(f"a plan of {cases} cases; expected 1 to {MOST_CASES}")
