"""Weighted and sequential least squares by active sets, as in Härkegård (2002).

With D^2 = M1 + M2, Fd the forces that these weights pull to, and the box lower <= F <= upper,

    wls    minimise |D (F - Fd)|^2 + h |A F - u|^2
    sls    minimise |D (F - Fd)|  over the forces that minimise |A F - u|

The first is our problem without uncertainty. The second puts accuracy before all else, which is the limit of the first
for large h: another objective wherever effort is worth an error.

Both are least squares in a box, solved with a working set of actuators that are held at their bounds: minimise over the
others; where a bound is met on the way, hold that actuator too; at a minimum, let go the one whose multiplier has the
most wrong sign. The second problem of `sls` keeps A F: its steps stay in the null space of the free columns. Both start
from the working set of the last sample.

Source: O. Härkegård, "Efficient active set algorithms for solving constrained least squares problems in aircraft
control allocation", IEEE CDC 2002, doi:10.1109/CDC.2002.1184694.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from casadi_gnc.allocation.backends import BackEnd, Capability, Found
from casadi_gnc.allocation.backends.scaling import Sample, ScaledSolver, positive
from casadi_gnc.allocation.problem import AllocationProblem

_RANK = 1e-10  # singular values below this share of the largest are none
SEQUENTIAL = "least effort over the forces of least error: accuracy before all else"


@dataclass(frozen=True, eq=False)
class BoxedLeastSquares:
    """Hold where an active set ended.

    Parameters
    ----------
    forces : (N,), in the box.
    working : (N,), -1 held at the lower bound, 1 at the upper, 0 free.
    ended : whether all multipliers have the right sign.
    """

    forces: np.ndarray
    working: np.ndarray
    iterations: int
    ended: bool


def boxed_least_squares(
    matrix: np.ndarray,
    target: np.ndarray,
    box: tuple[np.ndarray, np.ndarray],
    start: BoxedLeastSquares,
    tolerance: float,
    most: int,
    kept: np.ndarray | None = None,
) -> BoxedLeastSquares:
    """Return the x that minimises |matrix x - target| in the box, from a start, with ``kept @ x`` as there."""
    lower, upper = box
    movable = upper > lower
    working = np.where(movable, start.working, -1)
    x = np.clip(start.forces, lower, upper)
    if kept is None:  # else the start must stay where it is
        x = np.where(working < 0, lower, np.where(working > 0, upper, x))
    else:
        working = np.where((working < 0) & (x > lower) | (working > 0) & (x < upper), 0, working)
        working = np.where(movable, working, -1)
    for iteration in range(1, most + 1):
        free = working == 0
        step = np.zeros(len(x))
        if np.any(free):
            step[free] = _step(matrix[:, free], target - matrix @ x, None if kept is None else kept[:, free])
        room = np.full(len(x), np.inf)
        up, down = free & (step > 0), free & (step < 0)
        room[up], room[down] = (upper - x)[up] / step[up], (lower - x)[down] / step[down]
        blocking = int(np.argmin(room))
        if room[blocking] < 1.0:
            x = np.clip(x + max(room[blocking], 0.0) * step, lower, upper)
            working[blocking] = 1 if step[blocking] > 0 else -1
            x[blocking] = upper[blocking] if step[blocking] > 0 else lower[blocking]
            continue
        x = np.clip(x + step, lower, upper)
        gradient = matrix.T @ (matrix @ x - target)
        if kept is not None:
            prices = np.linalg.lstsq(kept[:, free].T, gradient[free], _RANK)[0] if np.any(free) else np.zeros(len(kept))
            gradient = gradient - kept.T @ prices
        multipliers = np.where(movable, -working * gradient, np.inf)
        multipliers[free] = np.inf
        worst = int(np.argmin(multipliers))
        if multipliers[worst] >= -tolerance:
            return BoxedLeastSquares(x, working, iteration, ended=True)
        working[worst] = 0
    return BoxedLeastSquares(x, working, most, ended=False)


def _step(columns: np.ndarray, residual: np.ndarray, kept: np.ndarray | None) -> np.ndarray:
    """Return the least-squares step of the free ones, within the null space of `kept`."""
    if kept is None:
        return np.linalg.lstsq(columns, residual, _RANK)[0]
    _, sizes, rows = np.linalg.svd(kept)
    rank = int(np.sum(sizes > _RANK * max(sizes[0], 1e-300))) if sizes.size else 0
    null = rows[rank:].T
    if not null.shape[1]:
        return np.zeros(columns.shape[1])
    return null @ np.linalg.lstsq(columns @ null, residual, _RANK)[0]


class _LeastSquares(ScaledSolver):
    """In scaled units: |B x - b|^2/2 and, with S = diag(q)^1/2, |S x - d|^2/2."""

    def __init__(self, problem: AllocationProblem, tolerance: float, max_iterations: int, *, sequential: bool) -> None:
        super().__init__(problem)
        self._tolerance, self._most, self._sequential = tolerance, max_iterations, sequential
        self.tries = 1 if sequential else 2  # another scale mends rounding, not another objective
        self._weighing = np.diag(np.sqrt(self.quadratic))
        self._working = np.zeros(problem.count, dtype=int)

    def attempt(self, sample: Sample) -> Found:
        """Return the scaled forces, from the working set of the last sample."""
        effectiveness, sizes = self.matrices[0], np.sqrt(self.quadratic)
        pulled = np.where(sizes > 0, -sample.linear / np.where(sizes > 0, sizes, 1.0), 0.0)
        box = (sample.lower, sample.upper)
        start = BoxedLeastSquares(np.clip(sample.previous, *box), self._working, 0, ended=False)
        solve = partial(boxed_least_squares, tolerance=self._tolerance, most=self._most)
        if self._sequential:
            accurate = solve(effectiveness, sample.target, box, start)
            found = solve(self._weighing, pulled, box, accurate, kept=effectiveness)
            iterations, ended = accurate.iterations + found.iterations, accurate.ended and found.ended
        else:
            found = solve(
                np.vstack([effectiveness, self._weighing]), np.concatenate([sample.target, pulled]), box, start
            )
            iterations, ended = found.iterations, found.ended
        # A sequential answer claims nothing: it minimises something else than the cost.
        self._working = found.working if ended else np.zeros_like(self._working)
        return Found(
            found.forces,
            np.full(len(self.matrices), 1 / len(self.matrices)),
            iterations,
            ended and not self._sequential,
        )


def _set_up(
    problem: AllocationProblem, *, sequential: bool, tolerance: float = 1e-9, max_iterations: int = 200
) -> _LeastSquares:
    positive(tolerance=tolerance, max_iterations=max_iterations)
    return _LeastSquares(problem, tolerance, int(max_iterations), sequential=sequential)


WLS = BackEnd(
    Capability.EXACT | Capability.QP | Capability.WARM_START, (), (1e-6, 1e-10), partial(_set_up, sequential=False)
)
SLS = BackEnd(
    Capability.QP | Capability.WARM_START,
    (),
    (float("inf"), float("inf")),
    partial(_set_up, sequential=True),
    OBJECTIVE=SEQUENTIAL,
)
