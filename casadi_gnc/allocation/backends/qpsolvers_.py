"""Allocation without uncertainty through any solver that the package qpsolvers finds.

The program is that of `proxqp_`. Three solvers have names of their own: "osqp", "highs" and "piqp";
"qpsolvers:NAME" reaches every other one that is installed. Among these are solvers under the
GPL (quadprog, cvxopt, ecos, qpswift): they are never installed nor chosen by us, only named by a user.
Slow, since the problem is handed over whole every sample: for comparison.
"""

from __future__ import annotations

import warnings
from functools import cache, partial
from importlib import import_module
from typing import Any

import numpy as np
from scipy import sparse

from casadi_gnc.allocation.backends import BackEnd, Capability, Found
from casadi_gnc.allocation.backends.scaling import QuadraticProgram, Sample, positive
from casadi_gnc.allocation.problem import AllocationProblem
from casadi_gnc.errors import AllocationError

CAPABILITIES = Capability.EXACT | Capability.QP

#: What a solver calls our options; one that is not here keeps its own settings.
_TOLERANCE = {
    "clarabel": ("tol_gap_abs", "tol_gap_rel", "tol_feas"),
    "cvxopt": ("abstol", "reltol", "feastol"),
    "daqp": ("primal_tol", "dual_tol"),
    "ecos": ("abstol", "reltol", "feastol"),
    "highs": ("primal_feasibility_tolerance", "dual_feasibility_tolerance"),
    "osqp": ("eps_abs", "eps_rel"),
    "piqp": ("eps_abs", "eps_rel"),
    "proxqp": ("eps_abs", "eps_rel"),
    "qpalm": ("eps_abs", "eps_rel"),
    "scs": ("eps_abs", "eps_rel"),
}
#: Interior points stop a long way before the gap is what they were asked for.
_DEFAULT = {"clarabel": 1e-11, "piqp": 1e-13}
_MAX_ITERATIONS = {
    "clarabel": "max_iter",
    "cvxopt": "maxiters",
    "daqp": "iter_limit",
    "ecos": "max_iters",
    "osqp": "max_iter",
    "piqp": "max_iter",
    "proxqp": "max_iter",
    "qpalm": "max_iter",
    "scs": "max_iters",
}


@cache
def _let_highs_introduce_itself() -> None:
    """Let HiGHS write its banner where nobody sees it, before qpsolvers makes the first of its solvers.

    From highspy 1.16 on the first solver that a process makes writes a banner while it is made, in the method that
    installs the callbacks; qpsolvers turns the console off, but after that. This one turns it off before.
    """
    highs: Any = import_module("highspy").Highs

    class Silent(highs):
        def enableCallbacks(self) -> None:
            self.setOptionValue("log_to_console", False)
            super().enableCallbacks()

    Silent()


class _ThroughQpsolvers(QuadraticProgram):
    def __init__(self, problem: AllocationProblem, solver: str, options: dict[str, Any]) -> None:
        super().__init__(problem)
        self._package: Any = import_module("qpsolvers")
        if solver not in self._package.available_solvers:
            found = ", ".join(self._package.available_solvers)
            raise AllocationError(f"qpsolvers does not find the solver {solver!r}; it finds {found}")
        if solver == "highs":
            _let_highs_introduce_itself()
        self._solver, self._options = solver, options
        is_sparse = solver in self._package.sparse_solvers
        self._matrix = sparse.csc_matrix(self.hessian) if is_sparse else self.hessian

    def attempt(self, sample: Sample) -> Found:
        """Return the scaled forces; not finite where the solver found none."""
        problem = self._package.Problem(self._matrix, self.gradient(sample), lb=sample.lower, ub=sample.upper)
        try:
            with warnings.catch_warnings():  # that it ended early is in `claimed`, and in our gap
                warnings.simplefilter("ignore")
                said = self._package.solve_problem(problem, solver=self._solver, **self._options)
        except self._package.exceptions.QPError as error:
            raise AllocationError(f"the solver {self._solver!r} of qpsolvers refuses the problem: {error}") from error
        forces = np.full(len(sample.lower), np.nan) if said.x is None else np.array(said.x)
        seconds = getattr(said, "solve_time", None)
        return Found(
            forces=forces,
            weights=self.equal,
            claimed=bool(said.found),
            seconds=float("nan") if seconds is None else float(seconds),
        )


def set_up(
    problem: AllocationProblem, *, solver: str, tolerance: float | None = None, max_iterations: int | None = None
) -> _ThroughQpsolvers:
    """Return the quadratic program of a problem for a solver of qpsolvers.

    Parameters
    ----------
    solver : its name there.
    tolerance : its absolute and relative tolerances; 1e-9 or less by default where it has any.
    max_iterations : its limit; its own by default.

    Raises
    ------
    AllocationError
        For a solver that is not installed, or an option that we cannot hand to it.
    """
    options: dict[str, Any] = {}
    if tolerance is not None or solver in _TOLERANCE:
        if solver not in _TOLERANCE:
            raise AllocationError(f"the solver {solver!r} takes no tolerance here; leave it out")
        chosen = _DEFAULT.get(solver, 1e-9) if tolerance is None else tolerance
        positive(tolerance=chosen)
        options |= dict.fromkeys(_TOLERANCE[solver], chosen)
    if max_iterations is not None:
        if solver not in _MAX_ITERATIONS:
            raise AllocationError(f"the solver {solver!r} takes no max_iterations here; leave it out")
        positive(max_iterations=max_iterations)
        options[_MAX_ITERATIONS[solver]] = max_iterations
    return _ThroughQpsolvers(problem, solver, options)


def back_end(solver: str, *packages: str, accuracy: tuple[float, float] = (1e-6, 1e-10)) -> BackEnd:
    """Return the back end of a solver, by its name in qpsolvers and the packages it is made of."""
    return BackEnd(CAPABILITIES, ("qpsolvers", *packages), accuracy, partial(set_up, solver=solver))


OSQP = back_end("osqp", "osqp")
HIGHS = back_end("highs", "highspy")
PIQP = back_end("piqp", "piqp")
