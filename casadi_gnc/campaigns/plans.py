"""Plans that fill the cube at random: independent, Latin hypercube, scrambled Sobol."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from casadi_gnc.campaigns.draws import Purpose, odd_multiples, uniforms, words
from casadi_gnc.campaigns.permutation import permuted
from casadi_gnc.campaigns.plan import Plan, check_cases, check_dimensions
from casadi_gnc.errors import CampaignError

#: Binary digits of the engine's points; with more, it cannot go forward to a case without those before it.
_SOBOL_BITS = 32


@dataclass(frozen=True)
class Independent(Plan):
    """Draw every number by itself: the plan to which every bound and interval applies.

    Parameters
    ----------
    dimensions : of the cube.
    """

    dimensions: int

    def __post_init__(self) -> None:
        check_dimensions(self.dimensions)

    def _points(self, seed: int, first: int, last: int) -> np.ndarray:
        return uniforms(seed, Purpose.POINTS, np.arange(first, last), self.dimensions)


@dataclass(frozen=True)
class LatinHypercube(Plan):
    """Put one case into each of n equal cells of every dimension, cells of different dimensions matched at random.

    Means of what is nearly a sum of effects of single dimensions come out more exact than from independent cases.
    McKay, Beckman, Conover (1979), doi:10.2307/1268522.

    Parameters
    ----------
    dimensions : of the cube.
    cells : n, the number of cases.
    """

    dimensions: int
    cells: int

    def __post_init__(self) -> None:
        check_dimensions(self.dimensions)
        check_cases(self.cells)

    @property
    def cases(self) -> int:
        """The number of cells."""
        return self.cells

    def _points(self, seed: int, first: int, last: int) -> np.ndarray:
        numbers = np.arange(first, last)
        bits = words(seed, Purpose.POINTS, numbers, self.dimensions)
        # Cell and place in it share the 53 digits of a float, so that no sum is rounded into the next cell.
        kept = 52 - self.cells.bit_length()
        points = np.empty(bits.shape)
        for dimension in range(self.dimensions):
            cell = permuted(seed, dimension, self.cells, numbers).astype(float)
            points[:, dimension] = (cell + odd_multiples(bits[:, dimension], kept)) / self.cells
        return points


@dataclass(frozen=True)
class Sobol(Plan):
    """Fill the cube evenly: Sobol's sequence, scrambled by a random matrix and a random shift.

    Any number of cases may be taken; powers of two are filled best. Means of smooth quantities converge nearly like
    1/n. Bounds for independent cases then stay on the safe side mostly, without a proof. SciPy's engine (direction
    numbers of Joe and Kuo 2008, doi:10.1137/070709359; scrambling of Matousek 1998, doi:10.1006/jcom.1998.0489) gives
    32 binary digits, the counter-based generator those behind them.

    Parameters
    ----------
    dimensions : of the cube, at most 21201.
    """

    dimensions: int

    def __post_init__(self) -> None:
        check_dimensions(self.dimensions)
        if self.dimensions > 21201:
            raise CampaignError(f"a Sobol plan of {self.dimensions} dimensions; at most 21201 are known")

    def _points(self, seed: int, first: int, last: int) -> np.ndarray:
        from scipy.stats import qmc

        random = np.random.Generator(np.random.PCG64(seed))
        engine = qmc.Sobol(self.dimensions, scramble=True, bits=_SOBOL_BITS, rng=random)
        parts = []
        if first == 0:
            parts.append(engine.random(1))  # one by itself: asked for more, the engine wants a power of two
        else:
            engine.fast_forward(first)
        if last > max(first, 1):
            parts.append(engine.random(last - max(first, 1)))
        # Cells of 2^-32 and 20 digits of the place in them: the sum is exact, and neither 0 nor 1 comes out.
        bits = words(seed, Purpose.POINTS, np.arange(first, last), self.dimensions)
        return np.concatenate(parts) + odd_multiples(bits, 52 - _SOBOL_BITS) * 0.5**_SOBOL_BITS
