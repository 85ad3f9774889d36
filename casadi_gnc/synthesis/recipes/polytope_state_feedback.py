"""State feedback for a plant that lies anywhere between some others, with one gain or one that follows the plant.

| paper | code | meaning |
|---|---|---|
| x' = A(t) x + B(t) u + E w | `A`, `B`, `E` | t_i >= 0 add up to one: A(t) = sum t_i A_i, B(t) = sum t_i B_i |
| z = C x + D u + F w | `C`, `D`, `F` | what is to stay small |
| u = -K x, or -(sum t_i K_i) x | `K`, `K1`, `K2` ... | one gain, or one for each vertex |
| X = P^-1 > 0, W = K X | `X`, `W` | one for all: the plant may then move as fast as it likes |
| X_i > 0, G, W = K G | `X1` ..., `G`, `W` | of each vertex, and a matrix between: the plant stays where it is |

With M_ij the bounded-real inequality of `state_feedback` for A_i, B_i and W_j, one X asks M_ii < 0 and
M_ij + M_ji < 0 for i < j: the inequality at t is sum t_i t_j M_ij (P. Apkarian, P. Gahinet, G. Becker, 1995,
doi:10.1016/0005-1098(95)00038-X). With one gain M_i < 0 is enough. A Lyapunov matrix of each vertex is of use
only with one gain:

    [S + S',  X_i - G' + r S,  E,         (C G - D W)';
     *,       -r (G + G'),     0,         r (C G - D W)';
     *,       *,               -gamma I,  F';
     *,       *,               *,         -gamma I]  < 0,     S = A_i G - B_i W

which, multiplied by [I, a, 0, 0; 0, 0, I, 0; 0, c, 0, I] with a = A_i - B_i K and c = C - D K, is the bounded-real
inequality of that loop for X_i (after U. Shaked, 2001, doi:10.1109/9.917669). r > 0 is sampled.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.linalg import block_diag

from casadi_gnc.errors import SynthesisError
from casadi_gnc.synthesis.analysis import Norm, h_infinity_norm
from casadi_gnc.synthesis.answer import LmiAnswer
from casadi_gnc.synthesis.balancing import balanced
from casadi_gnc.synthesis.gains import Synthesis, certify_gains, plant_rate
from casadi_gnc.synthesis.lmis import Lmis
from casadi_gnc.synthesis.performance import Performance, performance
from casadi_gnc.synthesis.recipes.two_steps import two_steps
from casadi_gnc.synthesis.regions import Region, regions
from casadi_gnc.synthesis.unknowns import block_matrix

_DELAYS = (0.01, 0.03, 0.1, 0.3, 1.0)  # r, of the plant's inverse rate in balanced coordinates, that are tried
_MOST = 64  # vertices: a hypercube of six numbers


def polytope_state_feedback(
    A: Sequence[Any],
    B: Sequence[Any],
    E: Any,
    C: Any,
    D: Any,
    F: Any = None,
    *,
    scheduled: bool = False,
    dependent: bool = False,
    gamma: float | None = None,
    slack: float = 0.02,
    margin: float = 1e-7,
    fastest_rad_s: float | None = None,
    decay_1_s: float | None = None,
    damping: float | None = None,
    disc_rad_s: Sequence[float] | None = None,
    backend: Any = None,
    **options: Any,
) -> Synthesis:
    """Return gains with the smallest bound on the norm from w to z that holds for every plant between the vertices.

    Parameters
    ----------
    A : V matrices, (n, n). B : as many, (n, m), or one for all. E : (n, q). C : (p, n). D : (p, m).
    F : (p, q), zero by default.
    scheduled : whether the gain follows the plant, which is then known in flight: u = -(sum t_i K_i) x.
    dependent : whether each vertex has a Lyapunov matrix of its own: less is given away, for plants that do not change.
    gamma : bound on the norm; by default (1 + slack) times the smallest.
    slack : see gamma; positive.
    margin : of the inequalities, in balanced coordinates; made smaller where it costs much.
    fastest_rad_s, decay_1_s, damping, disc_rad_s : regions of the poles of every plant, see
        `casadi_gnc.synthesis.regions`; not together with `dependent`.
    backend, options : see `casadi_gnc.synthesis.backends`.

    Returns
    -------
    Synthesis
        With gain "K", or "K1", "K2" and so on, one a vertex; `promised` is gamma, `norm` and `poles` the true ones of
        the vertices and of the plants halfway between two of them.

    Raises
    ------
    SynthesisError
        For wrong shapes, vertices that do not belong together, and what cannot be asked together.

    Examples
    --------
    >>> z = [[1.0], [0.0]], [[0.0], [1.0]]
    >>> found = polytope_state_feedback([[[-1.0]], [[-0.5]]], [[[1.0]]], [[1.0]], *z)  # 1/root(1 + a^2) at a = -0.5
    >>> found.status.name, round(found.smallest[1], 3)
    ('CERTIFIED', 0.894)
    """
    corners = _corners(A, B, E, C, D, F)
    asked = regions(decay_1_s, damping, disc_rad_s, fastest_rad_s)
    if dependent and (scheduled or asked):
        other = "scheduled" if scheduled else "a region of poles"
        raise SynthesisError(
            f"dependent and {other} are asked together; leave one out: there is no inequality for both"
        )
    count, rate = len(corners), max(plant_rate(one.A, one.B) for one in corners)
    first = corners[0]
    middle = np.mean([one.A for one in corners], axis=0), np.mean([one.B for one in corners], axis=0)
    T = balanced(middle[0], middle[1], first.E, first.C, first.D)
    inverse = np.linalg.inv(T)
    scaled = [Performance(T @ one.A @ inverse, T @ one.B, T @ one.E, one.C @ inverse, one.D, one.F) for one in corners]

    def gains_of(answer: LmiAnswer, promised: float) -> Synthesis:
        names = [f"W{i + 1}" for i in range(count)] if scheduled else ["W"]
        root = answer["G" if dependent else "X"]
        found = [np.linalg.solve(root.T, answer[name].T).T @ T for name in names]
        gains = {f"K{i + 1}" if scheduled else "K": one for i, one in enumerate(found)}
        loops, norm = _between(corners, found)
        return certify_gains(
            gains,
            answer,
            np.asarray(block_diag(*loops)),
            rate,
            promised=promised,
            norm=norm,
            regions=asked,
            missing=first.missing,
        )

    def sought(pose: Any) -> Synthesis:
        attained = first.priced == first.B.shape[1]
        return two_steps(pose, gains_of, gamma, slack, margin, backend, options, attained=attained)

    if not dependent:
        return sought(lambda lmis, gamma, margin: _one_matrix(lmis, scaled, scheduled, asked, gamma, margin))
    own = max(float(np.linalg.norm(one.A, 2)) for one in scaled)
    tried = [sought(_of_each(scaled, delay / max(own, 1e-300))) for delay in _DELAYS]
    return min(tried, key=lambda one: (not one.is_certified, np.nan_to_num(one.promised, nan=np.inf)))


def _corners(A: Any, B: Any, E: Any, C: Any, D: Any, F: Any) -> list[Performance]:
    """Return the plants of the vertices."""
    count = len(A)
    if not 1 <= count <= _MOST:
        raise SynthesisError(f"A has {count} vertices, expected 1 to {_MOST}")
    if len(B) not in (1, count):
        raise SynthesisError(f"B has {len(B)} vertices and A {count}; expected as many, or one B for all")
    found = [performance(A[i], B[i if len(B) > 1 else 0], E, C, D, F) for i in range(count)]
    for i, one in enumerate(found):
        if one.sizes != found[0].sizes:
            raise SynthesisError(
                f"vertex {i + 1} has {one.sizes[:2]} states and commands, the first {found[0].sizes[:2]}"
            )
    return found


def _between(corners: Sequence[Performance], gains: Sequence[np.ndarray]) -> tuple[list[np.ndarray], Norm]:
    """Return the closed loops of the vertices and halfway between them, and the largest norm among these."""
    loops, norms = [], []
    for i, one in enumerate(corners):
        for j in range(i, len(corners)):
            a, b = (one.A + corners[j].A) / 2, (one.B + corners[j].B) / 2
            K = (gains[min(i, len(gains) - 1)] + gains[min(j, len(gains) - 1)]) / 2
            loops.append(a - b @ K)
            norms.append(h_infinity_norm(loops[-1], one.E, one.C - one.D @ K, one.F))
    return loops, max(norms, key=lambda norm: norm.upper)


def _bounded(S: Any, E: np.ndarray, seen: Any, F: np.ndarray, gamma: Any, times: int = 1) -> Any:
    """Return the bounded-real matrix of S = A X - B W and seen = C X - D W, or of a sum of such."""
    corner = -times * gamma
    return block_matrix(
        [[S + S.T, times * E, seen.T], [corner * np.eye(E.shape[1]), times * F.T], [corner * np.eye(len(F))]]
    )


def _one_matrix(
    lmis: Lmis, corners: Sequence[Performance], scheduled: bool, asked: Sequence[Region], gamma: Any, margin: float
) -> Any:
    """State the inequalities with one X for all."""
    n, m, _, _ = corners[0].sizes
    X = lmis.symmetric("X", n)
    W = [lmis.rectangular(f"W{i + 1}" if scheduled else "W", m, n) for i in range(len(corners) if scheduled else 1)]
    lmis.psd(X, margin=margin, name="Lyapunov matrix")
    pairs = [(i, i) for i in range(len(corners))]
    if scheduled:
        pairs += [(i, j) for i in range(len(corners)) for j in range(i)]
    for i, j in pairs:
        one, other = corners[i], corners[j]
        S, seen, times = one.A @ X - one.B @ W[j if scheduled else 0], one.C @ X - one.D @ W[j if scheduled else 0], 1
        if i != j:
            S, seen, times = S + other.A @ X - other.B @ W[i], seen + other.C @ X - other.D @ W[i], 2
        where = f"vertex {i + 1}" if i == j else f"vertices {j + 1} and {i + 1}"
        lmis.nsd(_bounded(S, one.E, seen, one.F, gamma, times), margin=margin, name=f"bounded real, {where}")
        for region in asked:
            region.at(where).pose(lmis, times * X, S, 0.1 * margin)
    return X


def _of_each(corners: Sequence[Performance], delay: float) -> Any:
    """Return what states the inequalities with a Lyapunov matrix of each vertex."""

    def pose(lmis: Lmis, gamma: Any, margin: float) -> Any:
        n, m, q, p = corners[0].sizes
        G, W = lmis.rectangular("G", n, n), lmis.rectangular("W", m, n)
        for i, one in enumerate(corners):
            X, S = lmis.symmetric(f"X{i + 1}", n), one.A @ G - one.B @ W
            seen = one.C @ G - one.D @ W
            lmis.psd(X, margin=margin, name=f"Lyapunov matrix {i + 1}")
            rows = [
                [S + S.T, X - G.T + delay * S, one.E, seen.T],
                [-delay * (G + G.T), np.zeros((n, q)), delay * seen.T],
                [-gamma * np.eye(q), one.F.T],
                [-gamma * np.eye(p)],
            ]
            lmis.nsd(block_matrix(rows), margin=margin, name=f"bounded real, vertex {i + 1}")
        return G

    return pose
