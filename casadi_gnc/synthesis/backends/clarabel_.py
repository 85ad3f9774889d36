"""LMIs by Clarabel's primal-dual interior point: the default, nine digits and clean certificates."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import numpy as np
import scipy.sparse as sp

from casadi_gnc.synthesis.backends import Claim, Found
from casadi_gnc.synthesis.conic import Kind
from casadi_gnc.synthesis.scaling import Scaled
from casadi_gnc.system import held_back

REQUIRES = ("clarabel",)
_LARGE = 100  # unknowns from which a factorisation by blocks is the faster one
_ENOUGH = 80  # iterations of a large problem: what is not solved by then is polished no further
_CLAIMS = {
    "Solved": Claim.SOLVED,
    "AlmostSolved": Claim.SOLVED,
    "PrimalInfeasible": Claim.INFEASIBLE,
    "AlmostPrimalInfeasible": Claim.INFEASIBLE,
    "DualInfeasible": Claim.UNBOUNDED,
    "AlmostDualInfeasible": Claim.UNBOUNDED,
}


def solve(scaled: Scaled, *, tolerance: float = 1e-10, max_iterations: int = 200) -> Found:
    """Return Clarabel's answer.

    Parameters
    ----------
    scaled : what to solve. Clarabel's triangles are upper ones column by column, which are ours.
    tolerance : of gap and feasibility, relative and absolute.
    max_iterations : of the interior point; no more than 80 with more than 100 unknowns.
    """
    clarabel: Any = import_module("clarabel")  # lazily, and it tells type checkers nothing
    cones = {
        Kind.EQUAL: clarabel.ZeroConeT,
        Kind.NONNEGATIVE: clarabel.NonnegativeConeT,
        Kind.SEMIDEFINITE: clarabel.PSDTriangleConeT,
    }
    settings = clarabel.DefaultSettings()
    settings.verbose = settings.presolve_enable = settings.chordal_decomposition_compact = False
    settings.equilibrate_enable = False  # the data are scaled, and a second scaling costs it two digits
    settings.max_iter = max_iterations
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = tolerance
    count = len(scaled.cost)
    if count > _LARGE:
        settings.direct_solve_method = "faer"
        settings.max_iter = min(max_iterations, _ENOUGH)
    solver = clarabel.DefaultSolver(
        sp.csc_matrix((count, count)),
        scaled.cost,
        sp.csc_matrix(-scaled.matrix),
        scaled.right,
        [cones[block.kind](block.size) for block in scaled.data.blocks],
        settings,
    )
    with held_back.standard_error() as told:
        try:
            solution = solver.solve()
        except BaseException as error:  # its eigenvalues may fail on hopeless data: a panic, which is no Exception
            if type(error).__name__ != "PanicException":
                raise
            told.drop()  # Rust's words of it; ours are those of an answer that says nothing
            solution = None
    if solution is None:
        return Found(np.full(count, np.nan), np.full(len(scaled.right), np.nan), Claim.NOTHING)
    return Found(
        point=np.array(solution.x),
        dual=np.array(solution.z),
        claim=_CLAIMS.get(str(solution.status), Claim.NOTHING),
        iterations=int(solution.iterations),
        seconds=float(solution.solve_time),
    )
