"""LMIs by Clarabel's primal-dual interior point: the default, nine digits and clean certificates."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import numpy as np
import scipy.sparse as sp

from casadi_gnc.synthesis.backends import Claim, Found
from casadi_gnc.synthesis.conic import Kind
from casadi_gnc.synthesis.scaling import Scaled

REQUIRES = ("clarabel",)
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
    max_iterations : of the interior point.
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
    solution = clarabel.DefaultSolver(
        sp.csc_matrix((count, count)),
        scaled.cost,
        sp.csc_matrix(-scaled.matrix),
        scaled.right,
        [cones[block.kind](block.size) for block in scaled.data.blocks],
        settings,
    ).solve()
    return Found(
        point=np.array(solution.x),
        dual=np.array(solution.z),
        claim=_CLAIMS.get(str(solution.status), Claim.NOTHING),
        iterations=int(solution.iterations),
        seconds=float(solution.solve_time),
    )
