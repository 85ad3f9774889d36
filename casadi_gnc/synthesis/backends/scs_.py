"""LMIs by SCS, an operator splitting method: many cheap iterations, a second opinion of another kind."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import numpy as np
import scipy.sparse as sp

from casadi_gnc.synthesis.backends import Claim, Found
from casadi_gnc.synthesis.conic import Kind
from casadi_gnc.synthesis.scaling import Scaled

REQUIRES = ("scs",)
_CLAIMS = {1: Claim.SOLVED, 2: Claim.SOLVED, -2: Claim.INFEASIBLE, -7: Claim.INFEASIBLE}
_CLAIMS |= {-1: Claim.UNBOUNDED, -6: Claim.UNBOUNDED}


def solve(scaled: Scaled, *, tolerance: float = 1e-8, max_iterations: int = 50_000) -> Found:
    """Return SCS's answer.

    Parameters
    ----------
    scaled : what to solve. SCS's triangles are lower ones column by column; ours are row by row.
    tolerance : absolute and relative, also of certificates of infeasibility.
    max_iterations : of the splitting method.
    """
    scs: Any = import_module("scs")
    blocks = scaled.data.blocks
    order = np.arange(len(scaled.right))
    for block in blocks:
        if block.kind is Kind.SEMIDEFINITE:
            column, row = np.triu_indices(block.size)
            order[block.rows] = block.start + row * (row + 1) // 2 + column
    cone = {
        "z": sum(block.size for block in blocks if block.kind is Kind.EQUAL),
        "l": sum(block.size for block in blocks if block.kind is Kind.NONNEGATIVE),
        "s": [block.size for block in blocks if block.kind is Kind.SEMIDEFINITE],
    }
    data = {"A": sp.csc_matrix(-scaled.matrix[order]), "b": scaled.right[order], "c": scaled.cost}
    said = scs.SCS(
        data,
        cone,
        eps_abs=tolerance,
        eps_rel=tolerance,
        eps_infeas=tolerance,
        max_iters=max_iterations,
        verbose=False,
        linear_solver="qdldl",
    ).solve()
    info = said["info"]
    dual = np.empty(len(order))
    dual[order] = said["y"]
    return Found(
        point=np.array(said["x"]),
        dual=dual,
        claim=_CLAIMS.get(int(info["status_val"]), Claim.NOTHING),
        iterations=int(info["iter"]),
        seconds=1e-3 * float(info["solve_time"]),
    )
