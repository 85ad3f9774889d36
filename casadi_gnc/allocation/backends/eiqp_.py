"""Allocation without uncertainty by EIQP: an interior point whose number of iterations is known beforehand.

The box is shifted to 0 <= x <= r; with multipliers y of the upper bounds, z = (x, y) has n = 2 N entries and solves the
linear complementarity problem s = M z + p >= 0, z's = 0,

    M = [H, I; -I, 0],    p = (g, r).

It is made homogeneous by a scalar t > 0 with its own slack k:  s = M z + p t,  k = -z'M z/t - z'p, which is started at
ones whatever the data. A full Newton step with the residuals and the complementarity both aimed at (1 - b) times their
value, b = 0.414213/sqrt(n + 1), takes both there exactly, so that after

    ceil( log((n + 1)/epsilon) / -log(1 - b) )

iterations z's + t k is at most epsilon, neither more nor fewer: the count depends on n and epsilon alone. x/t is the
answer. Before that x is scaled to a box of ones and the cost to a largest coefficient of one. Actuators whose bounds
meet are no unknowns.

Source: L. Wu, W. Xiao, R. D. Braatz, "EIQP: Execution-time-certified and Infeasibility-detecting QP Solver", 2025,
arXiv:2502.07738; the homogeneous problem is that of E. D. Andersen, Y. Ye, 1999, doi:10.1007/s101070050027.
"""

from __future__ import annotations

import math

import numpy as np

from casadi_gnc.allocation.backends import Capability, Found
from casadi_gnc.allocation.backends.scaling import QuadraticProgram, Sample, positive
from casadi_gnc.allocation.problem import AllocationProblem

CAPABILITIES = Capability.EXACT | Capability.QP
REQUIRES: tuple[str, ...] = ()
ACCURACY = (1e-6, 1e-10)
_SHARE = 0.414213


def iterations_of(constraints: int, epsilon: float) -> int:
    """Return the number of iterations for n constraints to an accuracy."""
    return math.ceil(math.log((constraints + 1) / epsilon) / -math.log(1 - _SHARE / math.sqrt(constraints + 1)))


class _EIQP(QuadraticProgram):
    tries = 1  # the count is known only if there is one try

    def __init__(self, problem: AllocationProblem, tolerance: float) -> None:
        super().__init__(problem)
        self._tolerance = tolerance

    def attempt(self, sample: Sample) -> Found:
        """Return the scaled forces after the known number of iterations."""
        movable = sample.upper > sample.lower
        linear = (self.gradient(sample) + self.hessian @ sample.lower)[movable]
        forces = sample.lower.copy()
        count = iterations_of(2 * int(movable.sum()), self._tolerance) if np.any(movable) else 0
        if count:
            room = (sample.upper - sample.lower)[movable]
            hessian, linear = room[:, None] * self.hessian[np.ix_(movable, movable)] * room, room * linear
            size = max(np.max(np.abs(hessian)), np.max(np.abs(linear)), 1e-300)
            forces[movable] += room * solve(hessian / size, linear / size, np.ones(len(room)), count)
        return Found(forces, self.equal, count, bool(np.all(np.isfinite(forces))))


def solve(hessian: np.ndarray, linear: np.ndarray, room: np.ndarray, count: int) -> np.ndarray:
    """Return x of the box 0 <= x <= room after so many full Newton steps, (N,)."""
    size = len(linear)
    share = _SHARE / math.sqrt(2 * size + 1)
    x, y, s, w = (np.ones(size) for _ in range(4))  # s belongs to x, w to y
    t = k = 1.0
    with np.errstate(all="ignore"):  # what is not finite is told by its caller
        for _ in range(count):
            hx = hessian @ x
            curved = float(x @ hx)
            lack = (s - hx - y - linear * t, w + x - room * t, k + curved / t + float(x @ linear + y @ room))
            aim = (1 - share) * (float(x @ s + y @ w) + t * k) / (2 * size + 1)
            ratio = y / w
            first = aim / x - s + share * lack[0]
            second = aim / y - w + share * lack[1]
            kkt = hessian + np.diag(s / x + ratio)
            both = np.linalg.solve(kkt, np.column_stack([first - ratio * second, linear - ratio * room]))
            # dx = both[:, 0] - both[:, 1] dt, dy = ratio (second + dx - room dt): the last equation has dt alone
            rest = ratio * (second + both[:, 0])
            gains = ratio * (-both[:, 1] - room)
            towards = -(2 * hx / t + linear)
            plain = float(towards @ both[:, 0] - room @ rest) - share * lack[2]
            slope = float(-towards @ both[:, 1] - room @ gains) + curved / t**2
            dt = (aim - t * k - t * plain) / (k + t * slope)
            dx, dy = both[:, 0] - both[:, 1] * dt, rest + gains * dt
            ds, dw = hessian @ dx + dy + linear * dt - share * lack[0], -dx + room * dt - share * lack[1]
            x, y, s, w, t = x + dx, y + dy, s + ds, w + dw, t + dt
            # The last row is not linear: its slack is what leaves (1 - share) of its residual.
            k = (1 - share) * lack[2] - float(x @ (hessian @ x)) / t - float(x @ linear + y @ room)
    return x / t


def set_up(problem: AllocationProblem, *, tolerance: float = 1e-13) -> _EIQP:
    """Return the quadratic program of a problem; the tolerance is epsilon."""
    positive(tolerance=tolerance)
    return _EIQP(problem, tolerance)
