"""State feedback u = -K x that stays below a force limit from every start of a polytope.

| paper | code | meaning |
|---|---|---|
| x' = A x + B u | `A`, `B` | plant |
| X = P^-1 > 0, W = K X | `X`, `W` | unknowns; the ellipsoid is x'Px <= 1 |
| a | `decay_1_s` | V falls at least as exp(-2 a t) |
| s^2 | `share` | square of the part of the limit that is used |

Every vertex v lies in the ellipsoid, the ellipsoid shrinks, and in it |u_i| <= s limit_i:

    [1, v'; v, X] >= 0,   A X + X A' - B W - W'B' + 2 a X < 0,   [s^2 limit_i^2, W_i; W_i', X] >= 0

with W all at once, and s^2 limit^2 I, for a limit on the Euclidean norm. s is minimised and s <= 1
(S. Boyd et al., Linear Matrix Inequalities in System and Control Theory, 1994, section 7.2.3). Where there are many
vertices they share one matrix: v'Y v <= 1 and [Y, I; I, X] >= 0, that is Y >= X^-1, say the same. The
vertices are used themselves; a bound on 1'P1 instead would be wrong (an erratum of Shi et al. 2020).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import casadi as ca
import numpy as np

from casadi_gnc.errors import SynthesisError
from casadi_gnc.synthesis.analysis import fits, matrices
from casadi_gnc.synthesis.gains import Synthesis, certify_gains, failed, peak_from, plant_rate
from casadi_gnc.synthesis.lmis import Lmis
from casadi_gnc.synthesis.regions import regions
from casadi_gnc.synthesis.unknowns import block_matrix

_APART = 4  # vertices up to which each has a matrix of its own


def input_ellipsoid(
    A: Any,
    B: Any,
    vertices: Any,
    limit: float,
    decay_1_s: float,
    *,
    per_channel: bool = False,
    fastest_rad_s: float | None = None,
    damping: float | None = None,
    disc_rad_s: Sequence[float] | None = None,
    margin: float = 1e-7,
    backend: Any = None,
    **options: Any,
) -> Synthesis:
    """Return K, (m, n), for u = -K x that decays as asked and uses the smallest part of the limit.

    Parameters
    ----------
    A : (n, n), [1/s]. B : (n, m). vertices : (V, n), of the starts; see `box_vertices`.
    limit : of the norm of u, or of each channel; positive, in the unit of u.
    decay_1_s : a, at least 0.
    per_channel : whether the limit is one of each channel.
    fastest_rad_s, damping, disc_rad_s : regions of the poles, see `casadi_gnc.synthesis.regions`.
    margin : of the inequalities, in their units.
    backend, options : see `casadi_gnc.synthesis.backends`.

    Returns
    -------
    Synthesis
        With gain "K"; `peak` is the simulated command from the worst vertex, `limit` the limit and
        `lmis["share"]` the square of the part of it that the ellipsoid needs; `ratios` are factors of B
        that the loop tolerates.

    Raises
    ------
    SynthesisError
        For wrong shapes, a limit or decay out of range, and regions of poles that have no point in common.
    """
    A, B, vertices = matrices(A=A, B=B, vertices=vertices)
    n, m = len(A), B.shape[1]
    fits("A", A, n, n)
    fits("B", B, n, m)
    fits("vertices", vertices, len(vertices), n)
    if not (np.isfinite(limit) and limit > 0 and np.isfinite(decay_1_s) and decay_1_s >= 0):
        raise SynthesisError(
            f"limit is {limit} and decay_1_s {decay_1_s}; expected a positive and a non-negative number"
        )
    asked = regions(decay_1_s, damping, disc_rad_s, fastest_rad_s)
    lmis = Lmis()
    X, W, share = lmis.symmetric("X", n), lmis.rectangular("W", m, n), lmis.scalar("share")
    moved = A @ X - B @ W
    _enclose(lmis, X, vertices, margin)
    lmis.nsd(moved + moved.T + 2 * decay_1_s * X, margin=margin, name="decay")
    for region in asked:
        if region.name != "decay":  # which is stated
            region.pose(lmis, X, moved, margin)
    if per_channel:
        for i in range(m):
            lmis.psd(block_matrix([[share * limit**2, W[i, :]], [X]]), margin=margin, name=f"limit of channel {i}")
    else:
        lmis.psd(block_matrix([[share * limit**2 * np.eye(m), W], [X]]), margin=margin, name="limit")
    lmis.nonnegative(1 - share, margin=margin, name="share of the limit")
    lmis.minimize(share)
    answer = lmis.solve(backend, **options)
    if not answer.status.holds:
        return failed(answer)
    K = np.linalg.solve(answer["X"], answer["W"].T).T
    return certify_gains(
        {"K": K},
        answer,
        A - B @ K,
        plant_rate(A, B),
        peak=peak_from(A - B @ K, K, vertices, plant_rate(A, B), per_channel=per_channel),
        regions=asked,
        limit=limit,
        parts=(A, -B @ K),
        missing="Ask for a smaller decay_1_s.",
    )


def _enclose(lmis: Lmis, X: ca.SX, vertices: np.ndarray, margin: float) -> None:
    """Ask that v'X^-1 v <= 1 for every vertex; -v says the same as v."""
    seen: dict[tuple[float, ...], int] = {}
    for k, vertex in enumerate(vertices):
        first = vertex[np.flatnonzero(vertex)[:1]]
        seen.setdefault(tuple((vertex * np.sign(first) if len(first) else vertex) + 0.0), k)
    if len(seen) <= _APART:
        for k in seen.values():
            lmis.psd(block_matrix([[1, vertices[k][None]], [X]]), margin=margin, name=f"start {k} in the ellipsoid")
        return
    n = vertices.shape[1]
    Y = lmis.symmetric("Y", n)
    lmis.psd(block_matrix([[Y, np.eye(n)], [X]]), margin=margin, name="Y above the inverse of X")
    for k in seen.values():
        vertex = vertices[k]
        lmis.nonnegative(1 - vertex[None] @ Y @ vertex[:, None], margin=margin, name=f"start {k} in the ellipsoid")
