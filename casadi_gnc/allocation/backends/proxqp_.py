"""Allocation without uncertainty as a quadratic program, solved by ProxQP's dense solver.

    minimise over low <= x <= high   x'H x/2 + g'x,     H = diag(q) + B'B,   g = c - B'b.

A proximal augmented Lagrangian: it needs no strictly convex cost, has box constraints of its own and
starts from its last answer.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

import numpy as np

from casadi_gnc.allocation.backends import Capability, Found
from casadi_gnc.allocation.backends.scaling import QuadraticProgram, Sample, positive
from casadi_gnc.allocation.problem import AllocationProblem

CAPABILITIES = Capability.EXACT | Capability.QP | Capability.WARM_START
REQUIRES = ("proxsuite",)
ACCURACY = (1e-6, 1e-10)


class _ProxQP(QuadraticProgram):
    def __init__(self, problem: AllocationProblem, tolerance: float, max_iterations: int) -> None:
        super().__init__(problem)
        proxqp: Any = import_module("proxsuite").proxqp
        self._solver = proxqp.dense.QP(problem.count, 0, 0, True)
        self._solved = proxqp.QPSolverOutput.PROXQP_SOLVED
        settings = self._solver.settings
        settings.eps_abs, settings.eps_rel, settings.max_iter = tolerance, 0.0, max_iterations
        settings.initial_guess = proxqp.InitialGuess.WARM_START_WITH_PREVIOUS_RESULT
        settings.compute_timings = True
        self._is_new = True

    def attempt(self, sample: Sample) -> Found:
        """Return ProxQP's scaled forces."""
        change = {"g": self.gradient(sample), "l_box": sample.lower, "u_box": sample.upper}
        if self._is_new:
            self._solver.init(H=self.hessian, **change)
            self._is_new = False
        else:
            self._solver.update(**change)
        self._solver.solve()
        said = self._solver.results
        return Found(
            forces=np.array(said.x),
            weights=self.equal,
            iterations=int(said.info.iter),
            claimed=said.info.status == self._solved,
            seconds=1e-6 * float(said.info.run_time),
        )


def set_up(problem: AllocationProblem, *, tolerance: float = 1e-10, max_iterations: int = 1000) -> _ProxQP:
    """Return the quadratic program of a problem; the options are ProxQP's own."""
    positive(tolerance=tolerance, max_iterations=max_iterations)
    return _ProxQP(problem, tolerance, max_iterations)
