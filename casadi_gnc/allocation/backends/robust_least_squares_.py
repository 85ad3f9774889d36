"""Robust least squares, as published for control allocation: the worst error over a ball or an ellipsoid of errors.

    rls         minimise over the box  max |u - (A + dA) F|   over all dA with |dA| <= rho
    ellipsoid   minimise over the box  max |u - (Ac + sum_i d_i A_i) F|   over all d with |d| <= 1

The first knows of the errors only how large they are: its maximum is |u - A F| + rho |F|, for the spectral as for the
Frobenius norm, and makes a second-order cone program. (Where u is uncertain too, as in the first paper, rho |F| becomes
rho (|F|^2 + 1)^1/2; here it is a command.) rho is the largest |D_v E| of the vertices, so that the ball holds them all.

The second knows how the errors enter. With r = Ac F - u and M = [A_1 F, ...], the S-procedure, exact for one ball,
says that |r + M d| <= t for all |d| <= 1 just where some s >= 0 makes

    [ t - s   0     r' ]
    [ 0       s I   M' ]  >= 0 ,
    [ r       M     t I]

a semidefinite program in (F, t, s). The ellipsoid is the one of least volume that holds the vertices D_v; for the
corners of a box of p errors its half-axes are p^1/2 times those of the box.

Neither weighs effort or change. Among forces of equal error the least are taken, by 1e-9 of their squares.

Sources: L. El Ghaoui, H. Lebret, "Robust solutions to least-squares problems with uncertain data", SIAM Journal on
Matrix Analysis and Applications 18 (1997), doi:10.1137/S0895479896298130; L. Cui, Y. Yang, "Disturbance rejection and
robust least-squares control allocation in flight control system", Journal of Guidance, Control, and Dynamics 34 (2011),
doi:10.2514/1.52234. Ellipsoid: L. G. Khachiyan, "Rounding of polytopes in the real number model of computation",
Mathematics of Operations Research 21 (1996), doi:10.1287/moor.21.2.307.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from scipy import sparse

from casadi_gnc.allocation.backends import BackEnd, Capability, Found
from casadi_gnc.allocation.backends.clarabel_ import ClarabelSolver
from casadi_gnc.allocation.backends.conic import ConicForm
from casadi_gnc.allocation.backends.scaling import Sample, ScaledSolver
from casadi_gnc.allocation.problem import AllocationProblem

_TIE = 1e-9  # of |x|^2 beside an error, both in units near one
_FLAT = 1e-9  # directions of the errors below this share of the largest are none
_ROUNDS, _ROUND = 2000, 1e-7  # of Khachiyan's iteration: at most so many, to this share of the volume's condition


def radius(problem: AllocationProblem) -> float:
    """Return rho, the largest spectral norm of the errors D_v E, in the unit of the effectiveness."""
    if not problem.is_robust:
        return 0.0
    return max(float(np.linalg.norm(error @ problem.coupling, 2)) for error in problem.errors)


def ellipsoid_of(problem: AllocationProblem) -> tuple[np.ndarray, np.ndarray]:
    """Return Ac, (R, N), and the A_i, (p, R, N), of the least ellipsoid about the vertices; p is their dimension."""
    points = problem.errors.reshape(len(problem.errors), -1)
    centre, shape = _least_ellipsoid(points)
    rows = (len(shape), *problem.errors.shape[1:])
    middle = problem.effectiveness + centre.reshape(rows[1:]) @ problem.coupling
    return middle, shape.reshape(rows) @ problem.coupling


def _least_ellipsoid(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the centre, (n,), and the half-axes, (p, n), of the ellipsoid of least volume that holds the points."""
    mean = points.mean(axis=0)
    _, sizes, axes = np.linalg.svd(points - mean, full_matrices=False)
    axes = axes[sizes > _FLAT * max(sizes[0], 1e-300)] if sizes.size else axes[:0]
    if not len(axes):
        return mean, axes
    flat = (points - mean) @ axes.T
    flat, unit = flat / np.abs(flat).max(axis=0), np.abs(flat).max(axis=0)
    lifted, shares = np.column_stack([flat, np.ones(len(flat))]), np.full(len(flat), 1 / len(flat))
    order = lifted.shape[1]
    for _ in range(_ROUNDS):
        distances = np.einsum("ki,ij,kj->k", lifted, np.linalg.inv((lifted.T * shares) @ lifted), lifted)
        furthest = int(np.argmax(distances))
        if distances[furthest] <= order * (1 + _ROUND):
            break
        step = (distances[furthest] - order) / (order * (distances[furthest] - 1))
        shares = (1 - step) * shares
        shares[furthest] += step
    middle = shares @ flat
    spread = (order - 1) * ((flat.T * shares) @ flat - np.outer(middle, middle))
    beyond = np.einsum("ki,ij,kj->k", flat - middle, np.linalg.inv(spread), flat - middle).max()
    half = np.linalg.cholesky(spread * beyond).T  # all points are inside, whatever the iteration left
    return mean + (middle * unit) @ axes, (half * unit) @ axes


class BallForm:
    """The first program, in (x, s, t): |B x - b| <= s, |W x| <= t, W = rho I in scaled units; see `conic.ConicForm`."""

    def __init__(self, scaled: ScaledSolver) -> None:
        problem = scaled.problem
        matrix = scaled.in_units(problem.effectiveness)
        weighing = radius(problem) * scaled.in_units(np.eye(problem.count))
        rows, count = matrix.shape
        parts = _box(count, 2), np.zeros((rows + 1, count + 2)), np.zeros((count + 1, count + 2))
        parts[1][0, count] = parts[2][0, count + 1] = -1.0
        parts[1][1:, :count], parts[2][1:, :count] = -matrix, -weighing
        self.matrix = sparse.csc_matrix(np.vstack(parts))
        self.quadratic = _ties(count, 2)
        self.nonnegative, self.second_order = 2 * count, [rows + 1, count + 1]
        self.semidefinite: list[int] = []
        self._count = count

    def linear(self, sample: Sample) -> np.ndarray:
        """Return c: minimise s + t."""
        return np.append(np.zeros(self._count), [1.0, 1.0])

    def right(self, sample: Sample) -> np.ndarray:
        """Return b."""
        return np.concatenate([sample.upper, -sample.lower, [0.0], -sample.target, np.zeros(self._count + 1)])

    def weights(self, multipliers: np.ndarray) -> np.ndarray | None:
        """Return none: the vertices are not looked at."""
        return None


class EllipsoidForm:
    """The second program, in (x, t, s); see `conic.ConicForm`."""

    def __init__(self, scaled: ScaledSolver) -> None:
        middle, parts = ellipsoid_of(scaled.problem)
        middle, parts = scaled.in_units(middle), scaled.in_units(parts)
        rows, count = middle.shape
        axes = len(parts)
        size = 1 + axes + rows
        by_variable = np.zeros((count + 2, size, size))
        by_variable[:count, 0, 1 + axes :] = middle.T
        by_variable[:count, 1 : 1 + axes, 1 + axes :] = parts.transpose(2, 0, 1)
        by_variable[:count] += by_variable[:count].transpose(0, 2, 1)
        by_variable[count] = np.diag([1.0] + [0.0] * axes + [1.0] * rows)
        by_variable[count + 1] = np.diag([-1.0] + [1.0] * axes + [0.0] * rows)
        positive = np.append(np.zeros(count + 1), -1.0)
        cone = -np.array([_triangle(one) for one in by_variable]).T
        self.matrix = sparse.csc_matrix(np.vstack([_box(count, 2), positive, cone]))
        self.quadratic = _ties(count, 2)
        self.nonnegative, self.semidefinite = 2 * count + 1, [size]
        self.second_order: list[int] = []
        self._count, self._size = count, size

    def linear(self, sample: Sample) -> np.ndarray:
        """Return c: minimise t."""
        return np.append(np.zeros(self._count), [1.0, 0.0])

    def right(self, sample: Sample) -> np.ndarray:
        """Return b."""
        constant = np.zeros((self._size, self._size))
        constant[0, -len(sample.target) :] = -sample.target
        return np.concatenate([sample.upper, -sample.lower, [0.0], _triangle(constant + constant.T)])

    def weights(self, multipliers: np.ndarray) -> np.ndarray | None:
        """Return none: the vertices are not looked at."""
        return None


def _box(count: int, more: int) -> np.ndarray:
    return np.hstack([np.vstack([np.eye(count), -np.eye(count)]), np.zeros((2 * count, more))])


def _ties(count: int, more: int) -> sparse.csc_matrix:
    return sparse.csc_matrix(np.diag(np.append(np.full(count, 2 * _TIE), np.zeros(more))))


def _triangle(matrix: np.ndarray) -> np.ndarray:
    """Return the upper triangle, column by column, off-diagonal entries times 2^1/2."""
    column, row = np.tril_indices(len(matrix))
    return matrix[row, column] * np.where(row == column, 1.0, np.sqrt(2))


class _WorstError(ClarabelSolver):
    tries = 1  # another scale mends rounding, not another objective

    def attempt(self, sample: Sample) -> Found:
        """Return Clarabel's scaled forces; they claim nothing, being the least of something else than the cost."""
        return replace(super().attempt(sample), claimed=False)


def _set_up(
    problem: AllocationProblem,
    *,
    form: Callable[[ScaledSolver], ConicForm],
    tolerance: float = 1e-10,
    max_iterations: int = 100,
) -> _WorstError:
    return _WorstError(problem, form, tolerance, max_iterations)


_NONE = (float("inf"), float("inf"))
RLS = BackEnd(
    Capability.ROBUST | Capability.SOCP,
    ("clarabel",),
    _NONE,
    partial(_set_up, form=BallForm),
    OBJECTIVE="the worst error over all errors as large as the vertices, whatever their direction",
)
ELLIPSOID = BackEnd(
    Capability.ROBUST | Capability.SDP,
    ("clarabel",),
    _NONE,
    partial(_set_up, form=EllipsoidForm),
    OBJECTIVE="the worst error over the least ellipsoid that holds the vertices",
)
