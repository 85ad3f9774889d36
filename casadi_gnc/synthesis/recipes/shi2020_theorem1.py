"""Theorem 1 of Shi et al. (2020) as printed, for the record: its inequalities are infeasible.

| paper | code | meaning |
|---|---|---|
| A, B, C | `A`, `B`, `C` | design model (12) |
| M0 | `M0` | matrix assumed to satisfy e'P2 L v >= e'M0 v for all e and v, which forces M0 = P2 L |
| varpi, alpha, lambda | `varpi`, `alpha`, `limit` | observer, level of V, bound on the norm of u |
| kappa_bar, kappa_3 | `start`, `kappa3` | bounds on the start (25), and on xi |
| X1, X3, W, H, gamma_2 | same | unknowns; K = W X1^-1, L = H (C X1)^-1 |

H. Shi et al., Aerospace Science and Technology 99 (2020) 105759, doi:10.1016/j.ast.2020.105759.
(26) holds the block [-k0/kappa3^2, 1; 1, -1], which is negative definite only if k0 = limit^2/(alpha + 1) exceeds
kappa3^2; printed are 0.1125 and 100. Use `intermediate_observer` and `input_ellipsoid` instead.
"""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from casadi_gnc.synthesis.analysis import fits, matrices
from casadi_gnc.synthesis.answer import LmiAnswer
from casadi_gnc.synthesis.lmis import Lmis
from casadi_gnc.synthesis.recipes.intermediate_observer import loop_rows
from casadi_gnc.synthesis.unknowns import block_matrix


def left_sides(
    A: Any,
    B: Any,
    C: Any,
    M0: Any,
    varpi: float,
    alpha: float,
    limit: float,
    start: tuple[float, float, float],
    kappa3: float,
    *,
    X1: Any,
    X3: Any,
    W: Any,
    H: Any,
    gamma2: Any,
) -> dict[str, ca.SX]:
    """Return what (24) to (26) ask to be negative definite, by name; unknowns may be symbols or numbers."""
    n, m = B.shape
    k0 = limit**2 / (alpha + 1)
    first, second, third = loop_rows(A, B, varpi, X1, X3, W, H)
    performance = [
        [*first, 0, X1 @ C.T, X1 @ C.T],
        [*second, 0, -X1 @ M0, 0],
        [*third, np.eye(m), 0, 0],
        [-gamma2 * np.eye(m), 0, 0],
        [(1 - gamma2) * np.eye(n), 0],
        [-np.eye(n)],
    ]
    ones = [bound * np.ones((1, size)) for bound, size in zip(start, (n, n, m), strict=True)]
    force = W.T + varpi * X1 @ B
    bounded = [
        [-k0 * X1, 0, 0, 0, force],
        [-k0 * X1, 0, 0, -force],
        [-k0 * X3, 0, -X3],
        [-k0 / kappa3**2 * np.eye(m), np.eye(m)],
        [-np.eye(m)],
    ]
    return {
        "(24) performance": block_matrix(performance),
        "(25) start": block_matrix([[-alpha, *ones], [-X1, 0, 0], [-X1, 0], [-X3]]),
        "(26) input": block_matrix(bounded),
    }


def theorem1(
    A: Any,
    B: Any,
    C: Any,
    M0: Any,
    varpi: float,
    alpha: float,
    limit: float,
    start: tuple[float, float, float],
    kappa3: float,
    *,
    price: float = 0.0,
    margin: float = 1e-6,
    backend: Any = None,
    **options: Any,
) -> LmiAnswer:
    """Return the answer to (24) to (26), each negative definite by the margin, with gamma_2 minimised.

    Parameters
    ----------
    A : (n, n). B : (n, m). C, M0 : (n, n).
    varpi, alpha, limit, start, kappa3 : see the table at the top.
    price : of the squares of W and H, added to gamma_2, at least 0. Without it the smallest gamma_2 is not
        attained: M0 leaves L without a cost, and L runs to infinity.
    margin : of the three inequalities.
    backend, options : see `casadi_gnc.synthesis.backends`.
    """
    A, B, C, M0 = matrices(A=A, B=B, C=C, M0=M0)
    n, m = B.shape
    for name, matrix in (("A", A), ("C", C), ("M0", M0)):
        fits(name, matrix, n, n)
    lmis = Lmis()
    X1, X3 = lmis.symmetric("X1", n), lmis.symmetric("X3", m)
    W, H, gamma2 = lmis.rectangular("W", m, n), lmis.rectangular("H", n, n), lmis.scalar("gamma_2")
    unknowns = {"X1": X1, "X3": X3, "W": W, "H": H, "gamma2": gamma2}
    for name, side in left_sides(A, B, C, M0, varpi, alpha, limit, start, kappa3, **unknowns).items():
        lmis.nsd(side, margin=margin, name=name)
    if price > 0:
        gains = ca.vertcat(ca.vec(W), ca.vec(H))
        square = lmis.scalar("square")
        lmis.psd(block_matrix([[square, gains.T], [np.eye(gains.numel())]]), margin=0, name="price of the gains")
        gamma2 += price * square
    lmis.minimize(gamma2)
    return lmis.solve(backend, **options)
