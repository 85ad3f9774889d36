"""Intermediate observer and controller together, from one LMI, repaired.

| paper | code | meaning |
|---|---|---|
| eta' = A eta + B (u + w), y = C eta + v | `A`, `B`, `C` | plant, lumped disturbance w, noise v |
| u = -K eta_hat - w_hat | `K` | controller (19) |
| eta_hat' = A eta_hat + B (u + w_hat) + L (y - C eta_hat) | `L` | observer (15) |
| w_hat' = varpi B'L (y - C eta_hat) | `varpi` | the same as (16) to (18), without xi |
| e_eta, e_xi | | errors of eta_hat, and of xi = w - varpi B' eta |
| X1 = P1^-1 = P2^-1, X3 = P3^-1, W = K X1, H = L C X1 | | unknowns |

H. Shi et al., Aerospace Science and Technology 99 (2020) 105759, doi:10.1016/j.ast.2020.105759. What is
repaired: the output is z = C eta, without the feed-through of v that keeps gamma above 1; the noise
enters e_eta through -L v, where the paper's assumption on M0 removed it and with it the price of L.
V' + z'z - gamma^2 (v'v + wdot'wdot) < 0 and a congruence with diag(X1, X1, X3, I, X1) leave
-gamma^2 X1^2 in the place of v, and X1^2 >= 2 s X1 - s^2 I for any s > 0. This is affine for given gamma
and s: gamma is bisected, s sampled. Larger s: smaller gamma, larger gains. At the smallest gamma L is hardly
determined; the gains returned are those at the analytic centre, which no solver and no scaling moves.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np

from casadi_gnc.errors import SynthesisError
from casadi_gnc.synthesis.analysis import fits, h_infinity_norm, matrices
from casadi_gnc.synthesis.conic import ConicData
from casadi_gnc.synthesis.gains import Synthesis, certify_gains, failed, plant_rate
from casadi_gnc.synthesis.lmis import Lmis
from casadi_gnc.synthesis.unknowns import block_matrix


def closed_loop(A: Any, B: Any, C: Any, K: Any, L: Any, varpi: float) -> tuple[np.ndarray, np.ndarray]:
    """Return A_chi and B_chi of (23): states (eta, e_eta, e_xi), inputs (v, wdot)."""
    A, B, C, K, L = matrices(A=A, B=B, C=C, K=K, L=L)
    n, m = B.shape
    loop = np.block(
        [
            [A - B @ K, B @ K + varpi * B @ B.T, B],
            [np.zeros((n, n)), A - L @ C + varpi * B @ B.T, B],
            [np.zeros((m, n)), -varpi * B.T @ A - varpi**2 * B.T @ B @ B.T, -varpi * B.T @ B],
        ]
    )
    return loop, np.block([[np.zeros((n, len(C) + m))], [-L, np.zeros((n, m))], [np.zeros((m, len(C))), np.eye(m)]])


def by_mass_ratio(A: Any, B: Any, C: Any, K: Any, L: Any, varpi: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the parts of the loop fixed + r scaled, for a true input matrix r B.

    States are (eta, eta_hat, w_hat); r = (assumed mass) / (true mass). See `stable_ratios`.
    """
    A, B, C, K, L = matrices(A=A, B=B, C=C, K=K, L=L)
    n, m = B.shape
    command = np.hstack([np.zeros((m, n)), -K, -np.eye(m)])
    fixed = np.block(
        [
            [A, np.zeros((n, n + m))],
            [L @ C, A - L @ C - B @ K, np.zeros((n, m))],
            [varpi * B.T @ L @ C, -varpi * B.T @ L @ C, np.zeros((m, m))],
        ]
    )
    scaled = np.vstack([B @ command, np.zeros((n + m, 2 * n + m))])
    return fixed, scaled


def intermediate_observer(
    A: Any,
    B: Any,
    varpi: float,
    *,
    C: Any = None,
    s: float = 0.3,
    relative: float = 1e-4,
    margin: float = 1e-6,
    largest_gamma: float = 1e4,
    backend: Any = "clarabel",
    **options: Any,
) -> Synthesis:
    """Return K, (m, n), and L, (n, n), with the smallest certified gamma for a given s.

    Parameters
    ----------
    A : (n, n), [1/s]. B : (n, m), [1/kg] below zeros. C : (n, n), regular, identity by default.
    varpi : of the observer, positive: its disturbance bandwidth is varpi times the square of B.
    s : where X1^2 is replaced by its tangent, positive, in the unit of X1.
    relative : to which gamma is bisected.
    margin : of the inequalities, in their units.
    largest_gamma : where the search for a feasible gamma gives up.
    backend, options : see `casadi_gnc.synthesis.backends`.

    Returns
    -------
    Synthesis
        With gains "K" and "L"; `promised` is gamma, `norm` the true one from (v, wdot) to C eta.

    Raises
    ------
    SynthesisError
        For wrong shapes or numbers out of range.
    """
    A, B = matrices(A=A, B=B)
    n, m = len(A), B.shape[1]
    (C,) = matrices(C=np.eye(n) if C is None else C)
    fits("A", A, n, n)
    fits("B", B, n, m)
    fits("C", C, n, n)
    if np.linalg.cond(C) > 1e12:
        raise SynthesisError("C is singular; the recipe takes L from H = L C X1 and needs a regular C")
    for name, value in (("varpi", varpi), ("s", s), ("relative", relative)):
        if not (np.isfinite(value) and value > 0):
            raise SynthesisError(f"{name} is {value}, expected a positive number")
    poses = [_pose(A, B, C, varpi, s, square, margin) for square in (0.0, 1.0)]
    lmis, zero, one = poses[0], poses[0].data(), poses[1].data()

    def attempt(gamma: float) -> Any:
        return lmis.attempt(_between(zero, one, gamma**2), backend, **options)

    high, low = 1.0, 0.0
    best = attempt(high)
    while not best.status.holds:
        if high >= largest_gamma:
            return failed(best)
        low, high = high, 2 * high
        best = attempt(high)
    while high - low > relative * high:
        gamma = np.sqrt(low * high) if low > 0.1 * high else (low + high) / 2
        trial = attempt(gamma)
        if trial.status.holds:
            high, best = gamma, trial
        else:
            low = gamma
    centre = lmis.attempt(_between(zero, one, high**2), "barrier", centre=True)
    best = centre if centre.status.holds else best
    K = np.linalg.solve(best["X1"], best["W"].T).T
    L = np.linalg.solve((C @ best["X1"]).T, best["H"].T).T
    loop, inputs = closed_loop(A, B, C, K, L, varpi)
    norm = h_infinity_norm(loop, inputs, np.hstack([C, np.zeros((n, n + m))]))
    return certify_gains({"K": K, "L": L}, best, loop, plant_rate(A, B), promised=float(high), norm=norm)


def sample_s(A: Any, B: Any, varpi: float, values: Sequence[float], **options: Any) -> dict[float, Synthesis]:
    """Return the synthesis for each s, to choose between gamma and gains; see `intermediate_observer`."""
    return {s: intermediate_observer(A, B, varpi, s=s, **options) for s in values}


def _between(zero: ConicData, one: ConicData, square: float) -> ConicData:
    """Return data that are affine in gamma^2 from those at 0 and at 1: nothing is differentiated again."""
    return replace(
        zero,
        matrix=(zero.matrix + square * (one.matrix - zero.matrix)).tocsr(),
        offset=zero.offset + square * (one.offset - zero.offset),
    )


def _pose(A: np.ndarray, B: np.ndarray, C: np.ndarray, varpi: float, s: float, square: float, margin: float) -> Lmis:
    n, m = B.shape
    lmis = Lmis()
    X1, X3 = lmis.symmetric("X1", n), lmis.symmetric("X3", m)
    W, H = lmis.rectangular("W", m, n), lmis.rectangular("H", n, n)
    BB = varpi * B @ B.T
    first, second, third = A @ X1 - B @ W, (A + BB) @ X1 - H, -varpi * (B.T @ B) @ X3
    coupling = B @ X3 - varpi * X1 @ (A.T @ B) - varpi * X1 @ (BB @ B)
    rows = [
        [first + first.T, B @ W + BB @ X1, B @ X3, 0, 0, X1 @ C.T],
        [second + second.T, coupling, 0, -H, 0],
        [third + third.T, np.eye(m), 0, 0],
        [-square * np.eye(m), 0, 0],
        [-square * (2 * s * X1 - s**2 * ca.DM.eye(n)), 0],
        [-np.eye(n)],
    ]
    lmis.psd(X1, margin=margin, name="X1 positive")
    lmis.psd(X3, margin=margin, name="X3 positive")
    lmis.nsd(block_matrix(rows), margin=margin, name="performance")
    return lmis
