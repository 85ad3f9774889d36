"""Allocation without uncertainty as a quadratic program, solved by DAQP's dual active set.

The program is that of `proxqp_`. A dual active set ends after finitely many steps at the exact vertex
of the constraints, in microseconds for a dozen actuators, and starts from its last active set. A cost
that is not strictly convex (some M1 + M2 = 0) goes through DAQP's proximal iterations.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

import numpy as np

from casadi_gnc.allocation.backends import Capability, Found
from casadi_gnc.allocation.backends.scaling import QuadraticProgram, Sample, positive
from casadi_gnc.allocation.problem import AllocationProblem

CAPABILITIES = Capability.EXACT | Capability.QP | Capability.WARM_START
REQUIRES = ("daqp",)
ACCURACY = (1e-6, 1e-10)


class _DAQP(QuadraticProgram):
    def __init__(self, problem: AllocationProblem, tolerance: float, max_iterations: int) -> None:
        super().__init__(problem)
        self._module: Any = import_module("daqp")
        self._settings = {"primal_tol": tolerance, "dual_tol": tolerance, "iter_limit": max_iterations}
        self._none = np.zeros((0, problem.count))
        self._model: Any = None

    def attempt(self, sample: Sample) -> Found:
        """Return DAQP's scaled forces."""
        linear = self.gradient(sample)
        if self._model is None:
            self._model = self._module.Model()
            self._model.settings = self._settings
            sense = np.zeros(len(linear), dtype=np.intc)
            self._model.setup(self.hessian, linear, self._none, sample.upper, sample.lower, sense)
            self._model.settings = self._settings
        else:
            self._model.update(f=linear, bupper=sample.upper, blower=sample.lower)
        x, _, flag, info = self._model.solve()
        if flag <= 0:
            self._model = None
        return Found(
            forces=np.array(x, dtype=float),
            weights=self.equal,
            iterations=int(info["iterations"]),
            claimed=flag > 0,
            seconds=float(info["solve_time"]),
        )


def set_up(problem: AllocationProblem, *, tolerance: float = 1e-9, max_iterations: int = 1000) -> _DAQP:
    """Return the quadratic program of a problem; the options are DAQP's own."""
    positive(tolerance=tolerance, max_iterations=max_iterations)
    return _DAQP(problem, tolerance, max_iterations)
