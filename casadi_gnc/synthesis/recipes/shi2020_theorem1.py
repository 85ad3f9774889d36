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

import numpy as np

from casadi_gnc.synthesis.analysis import fits, matrices
from casadi_gnc.synthesis.answer import LmiAnswer
from casadi_gnc.synthesis.lmis import Lmis
from casadi_gnc.synthesis.unknowns import block_matrix


def printed_data() -> dict[str, Any]:
    """Return the data of the paper's section 4, SI units, as arguments of `theorem1`."""
    rate, mass = np.sqrt(3.986e14 / 1e7**3), 20.0  # omega_0 of the circular orbit, m_0
    A, B = np.zeros((6, 6)), np.zeros((6, 3))
    A[:3, 3:], B[3:] = np.eye(3), np.eye(3) / mass
    A[3, 5], A[5, 3], A[4, 1], A[5, 2] = 2 * rate, -2 * rate, -(rate**2), 3 * rate**2
    M0 = np.kron([[3.5321, 1.8781], [1.8895, 4.1465]], np.eye(3))
    M0[0, 2], M0[0, 5], M0[2, 0], M0[2, 3] = -0.0003, -0.0003, 0.0003, 0.0003
    M0[3, 2], M0[3, 5], M0[5, 0], M0[5, 3] = 0.0003, 0.0002, -0.0003, -0.0002
    return {
        "A": A,
        "B": B,
        "C": np.eye(6),
        "M0": M0,
        "varpi": 200.0,
        "alpha": 7999.0,
        "limit": 30.0,
        "start": (4.0012, 4.0012, 0.032),
        "kappa3": 10.0,
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
    margin: float = 1e-6,
    backend: Any = "clarabel",
    **options: Any,
) -> LmiAnswer:
    """Return the answer to (24) to (26), each negative definite by the margin, with gamma_2 minimised.

    Parameters
    ----------
    A : (n, n). B : (n, m). C, M0 : (n, n).
    varpi, alpha, limit, start, kappa3 : see the table at the top.
    margin : of the three inequalities.
    backend, options : see `casadi_gnc.synthesis.backends`.
    """
    A, B, C, M0 = matrices(A=A, B=B, C=C, M0=M0)
    n, m = B.shape
    for name, matrix in (("A", A), ("C", C), ("M0", M0)):
        fits(name, matrix, n, n)
    k0 = limit**2 / (alpha + 1)
    lmis = Lmis()
    X1, X3 = lmis.symmetric("X1", n), lmis.symmetric("X3", m)
    W, H, gamma2 = lmis.rectangular("W", m, n), lmis.rectangular("H", n, n), lmis.scalar("gamma_2")
    BB = varpi * B @ B.T
    first, second, third = A @ X1 - B @ W, (A + BB) @ X1 - H, -varpi * (B.T @ B) @ X3
    coupling = B @ X3 - varpi * X1 @ (A.T @ B) - varpi * X1 @ (BB @ B)
    performance = [
        [first + first.T, B @ W + BB @ X1, B @ X3, 0, X1 @ C.T, X1 @ C.T],
        [second + second.T, coupling, 0, -X1 @ M0, 0],
        [third + third.T, np.eye(m), 0, 0],
        [-gamma2 * np.eye(m), 0, 0],
        [(1 - gamma2) * np.eye(n), 0],
        [-np.eye(n)],
    ]
    ones = [bound * np.ones((1, size)) for bound, size in zip(start, (n, n, m), strict=True)]
    force = W.T + varpi * X1 @ B
    lmis.nsd(block_matrix(performance), margin=margin, name="(24) performance")
    lmis.nsd(block_matrix([[-alpha, *ones], [-X1, 0, 0], [-X1, 0], [-X3]]), margin=margin, name="(25) start")
    bounded = [
        [-k0 * X1, 0, 0, 0, force],
        [-k0 * X1, 0, 0, -force],
        [-k0 * X3, 0, -X3],
        [-k0 / kappa3**2 * np.eye(m), np.eye(m)],
        [-np.eye(m)],
    ]
    lmis.nsd(block_matrix(bounded), margin=margin, name="(26) input")
    lmis.minimize(gamma2)
    return lmis.solve(backend, **options)
