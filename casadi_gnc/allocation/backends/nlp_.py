"""The epigraph form as a nonlinear program in CasADi: "ipopt", "sqpmethod" and "sqpmethod_qrqp".

    minimise over (x, t)   x'diag(q)x/2 + c'x + t   subject to   |B_v x - b|^2/2 - t <= 0  for every v.

The program is built once, with c and b as parameters, and CasADi differentiates it exactly; the
multipliers of the constraints are the vertex weights. Any solver of `casadi.nlpsol` fits: the three
here are IPOPT, and sequential quadratic programming on qpOASES and on CasADi's own QRQP.

QRQP drops multipliers below its `min_lam` and then cycles on tied vertices: with its default it fails
on one problem in five; with a smaller one and full steps (the program is convex) it is a few 1e-6 away
on one in a hundred. Both active sets want a strictly convex cost: they see a curvature of at least
`RIDGE` for every x.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import casadi as ca
import numpy as np

from casadi_gnc.allocation.backends import BackEnd, Capability, Found
from casadi_gnc.allocation.backends.scaling import Sample, ScaledSolver, positive, silence
from casadi_gnc.allocation.problem import AllocationProblem

CAPABILITIES = Capability.ROBUST | Capability.EXACT | Capability.NLP
REQUIRES: tuple[str, ...] = ()
ACCURACY = (1e-6, 1e-10)
RIDGE = 1e-10  # in units where the optimum is about 1: beyond what the certificate asks for


class _Program(ScaledSolver):
    """Solve the nonlinear program with a solver of `casadi.nlpsol`, quietly."""

    def __init__(self, problem: AllocationProblem, plugin: str, options: dict[str, Any], ridge: float = 0.0) -> None:
        super().__init__(problem)
        vertices, rows, count = self.matrices.shape
        x, t = ca.SX.sym("x", count), ca.SX.sym("t")
        c, b = ca.SX.sym("c", count), ca.SX.sym("b", rows)
        errors = [ca.mtimes(ca.DM(matrix), x) - b for matrix in self.matrices]
        program = {
            "x": ca.vertcat(x, t),
            "p": ca.vertcat(c, b),
            "f": ca.dot(ca.DM(np.maximum(self.quadratic, ridge)) * x, x) / 2 + ca.dot(c, x) + t,
            "g": ca.vertcat(*[ca.sumsqr(error) / 2 - t for error in errors]),
        }
        with silence():
            self._solver = ca.nlpsol(
                "allocate",
                plugin,
                program,
                {"print_time": False, "record_time": True, "error_on_fail": False, **options},
            )
        self._equal = np.full(vertices, 1 / vertices)

    def attempt(self, sample: Sample) -> Found:
        """Return the scaled forces, from the middle of the box with equal weights."""
        start = (sample.lower + sample.upper) / 2
        errors = self.matrices @ start - sample.target
        top = float(np.max(np.sum(errors**2, axis=1))) / 2
        with silence():
            said = self._solver(
                x0=np.append(start, top),
                lam_g0=self._equal,
                p=np.concatenate([sample.linear, sample.target]),
                lbx=np.append(sample.lower, -np.inf),
                ubx=np.append(sample.upper, np.inf),
                lbg=-np.inf,
                ubg=0.0,
            )
        statistics = self._solver.stats()
        return Found(
            forces=np.array(said["x"]).ravel()[:-1],
            weights=np.array(said["lam_g"]).ravel(),
            iterations=int(statistics.get("iter_count", 0)),
            claimed=bool(statistics.get("success", False)),
            seconds=float(statistics.get("t_wall_total", np.nan)),
        )


def set_up(problem: AllocationProblem, *, tolerance: float = 1e-10, max_iterations: int = 500) -> _Program:
    """Return the program of a problem for IPOPT, whose own the options are."""
    positive(tolerance=tolerance, max_iterations=max_iterations)
    ipopt = {
        "print_level": 0,
        "sb": "yes",
        "tol": tolerance,
        "compl_inf_tol": tolerance,
        "constr_viol_tol": tolerance,
        "dual_inf_tol": 1e2 * tolerance,
        "acceptable_iter": 0,
        "bound_relax_factor": 0.0,
        "max_iter": max_iterations,
    }
    return _Program(problem, "ipopt", {"ipopt": ipopt})


def set_up_sqp(problem: AllocationProblem, *, tolerance: float = 1e-9, max_iterations: int = 100, qp: str) -> _Program:
    """Return the program of a problem for CasADi's sqpmethod on a QP solver; the options are its own."""
    positive(tolerance=tolerance, max_iterations=max_iterations)
    quiet: dict[str, Any] = {"error_on_fail": False, "print_time": False}
    own: dict[str, dict[str, Any]] = {
        "qpoases": {"printLevel": "none"},
        "qrqp": {"print_iter": False, "print_header": False, "print_info": False, "min_lam": 1e-12},
    }
    options = {
        "qpsol": qp,
        "qpsol_options": quiet | own[qp],
        "print_header": False,
        "print_iteration": False,
        "print_status": False,
        "tol_pr": tolerance,
        "tol_du": tolerance,
        "min_step_size": 1e-16,
        "max_iter": max_iterations,
    }
    if qp == "qrqp":
        options["max_iter_ls"] = 0
    return _Program(problem, "sqpmethod", options, RIDGE)


SQPMETHOD = BackEnd(CAPABILITIES, REQUIRES, (1e-6, 1e-10), partial(set_up_sqp, qp="qpoases"))
SQPMETHOD_QRQP = BackEnd(CAPABILITIES, REQUIRES, (1e-4, 1e-10), partial(set_up_sqp, qp="qrqp"))
