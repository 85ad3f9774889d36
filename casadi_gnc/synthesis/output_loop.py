"""A loop u = -K y as a function of the numbers in K: its H-infinity norm and its poles, with their gradients.

| paper | code | meaning |
|---|---|---|
| y = M x + N w | `M`, `N` | measurement |
| A - B K M, E - B K N, C - D K M, F - D K N | `closed` | the closed loop from w to z |
| R = (jw I - A + B K M)^-1 | `inverse` | at the frequency of the peak |

With singular vectors l and r of the peak, the norm has the derivative
-Re l*(D + (C - D K M) R B) dK (N + M R (E - B K N)) r, and a simple pole with vectors l*x = 1 has -l*B dK M x.
At kinks it is that of one of the branches.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from casadi_gnc.synthesis.analysis import h_infinity_norm
from casadi_gnc.synthesis.performance import Performance
from casadi_gnc.synthesis.regions import Region, half_plane

_RELATIVE = 1e-7  # to which the norm is known while it is made small
_DEEP = 1e-3  # of the plant's rate: how deep in their regions poles are to lie
_PRICE = 10.0  # of a plant's rate outside, in natural logarithms of the norm
_DEAR = 100.0  # of a norm above its bound, in those of the gain's size


@dataclass(frozen=True, eq=False)
class OutputLoop:
    """Hold a plant with its measurement and the pattern of a gain.

    Parameters
    ----------
    plant : see `Performance`. M : (r, n). N : (r, q).
    pattern : (m r, k), K's entries, row by row, are pattern @ numbers.
    regions : of the poles, besides the left half plane.
    rate : the plant's own, [rad/s].
    """

    plant: Performance
    M: np.ndarray
    N: np.ndarray
    pattern: np.ndarray
    regions: Sequence[Region]
    rate: float

    def gain(self, numbers: np.ndarray) -> np.ndarray:
        """Return K, (m, r)."""
        return (self.pattern @ numbers).reshape(self.plant.B.shape[1], len(self.M))

    def closed(self, K: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return the closed loop's matrices, from w to z."""
        one = self.plant
        return (
            one.A - one.B @ K @ self.M,
            one.E - one.B @ K @ self.N,
            one.C - one.D @ K @ self.M,
            one.F - one.D @ K @ self.N,
        )

    def outside(self, numbers: np.ndarray) -> tuple[float, np.ndarray]:
        """Return how far the worst pole is from deep enough in its regions, in plant's rates, and the gradient."""
        values, right = np.linalg.eig(self.plant.A - self.plant.B @ self.gain(numbers) @ self.M)
        left = np.linalg.pinv(right).conj().T
        worst, found = -np.inf, np.zeros(len(numbers))
        for i, pole in enumerate(values):
            slope = -(self.plant.B.T @ left[:, i].conj())[:, None] * (self.M @ right[:, i])[None]
            for region in (half_plane(0.0), *self.regions):
                size, vectors = np.linalg.eigh(region.L + pole * region.M + np.conj(pole) * region.M.T)
                if size[-1] > worst:
                    worst, turn = float(size[-1]), vectors[:, -1].conj() @ region.M @ vectors[:, -1]
                    found = self.pattern.T @ (2 * turn * slope).real.ravel()
        return worst / self.rate + _DEEP, found / self.rate

    def norm(self, numbers: np.ndarray) -> tuple[float, np.ndarray]:
        """Return the logarithm of the H-infinity norm with its gradient; infinite where the loop is not stable."""
        a, e, c, f = self.closed(self.gain(numbers))
        found = h_infinity_norm(a, e, c, f, relative=_RELATIVE)
        if not (np.isfinite(found.upper) and found.lower > 0):
            return (np.inf if found.lower > 0 else -np.inf), np.zeros(len(numbers))
        if np.isinf(found.frequency_rad_s):
            response, ahead, behind = f, self.plant.D, self.N
        else:
            inverse = np.linalg.inv(1j * found.frequency_rad_s * np.eye(len(a)) - a)
            response = f + c @ inverse @ e
            ahead, behind = self.plant.D + c @ inverse @ self.plant.B, self.N + self.M @ inverse @ e
        left, sizes, right = np.linalg.svd(response)
        slope = -np.outer(left[:, 0].conj() @ ahead, behind @ right[0].conj()).real
        return float(np.log(sizes[0])), self.pattern.T @ slope.ravel() / sizes[0]

    def priced(self, numbers: np.ndarray) -> tuple[float, np.ndarray]:
        """Return the logarithm of the norm, dearer where a pole lies outside, with its gradient."""
        value, gradient = self.norm(numbers)
        out, slope = self.outside(numbers)
        return (value, gradient) if out <= 0 else (value + _PRICE * out, gradient + _PRICE * slope)

    def size(self, numbers: np.ndarray, gamma: float) -> tuple[float, np.ndarray]:
        """Return the logarithm of the numbers' size, dearer where the norm is above gamma or a pole outside."""
        value, gradient = self.priced(numbers)
        square = float(numbers @ numbers)
        size, slope, over = np.log(square) / 2, numbers / square, value - np.log(gamma)
        return (size, slope) if over <= 0 else (size + _DEAR * over, slope + _DEAR * gradient)
