"""Numbers that vary together: a block of jointly normal ones."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from casadi_gnc.campaigns.distributions import Distribution, normals
from casadi_gnc.errors import CampaignError


@dataclass(frozen=True)
class Correlated(Distribution):
    """A block of jointly normal numbers.

    Parameters
    ----------
    mean : (k,).
    covariance : (k, k), symmetric, positive semidefinite.

    Raises
    ------
    CampaignError
        For shapes that do not fit and a covariance that no numbers have.
    """

    mean: tuple[float, ...]
    covariance: tuple[tuple[float, ...], ...]

    def __post_init__(self) -> None:
        size = len(self.mean)
        if len(self.covariance) != size or any(len(row) != size for row in self.covariance):
            lengths = [len(row) for row in self.covariance]
            raise CampaignError(
                f"the mean has {size} numbers, rows of the covariance {lengths}; expected {size} of {size}"
            )
        check_covariance(self.covariance)

    @property
    def dimensions(self) -> int:  # pyright: ignore[reportIncompatibleVariableOverride]
        """As many as values."""
        return len(self.mean)

    @property
    def values(self) -> int:  # pyright: ignore[reportIncompatibleVariableOverride]
        """As many as the mean has."""
        return len(self.mean)

    def at(self, points: np.ndarray) -> np.ndarray:
        """Return mean + L z with L L' = covariance."""
        standard = normals(points, None)
        found = np.tile(np.array(self.mean), (len(points), 1))
        for i, row in enumerate(factor(self.covariance)):
            for j, number in enumerate(row):  # BLAS sums differently for other numbers of rows
                if number != 0.0:
                    found[:, i] += number * standard[:, j]
        return found


def check_covariance(covariance: tuple[tuple[float, ...], ...]) -> None:
    """Raise `CampaignError` where no numbers have such a covariance, saying why."""
    matrix = np.array(covariance)
    largest = float(np.abs(matrix).max())
    skew = float(np.abs(matrix - matrix.T).max())
    if skew > 1e-9 * largest:
        raise CampaignError(
            f"the covariance is not symmetric: entries differ from their mirror images by up to {skew:.3g}"
        )
    smallest = float(np.linalg.eigvalsh(matrix)[0])
    if smallest < -1e-9 * largest:
        raise CampaignError(
            f"the covariance is not positive semidefinite: its smallest eigenvalue is {smallest:.3g}; no numbers are "
            "correlated so. Look for a correlation beyond 1 or a sign"
        )


def factor(covariance: tuple[tuple[float, ...], ...]) -> list[list[float]]:
    """Return L, (k, k), with L L' = covariance, of a positive semidefinite matrix, the same bits on every machine.

    Cholesky's factor with rows taken by the largest pivot, which stops where the matrix ends: Hammarling, Higham, Lucas
    (2007), doi:10.1007/978-3-540-75755-9_17. Plain sums: a library's factor depends on the machine.
    """
    size = len(covariance)
    rest = [list(map(float, row)) for row in covariance]
    end = size * 2.0**-52 * max((rest[i][i] for i in range(size)), default=0.0)
    lower = [[0.0] * size for _ in range(size)]
    left = list(range(size))
    for column in range(size):
        pivot = max(left, key=lambda i: rest[i][i])
        if rest[pivot][pivot] <= end:
            break
        left.remove(pivot)
        lower[pivot][column] = math.sqrt(rest[pivot][pivot])
        for i in left:
            lower[i][column] = 0.5 * (rest[i][pivot] + rest[pivot][i]) / lower[pivot][column]
        for i in left:
            for j in left:
                rest[i][j] -= lower[i][column] * lower[j][column]
    return lower
