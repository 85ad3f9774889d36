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
from casadi_gnc.synthesis.answer import LmiAnswer
from casadi_gnc.synthesis.bisection import least
from casadi_gnc.synthesis.gains import Synthesis, certify_gains, failed, peak_from, plant_rate, starts
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
    vertices: Any = None,
    limit: float | None = None,
    backend: Any = None,
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
    vertices : (V, n), starts of eta, the observer at zero, from whose hull the peak of the norm of u is
        simulated, unclipped; see `box_vertices`.
    limit : of that peak, which the LMI does not know; larger commands are not certified.
    backend, options : see `casadi_gnc.synthesis.backends`.

    Returns
    -------
    Synthesis
        With gains "K" and "L"; `promised` is gamma, `norm` the true one from (v, wdot) to C eta, `ratios`
        the (assumed mass) / (true mass) that the loop tolerates.

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
    vertices, most = starts(vertices, limit, n)
    parts = uncoupled(A, B, C)
    poses = [_pose(A, B, C, parts, varpi, s, square, margin) for square in (0.0, 1.0)]
    lmis, zero, one = poses[0], poses[0].data(), poses[1].data()

    def attempt(gamma: float, prove: bool) -> LmiAnswer:
        return lmis.attempt(zero.towards(one, gamma**2), backend, prove=prove, **options)

    found = least(attempt, 1.0, relative, largest_gamma)
    if not found.answer.status.holds:
        return failed(found.answer, f"Looked for with gamma up to {found.value:g} (largest_gamma).")
    centre = lmis.attempt(zero.towards(one, found.value**2), "barrier", centre=True)
    best = centre if centre.status.holds else found.answer
    K, L = np.zeros((m, n)), np.zeros((n, n))
    for part, (states, inputs) in enumerate(parts):
        X1, W, H = (best[_name(one, part, parts)] for one in ("X1", "W", "H"))
        K[np.ix_(inputs, states)] = np.linalg.solve(X1, W.T).T
        L[np.ix_(states, states)] = np.linalg.solve((C[np.ix_(states, states)] @ X1).T, H.T).T
    return certify_pair(A, B, C, K, L, varpi, best, promised=found.value, vertices=vertices, limit=most)


def certify_pair(
    A: np.ndarray,
    B: np.ndarray,
    C: np.ndarray,
    K: np.ndarray,
    L: np.ndarray,
    varpi: float,
    lmis: LmiAnswer,
    *,
    promised: float,
    vertices: np.ndarray | None = None,
    limit: float = float("nan"),
) -> Synthesis:
    """Return what gains K and L are worth, from the plant's data; arguments as of `intermediate_observer`."""
    n, m = B.shape
    loop, inputs = closed_loop(A, B, C, K, L, varpi)
    fixed, scaled = by_mass_ratio(A, B, C, K, L, varpi)
    # In the states of `closed_loop`, where a slow observer's pole is not lost beside fast ones.
    command = np.hstack([-K, K + varpi * B.T, np.eye(m)])
    begun = None if vertices is None else np.hstack([vertices, vertices, -varpi * vertices @ B])
    peak = peak_from(loop, command, begun, plant_rate(A, B))
    if peak is not None:  # its start in the states of `by_mass_ratio`: what is estimated begins at zero
        peak = replace(peak, start=np.concatenate([peak.start[:n], np.zeros(n + m)]))
    return certify_gains(
        {"K": K, "L": L},
        lmis,
        loop,
        plant_rate(A, B),
        promised=promised,
        norm=h_infinity_norm(loop, inputs, np.hstack([C, np.zeros((len(C), n + m))])),
        peak=peak,
        limit=limit,
        parts=(fixed, scaled),
        missing="Choose a smaller s: the gains grow with it.",
    )


def sample_s(A: Any, B: Any, varpi: float, values: Sequence[float], **options: Any) -> dict[float, Synthesis]:
    """Return the synthesis for each s, to choose between gamma and gains; see `intermediate_observer`."""
    return {s: intermediate_observer(A, B, varpi, s=s, **options) for s in values}


def loop_rows(A: Any, B: Any, varpi: float, X1: Any, X3: Any, W: Any, H: Any) -> list[list[Any]]:
    """Return P A_chi + A_chi'P after the congruence with diag(X1, X1, X3): blocks on and above the diagonal."""
    BB = varpi * (B @ B.T)
    first, second, third = A @ X1 - B @ W, (A + BB) @ X1 - H, -varpi * (B.T @ B) @ X3
    coupling = B @ X3 - varpi * X1 @ (A.T @ B) - varpi * X1 @ (BB @ B)
    return [[first + first.T, B @ W + BB @ X1, B @ X3], [second + second.T, coupling], [third + third.T]]


def uncoupled(A: np.ndarray, B: np.ndarray, C: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return states and inputs of each part of the plant that A, B and C do not couple with the others.

    Nothing is lost by unknowns that do not couple them either: the LMI keeps its form if a part changes
    its sign, so with a solution its average over the signs is one, and that is block-diagonal.
    """
    from scipy.sparse.csgraph import connected_components

    n, m = B.shape
    couples = np.block([[(A != 0) | (C != 0), B != 0], [np.zeros((m, n + m), dtype=bool)]])
    _, part = connected_components(couples, directed=False)
    found = [(np.flatnonzero(part[:n] == k), np.flatnonzero(part[n:] == k)) for k in range(part.max() + 1)]
    return found if all(len(states) and len(inputs) for states, inputs in found) else [(np.arange(n), np.arange(m))]


def _name(unknown: str, part: int, parts: Sequence[Any]) -> str:
    return unknown if len(parts) == 1 else f"{unknown} of part {part}"


def _pose(
    plant: np.ndarray,
    inputs: np.ndarray,
    outputs: np.ndarray,
    parts: Sequence[tuple[np.ndarray, np.ndarray]],
    varpi: float,
    s: float,
    square: float,
    margin: float,
) -> Lmis:
    lmis = Lmis()
    for part, (state, control) in enumerate(parts):
        names = {one: _name(one, part, parts) for one in ("X1", "X3", "W", "H")}
        n, m, square_part = len(state), len(control), np.ix_(state, state)
        A, B, C = ca.DM(plant[square_part]), ca.DM(inputs[np.ix_(state, control)]), ca.DM(outputs[square_part])
        X1, X3 = lmis.symmetric(names["X1"], n), lmis.symmetric(names["X3"], m)
        W, H = lmis.rectangular(names["W"], m, n), lmis.rectangular(names["H"], n, n)
        first, second, third = loop_rows(A, B, varpi, X1, X3, W, H)
        rows = [
            [*first, 0, 0, X1 @ C.T],
            [*second, 0, -H, 0],
            [*third, np.eye(m), 0, 0],
            [-square * np.eye(m), 0, 0],
            [-square * (2 * s * X1 - s**2 * ca.DM.eye(n)), 0],
            [-np.eye(n)],
        ]
        lmis.psd(X1, margin=margin, name=_name("X1 positive", part, parts))
        lmis.psd(X3, margin=margin, name=_name("X3 positive", part, parts))
        lmis.nsd(block_matrix(rows), margin=margin, name=_name("performance", part, parts))
    return lmis
