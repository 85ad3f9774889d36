"""Robust allocation as a second-order cone program, solved by SCS, an operator splitting method.

Cheap iterations, many of them, and few digits: a second opinion by a method of another kind. The
cone program is that of `conic`; the factorisation of A is reused and the last answer starts the next.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any

import numpy as np

from casadi_gnc.allocation.backends import Capability, Found
from casadi_gnc.allocation.backends.conic import ConicForm, SecondOrderForm
from casadi_gnc.allocation.backends.scaling import Sample, ScaledSolver, positive, silence
from casadi_gnc.allocation.problem import AllocationProblem

CAPABILITIES = Capability.ROBUST | Capability.EXACT | Capability.SOCP | Capability.WARM_START
REQUIRES = ("scs",)
ACCURACY = (1e-2, 1e-8)


class ScsSolver(ScaledSolver):
    """Solve a cone program of the problem with SCS.

    Parameters
    ----------
    problem : what is allocated.
    form : makes the cone program; the triangles of semidefinite cones are lower ones, column by column.
    tolerance, max_iterations : SCS's own, the former absolute and relative.
    """

    enough = (1e-5, 1e-9)  # what can be had; a second try for more costs seconds and seldom gains

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
        scs: Any = import_module("scs")
        cones = {"l": self._form.nonnegative, "q": self._form.second_order, "s": self._form.semidefinite}
        quadratic, matrix = self._form.quadratic, self._form.matrix
        data = {"P": quadratic, "A": matrix, "b": np.ones(matrix.shape[0]), "c": np.ones(matrix.shape[1])}
        self._solver = scs.SCS(
            data,
            cones,
            eps_abs=tolerance,
            eps_rel=tolerance,
            max_iters=max_iterations,
            acceleration_interval=1,  # by default one in a hundred samples ends a percent away
            verbose=False,
            linear_solver="qdldl",
        )
        self._last: dict[str, np.ndarray] = {}

    def attempt(self, sample: Sample) -> Found:
        """Return SCS's scaled forces and the vertex weights from its multipliers."""
        self._solver.update(b=self._form.right(sample), c=self._form.linear(sample))
        with silence():
            said = self._solver.solve(warm_start=bool(self._last), **self._last)
        good = all(np.all(np.isfinite(said[name])) for name in ("x", "y", "s"))
        self._last = {name: np.array(said[name]) for name in ("x", "y", "s")} if good else {}
        info = said["info"]
        return Found(
            forces=np.array(said["x"][: self.problem.count]),
            weights=self._form.weights(np.array(said["y"])),
            iterations=int(info["iter"]),
            claimed=info["status"] == "solved",
            seconds=1e-3 * float(info["solve_time"]),
        )


def set_up(problem: AllocationProblem, *, tolerance: float = 1e-7, max_iterations: int = 20_000) -> ScsSolver:
    """Return the cone program of a problem, factorised once; the options are SCS's own."""
    return ScsSolver(problem, SecondOrderForm, tolerance, max_iterations)
