"""Robust allocation as a second-order cone program, solved by Clarabel's interior point.

The cone program is that of `conic`. Between samples only c and the right-hand side change, so the
symbolic factorisation is reused. No warm start: an interior point has little use for one.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any

import numpy as np

from casadi_gnc.allocation.backends import Capability, Found
from casadi_gnc.allocation.backends.conic import ConicForm, SecondOrderForm
from casadi_gnc.allocation.backends.scaling import Sample, ScaledSolver, positive
from casadi_gnc.allocation.problem import AllocationProblem

CAPABILITIES = Capability.ROBUST | Capability.EXACT | Capability.SOCP
REQUIRES = ("clarabel",)
ACCURACY = (1e-6, 1e-10)


class ClarabelSolver(ScaledSolver):
    """Solve a cone program of the problem with Clarabel.

    Parameters
    ----------
    problem : what is allocated.
    form : makes the cone program; the triangles of semidefinite cones are upper ones, column by column.
    tolerance, max_iterations : Clarabel's own.
    """

    def __init__(
        self,
        problem: AllocationProblem,
        form: Callable[[ScaledSolver], ConicForm],
        tolerance: float,
        max_iterations: int,
    ) -> None:
        positive(tolerance=tolerance, max_iterations=max_iterations)
        super().__init__(problem)
        self._form = form(self)
        clarabel: Any = import_module("clarabel")  # lazily, and it tells type checkers nothing
        cones = [clarabel.NonnegativeConeT(self._form.nonnegative)]
        cones += [clarabel.SecondOrderConeT(size) for size in self._form.second_order]
        cones += [clarabel.PSDTriangleConeT(size) for size in self._form.semidefinite]
        settings = clarabel.DefaultSettings()
        settings.verbose = False
        settings.presolve_enable = settings.chordal_decomposition_enable = False  # they forbid data updates
        settings.max_iter = max_iterations
        settings.tol_gap_rel = settings.tol_feas = tolerance
        settings.tol_gap_abs = 1e-3 * tolerance
        quadratic, matrix = self._form.quadratic, self._form.matrix
        blank = np.zeros(matrix.shape[1]), np.zeros(matrix.shape[0])
        self._solver = clarabel.DefaultSolver(quadratic, blank[0], matrix, blank[1], cones, settings)

    def attempt(self, sample: Sample) -> Found:
        """Return Clarabel's scaled forces and the vertex weights from its multipliers."""
        self._solver.update(q=self._form.linear(sample), b=self._form.right(sample))
        solution = self._solver.solve()
        return Found(
            forces=np.array(solution.x[: self.problem.count]),
            weights=self._form.weights(np.array(solution.z)),
            iterations=int(solution.iterations),
            claimed=str(solution.status) == "Solved",
            seconds=float(solution.solve_time),
        )


def set_up(problem: AllocationProblem, *, tolerance: float = 1e-10, max_iterations: int = 100) -> ClarabelSolver:
    """Return the cone program of a problem, factorised once; the options are Clarabel's own."""
    return ClarabelSolver(problem, SecondOrderForm, tolerance, max_iterations)
