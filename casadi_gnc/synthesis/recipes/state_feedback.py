"""State feedback u = -K x with the smallest certified H-infinity norm.

| paper | code | meaning |
|---|---|---|
| x' = A x + B u + E w | `A`, `B`, `E` | plant and disturbance |
| z = C x + D u + F w | `C`, `D`, `F` | what is to stay small |
| X = P^-1 > 0, W = K X | `X`, `W` | unknowns |

V = x'Px with gamma V' + z'z - gamma^2 w'w < 0 along the loop, gives, after a congruence with X and a
Schur complement, the bounded-real inequality in X, W and gamma

    [A X + X A' - B W - W'B',  E,         (C X - D W)';
     *,                       -gamma I,   F';
     *,                        *,        -gamma I]  < 0

(S. Boyd et al., Linear Matrix Inequalities in System and Control Theory, 1994, section 7.5.) At the
smallest gamma the gain is seldom unique and often infinite. So gamma is then held a little above, and
the trace of X maximised: where D'D > 0 and F = 0, P = gamma X^-1 is then the stabilising solution of the
Riccati equation A'P + P A + C'C - (P B + C'D)(D'D)^-1 (B'P + D'C) + P E E'P / gamma^2 = 0.
X and W are those of the state in coordinates of `casadi_gnc.synthesis.balancing`, whatever the units of x are.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from casadi_gnc.synthesis.analysis import h_infinity_norm
from casadi_gnc.synthesis.answer import LmiAnswer
from casadi_gnc.synthesis.balancing import balanced
from casadi_gnc.synthesis.gains import Synthesis, certify_gains, peak_from, plant_rate, starts
from casadi_gnc.synthesis.lmis import Lmis
from casadi_gnc.synthesis.performance import performance
from casadi_gnc.synthesis.recipes.two_steps import two_steps
from casadi_gnc.synthesis.regions import regions
from casadi_gnc.synthesis.unknowns import block_matrix


def state_feedback(
    A: Any,
    B: Any,
    E: Any,
    C: Any,
    D: Any,
    F: Any = None,
    *,
    gamma: float | None = None,
    slack: float = 0.02,
    margin: float = 1e-7,
    fastest_rad_s: float | None = None,
    decay_1_s: float | None = None,
    damping: float | None = None,
    disc_rad_s: Sequence[float] | None = None,
    vertices: Any = None,
    limit: float | None = None,
    backend: Any = None,
    **options: Any,
) -> Synthesis:
    """Return K, (m, n), for u = -K x with the smallest norm from w to z.

    Parameters
    ----------
    A : (n, n). B : (n, m). E : (n, q). C : (p, n). D : (p, m). F : (p, q), zero by default.
    gamma : bound on the norm; by default (1 + slack) times the smallest.
    slack : see gamma; positive.
    margin : of the inequalities, in those coordinates; made smaller where it raises the smallest gamma by more than a
        quarter of slack.
    fastest_rad_s : the closed loop's poles are kept within this distance of zero. Needed where z does
        not hold all of u: else the gain may run to infinity.
    decay_1_s, damping, disc_rad_s : further regions of the poles, see `casadi_gnc.synthesis.regions`.
    vertices : (V, n), starts from whose hull the peak of the norm of u is simulated; see `box_vertices`.
    limit : of that peak, which the LMIs do not know; larger commands are not certified.
    backend, options : see `casadi_gnc.synthesis.backends`.

    Returns
    -------
    Synthesis
        With gain "K"; `promised` is gamma, `norm` the true one, `ratios` factors of B that the loop tolerates.

    Raises
    ------
    SynthesisError
        For wrong shapes, and regions of poles that have no point in common.

    Examples
    --------
    >>> found = state_feedback([[0.0]], [[1.0]], [[1.0]], [[1.0], [0.0]], [[0.0], [1.0]])
    >>> found.status.name, round(found.promised, 3)
    ('CERTIFIED', 1.02)
    """
    plant = performance(A, B, E, C, D, F)
    A, B, E, C, D, F = plant.A, plant.B, plant.E, plant.C, plant.D, plant.F
    n, m, q, p = plant.sizes
    vertices, most = starts(vertices, limit, n)
    asked = regions(decay_1_s, damping, disc_rad_s, fastest_rad_s)

    T = balanced(A, B, E, C, D)
    inverse = np.linalg.inv(T)
    a, b, e, c = T @ A @ inverse, T @ B, T @ E, C @ inverse

    def pose(lmis: Lmis, gamma: Any, margin: float) -> Any:
        X, W = lmis.symmetric("X", n), lmis.rectangular("W", m, n)
        moved = a @ X - b @ W
        lmis.psd(X, margin=margin, name="Lyapunov matrix")
        lmis.nsd(
            block_matrix([[moved + moved.T, e, (c @ X - D @ W).T], [-gamma * np.eye(q), F.T], [-gamma * np.eye(p)]]),
            margin=margin,
            name="bounded real",
        )
        for region in asked:
            region.pose(lmis, X, moved, 0.1 * margin)
        return X

    def gains_of(answer: LmiAnswer, promised: float) -> Synthesis:
        K = np.linalg.solve(answer["X"], answer["W"].T).T @ T
        norm = h_infinity_norm(A - B @ K, E, C - D @ K, F)
        return certify_gains(
            {"K": K},
            answer,
            A - B @ K,
            plant_rate(A, B),
            promised=promised,
            norm=norm,
            regions=asked,
            peak=peak_from(A - B @ K, K, vertices, plant_rate(A, B)),
            limit=most,
            parts=(A, -B @ K),
            missing=plant.missing,
        )

    return two_steps(pose, gains_of, gamma, slack, margin, backend, options, attained=plant.priced == m)
