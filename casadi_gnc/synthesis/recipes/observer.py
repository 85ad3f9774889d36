"""Observer with the smallest certified H-infinity norm from disturbance and noise to the error.

| paper | code | meaning |
|---|---|---|
| x' = A x + E w | `A`, `E` | plant; known inputs drop out of the error |
| y = C x + F w | `C`, `F` | measurement; w holds the noise too |
| z = G e | `G` | what part of the error e = x - estimate is to stay small |
| P > 0, H = P L | `P`, `H` | unknowns |

The error obeys e' = (A - L C) e + (E - L F) w. V = e'Pe and a Schur complement give

    [P A + A'P - H C - C'H',  P E - H F,  G';
     *,                      -gamma I,    0;
     *,                       *,         -gamma I]  < 0

which is the dual of state feedback (S. Boyd et al., 1994, section 7.5; there for the plant).
As there, gamma is held a little above its smallest value while the trace of P is maximised.
P and H are those of the error in coordinates of `casadi_gnc.synthesis.balancing`, of the dual plant.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from casadi_gnc.synthesis.analysis import fits, h_infinity_norm, matrices
from casadi_gnc.synthesis.answer import LmiAnswer
from casadi_gnc.synthesis.balancing import balanced
from casadi_gnc.synthesis.gains import Synthesis, certify_gains, plant_rate
from casadi_gnc.synthesis.lmis import Lmis
from casadi_gnc.synthesis.recipes.two_steps import two_steps
from casadi_gnc.synthesis.regions import regions
from casadi_gnc.synthesis.unknowns import block_matrix


def observer(
    A: Any,
    C: Any,
    E: Any,
    F: Any,
    G: Any = None,
    *,
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
    """Return L, (n, r), for estimate' = A estimate + known + L (y - C estimate).

    Parameters
    ----------
    A : (n, n). C : (r, n). E : (n, q). F : (r, q). G : (p, n), identity by default.
    gamma : bound on the norm; by default (1 + slack) times the smallest.
    slack : see gamma; positive.
    margin : of the inequalities, in those coordinates; made smaller where it raises the smallest gamma by more than a
        quarter of slack.
    fastest_rad_s : the error's poles are kept within this distance of zero. Needed where w does not
        disturb all of y: else the gain may run to infinity.
    decay_1_s, damping, disc_rad_s : further regions of those poles, see `casadi_gnc.synthesis.regions`.
    backend, options : see `casadi_gnc.synthesis.backends`.

    Returns
    -------
    Synthesis
        With gain "L"; `promised` is gamma, `norm` the true one.

    Raises
    ------
    SynthesisError
        For wrong shapes, and regions of poles that have no point in common.

    Examples
    --------
    >>> found = observer([[0.0]], [[1.0]], [[1.0, 0.0]], [[0.0, 1.0]])
    >>> found.status.name, round(found.promised, 3)
    ('CERTIFIED', 1.02)
    """
    A, C, E, F = matrices(A=A, C=C, E=E, F=F)
    n, r, q = len(A), len(C), E.shape[1]
    (G,) = matrices(G=np.eye(n) if G is None else G)
    for name, matrix, rows, columns in (
        ("A", A, n, n),
        ("C", C, r, n),
        ("E", E, n, q),
        ("F", F, r, q),
        ("G", G, len(G), n),
    ):
        fits(name, matrix, rows, columns)
    asked = regions(decay_1_s, damping, disc_rad_s, fastest_rad_s)
    noisy = int(np.linalg.matrix_rank(F))
    missing = f"w disturbs {noisy} of {r} measurements: give the others noise in F, or give fastest_rad_s."

    inverse = balanced(A.T, C.T, G.T, E.T, F.T).T  # T^-1, of a filter's covariance T^-1 T^-1'
    T = np.linalg.inv(inverse)
    a, c, e, g = T @ A @ inverse, C @ inverse, T @ E, G @ inverse

    def pose(lmis: Lmis, gamma: Any, margin: float) -> Any:
        P, H = lmis.symmetric("P", n), lmis.rectangular("H", n, r)
        moved = P @ a - H @ c
        lmis.psd(P, margin=margin, name="Lyapunov matrix")
        lmis.nsd(
            block_matrix([[moved + moved.T, P @ e - H @ F, g.T], [-gamma * np.eye(q), 0], [-gamma * np.eye(len(G))]]),
            margin=margin,
            name="bounded real",
        )
        for region in asked:
            region.pose(lmis, P, moved, 0.1 * margin)
        return P

    def gains_of(answer: LmiAnswer, promised: float) -> Synthesis:
        L = inverse @ np.linalg.solve(answer["P"], answer["H"])
        norm = h_infinity_norm(A - L @ C, E - L @ F, G)
        return certify_gains(
            {"L": L},
            answer,
            A - L @ C,
            plant_rate(A, C),
            promised=promised,
            norm=norm,
            regions=asked,
            missing=missing if noisy < r else "Give fastest_rad_s.",
        )

    return two_steps(pose, gains_of, gamma, slack, margin, backend, options, attained=noisy == r)
