"""The disk margin of all channels at once, each with a factor of its own, by bounds on mu.

`margins.disk_of_all` takes the largest singular value, which lets the factors mix channels and may be far too small.
With S - T = (1 + L)^-1 (1 - L) and d = (f - 1)/(f + 1) of each channel, I + F L is singular where I - (S - T) Delta is,
Delta = diag(d): the loop bears all factors with abs(d) < alpha/2 up to

    alpha = 2 / max over frequencies of mu(S - T),    mu of as many complex numbers as channels.

Where it is least is looked for with S - T balanced by a diagonal D, D (S - T) D^-1 (Osborne's iteration), whose
largest singular value is no less than mu; there mu is enclosed, and at further frequencies as long as that value is
larger there than mu was here. Up to three channels both bounds are mu itself.

Source: Seiler, Packard, Gahinet (2020), doi:10.1109/MCS.2020.3005277, on multiple loops.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from casadi_gnc.checking.margins import BrokenLoop, least
from casadi_gnc.synthesis import MuBounds, Uncertainty, mu_bounds

#: Rounds of the balancing, and to which part the upper bound on mu is bisected.
_ROUNDS, _RELATIVE = 30, 1e-5
#: Below this the norm of a row or column is nothing.
_TINY = 1e-100
#: At most so many further frequencies, those where more than this share could be lost.
_MOST, _ENOUGH = 24, 1e-3


@dataclass(frozen=True, eq=False)
class StructuredDisk:
    """Hold how large a disk all channels bear at once.

    Parameters
    ----------
    proved : alpha that is borne at all frequencies that were looked at, thousands; where it is least by a certified
        upper bound on mu.
    broken : alpha of the factors below, with which the loop has a pole on the boundary; inf where none were found.
    at : the frequency where it is least, [rad/s].
    factors : (channels,), complex, which break it; empty where none were found.
    """

    proved: float
    broken: float
    at: float
    factors: tuple[complex, ...]

    @property
    def gains(self) -> tuple[float, ...]:
        """Magnitudes of the factors that break it."""
        return tuple(map(abs, self.factors))

    @property
    def phases(self) -> tuple[float, ...]:
        """Turns of the factors that break it, [rad]."""
        return tuple(map(cmath.phase, self.factors))


def structured_disk(loop: BrokenLoop) -> StructuredDisk:
    """Return the disk that all channels of a loop bear at once, each with a factor of its own.

    Raises
    ------
    SynthesisError
        Where no back end certifies an upper bound.
    """

    def alpha(w: Any) -> np.ndarray:
        return 2 / np.linalg.norm(_balanced(_difference(loop, w)), 2, axis=(-2, -1))

    def enclosed(w: float) -> MuBounds:
        return mu_bounds(_difference(loop, w), [Uncertainty("complex")] * loop.channels, relative=_RELATIVE)

    grid = loop.frequencies()
    known = alpha(grid)
    _, at = least(grid, known, lambda w: float(alpha(w)))
    found = enclosed(at)
    for _ in range(_MOST):  # where the balanced value is smaller, mu may be larger
        i = int(np.argmin(known))
        if known[i] >= (1 - _ENOUGH) * 2 / found.upper:
            break
        other = enclosed(grid[i])
        known[i] = 2 / other.upper
        if other.upper > found.upper:
            found, at = other, float(grid[i])
    factors: tuple[complex, ...] = ()
    if found.perturbation is not None:
        turns = np.diag(found.perturbation)
        factors = tuple(complex(each) for each in (1 + turns) / (1 - turns))
    broken = 2 / found.lower if factors else math.inf
    return StructuredDisk(min(2 / found.upper, float(known.min())), broken, at, factors)


def _difference(loop: BrokenLoop, w: Any) -> np.ndarray:
    """Return S - T at frequencies, (..., channels, channels)."""
    one, L = np.eye(loop.channels), loop.at(w)
    return np.linalg.solve(one + L, one - L)


def _balanced(M: np.ndarray) -> np.ndarray:
    """Return D M D^-1 with rows and columns, without the diagonal, of like norm; (..., n, n)."""
    found, size = np.array(M), M.shape[-1]
    others = ~np.eye(size, dtype=bool)
    for _ in range(_ROUNDS):
        for i in range(size):
            row = np.linalg.norm(found[..., i, :] * others[i], axis=-1)
            column = np.linalg.norm(found[..., :, i] * others[i], axis=-1)
            # Where one of them is nothing the other may become as small as one likes, a step at a time.
            scale = np.clip(np.sqrt((column + _TINY) / (row + _TINY)), 1e-3, 1e3)
            found[..., i, :] *= scale[..., None]
            found[..., :, i] /= scale[..., None]
    return found
