"""State feedback u = -K x with the smallest certified H2 norm among those that keep an H-infinity norm.

| paper | code | meaning |
|---|---|---|
| x' = A x + B u + E w + E2 w2 | `A`, `B`, `E`, `E2` | plant, disturbances |
| z = C x + D u + F w | `C`, `D`, `F` | from w its H-infinity norm is below gamma |
| z2 = C2 x + D2 u | `C2`, `D2` | from w2 its H2 norm is to be small |
| X > 0, W = K X | `X`, `W` | unknowns; X above the covariance of x for white noise w2 |
| Z, s | `Z`, `s` | above the covariance of z2; scale between the two norms |

    [A X + X A' - B W - W'B',  E2;  *, -I] < 0,    [Z, C2 X - D2 W;  *, X] > 0,

    [A X + X A' - B W - W'B',  s E,  (C X - D W)';
     *,                       -s I,  s F';
     *,                        *,   -s gamma^2 I]  < 0

and the trace of Z is minimised: its root bounds the H2 norm. The third is the bounded-real inequality for
V = s x'X^-1 x; with s = 1 it is that of P. P. Khargonekar and M. A. Rotea (1991, doi:10.1109/9.85062), where w2 is w.
One X for both norms is what makes it affine, and the bound an upper one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np

from casadi_gnc.errors import SynthesisError
from casadi_gnc.synthesis.analysis import h_infinity_norm
from casadi_gnc.synthesis.balancing import covariance_root
from casadi_gnc.synthesis.energy import h_two_norm
from casadi_gnc.synthesis.gains import Synthesis, certify_gains, failed, peak_from, plant_rate, starts
from casadi_gnc.synthesis.lmis import Lmis
from casadi_gnc.synthesis.performance import performance
from casadi_gnc.synthesis.recipes.two_steps import with_small_margins
from casadi_gnc.synthesis.regions import regions
from casadi_gnc.synthesis.unknowns import block_matrix

_DEAR = 0.005  # share of the smallest trace that margins may cost


def mixed_state_feedback(
    A: Any,
    B: Any,
    E: Any,
    C: Any,
    D: Any,
    C2: Any,
    D2: Any,
    *,
    gamma: float,
    F: Any = None,
    E2: Any = None,
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
    """Return K, (m, n), for u = -K x with the smallest bound on the H2 norm from w2 to z2.

    Parameters
    ----------
    A : (n, n). B : (n, m). E : (n, q). C : (p, n). D : (p, m). C2 : (p2, n). D2 : (p2, m).
    gamma : bound on the H-infinity norm from w to z, positive.
    F : (p, q), zero by default. E2 : (n, q2), E by default.
    margin : of the inequalities, in coordinates of x with a covariance near one; made smaller where it costs much.
    fastest_rad_s, decay_1_s, damping, disc_rad_s : regions of the poles, see `casadi_gnc.synthesis.regions`.
    vertices : (V, n), starts from whose hull the peak of the norm of u is simulated; see `box_vertices`.
    limit : of that peak, which the LMIs do not know; larger commands are not certified.
    backend, options : see `casadi_gnc.synthesis.backends`.

    Returns
    -------
    Synthesis
        With gain "K"; `promised` is gamma, `norm` the true one; `energy` holds the H2 norm and what was promised of it.

    Raises
    ------
    SynthesisError
        For wrong shapes, a gamma that is not positive, and regions of poles that have no point in common.

    Examples
    --------
    >>> both = [[1.0], [0.0]], [[0.0], [1.0]]
    >>> found = mixed_state_feedback([[0.0]], [[1.0]], [[1.0]], *both, *both, gamma=10.0)
    >>> found.status.name, round(found.energy.promised, 2)
    ('CERTIFIED', 1.0)
    """
    plant = performance(A, B, E, C, D, F)
    A, B, E, C, D, F = plant.A, plant.B, plant.E, plant.C, plant.D, plant.F
    n, m, q, p = plant.sizes
    second = performance(A, B, E if E2 is None else E2, C2, D2, suffix="2")
    E2, C2, D2 = second.E, second.C, second.D
    if not (np.isfinite(gamma) and gamma > 0):
        raise SynthesisError(f"gamma is {gamma}, expected a positive number: the bound on the H-infinity norm")
    vertices, most = starts(vertices, limit, n)
    asked = regions(decay_1_s, damping, disc_rad_s, fastest_rad_s)
    inverse = covariance_root(A, B, E2, C2, D2)
    T = np.linalg.inv(inverse)
    a, b, e, e2, c, c2 = T @ A @ inverse, T @ B, T @ E, T @ E2, C @ inverse, C2 @ inverse

    lmis = Lmis()
    X, W, s = lmis.symmetric("X", n), lmis.rectangular("W", m, n), lmis.scalar("s")
    Z, moved = lmis.symmetric("Z", len(c2)), a @ X - b @ W
    fall = moved + moved.T
    lmis.psd(X, margin=margin, name="Lyapunov matrix")
    lmis.nsd(block_matrix([[fall, e2], [-np.eye(e2.shape[1])]]), margin=margin, name="covariance")
    lmis.psd(block_matrix([[Z, c2 @ X - D2 @ W], [X]]), margin=margin, name="H2 output")
    rows = [[fall, s * e, (c @ X - D @ W).T], [-s * np.eye(q), s * F.T], [-s * gamma**2 * np.eye(p)]]
    lmis.nsd(block_matrix(rows), margin=margin, name="bounded real")
    for region in asked:
        region.pose(lmis, X, moved, 0.1 * margin)
    lmis.minimize(ca.trace(Z))
    answer, _ = with_small_margins(lmis, margin, _DEAR, backend, options)
    if not answer.status.holds:
        return failed(answer)
    K = np.linalg.solve(answer["X"], answer["W"].T).T @ T
    promised, least = (float(np.sqrt(max(square, 0.0))) for square in (answer.objective, answer.least))
    loop = A - B @ K
    return certify_gains(
        {"K": K},
        answer,
        loop,
        plant_rate(A, B),
        promised=float(gamma),
        norm=h_infinity_norm(loop, E, C - D @ K, F),
        energy=replace(h_two_norm(loop, E2, C2 - D2 @ K), promised=promised, least=min(least, promised)),
        regions=asked,
        peak=peak_from(loop, K, vertices, plant_rate(A, B)),
        limit=most,
        parts=(A, -B @ K),
        missing=second.missing,
    )
