"""Static output feedback u = -K y with a small certified H-infinity norm, its gain of any structure.

| paper | code | meaning |
|---|---|---|
| x' = A x + B u + E w | `A`, `B`, `E` | plant and disturbance |
| z = C x + D u + F w | `C`, `D`, `F` | what is to stay small |
| y = M x + N w | `M`, `N` | measurement, with its noise |

The gain is no longer W X^-1 with unknowns of a linear inequality, and the norm has many valleys. So it is sought by
non-smooth descent from several starts (J. V. Burke, D. Henrion, A. S. Lewis, M. L. Overton, 2006,
doi:10.3182/20060705-3-FR-2907.00059): first of the poles until all lie in their regions, then of the norm. The first
start is the regulator's gain, as near as the structure comes to it; the others are drawn from fixed seeds. The smallest
norm is often that of an infinite gain; so the size of the gain is then made small while the norm stays a little above.

What is found is certified as a given gain: with the closed loop's matrices the bounded-real inequality is linear in X
and gamma. How much better any gain could be is bounded by one that knows x and w, and has no structure:

    [A X + X A' - B W - W'B',  E - B V,   (C X - D W)';
     *,                       -gamma I,   (F - D V)';
     *,                        *,        -gamma I]  < 0,     V = 0 where N is zero
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from casadi_gnc.errors import SynthesisError
from casadi_gnc.synthesis.analysis import fits, h_infinity_norm, matrices, poles
from casadi_gnc.synthesis.answer import LmiAnswer, LmiStatus
from casadi_gnc.synthesis.balancing import balanced
from casadi_gnc.synthesis.gains import GainStatus, Synthesis, certify_gains, failed, peak_from, plant_rate, starts
from casadi_gnc.synthesis.lmis import Lmis
from casadi_gnc.synthesis.output_loop import OutputLoop
from casadi_gnc.synthesis.output_search import COST, in_units, smaller, sought
from casadi_gnc.synthesis.pattern import pattern_of
from casadi_gnc.synthesis.performance import Performance, performance
from casadi_gnc.synthesis.recipes.two_steps import with_small_margins
from casadi_gnc.synthesis.regions import regions
from casadi_gnc.synthesis.unknowns import block_matrix


def output_feedback(
    A: Any,
    B: Any,
    E: Any,
    C: Any,
    D: Any,
    M: Any = None,
    F: Any = None,
    N: Any = None,
    *,
    structure: Sequence[Sequence[Any]] | None = None,
    gamma: float | None = None,
    slack: float = 0.02,
    tries: int = 6,
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
    """Return K, (m, r), for u = -K y, with the smallest norm from w to z that descent from several starts finds.

    Parameters
    ----------
    A : (n, n). B : (n, m). E : (n, q). C : (p, n). D : (p, m). M : (r, n), the state by default.
    F : (p, q), zero by default. N : (r, q), zero by default.
    structure : (m, r), of K: 0 for zero, the same whole number or name wherever the same number stands, with a minus
        for its negative; by default all are free. With names the gains are those numbers, else the matrix K.
    gamma : bound on the norm; by default (1 + slack) times the smallest that is found.
    slack : see gamma; positive.
    tries : starts of the descent, at least 1.
    margin : of the inequalities, in balanced coordinates; made smaller where it costs much.
    fastest_rad_s, decay_1_s, damping, disc_rad_s : regions of the poles, see `casadi_gnc.synthesis.regions`.
    vertices : (V, n), starts from whose hull the peak of the norm of u is simulated, without w; see `box_vertices`.
    limit : of that peak, which the search does not know; larger commands are not certified.
    backend, options : see `casadi_gnc.synthesis.backends`.

    Returns
    -------
    Synthesis
        With gain "K", or those that the structure names; `promised` is the certified gamma, `norm` the true one,
        `smallest` lies between what no feedback whatever can be better than and what was reached.

    Raises
    ------
    SynthesisError
        For wrong shapes, a structure that is none, and regions of poles that have no point in common.

    Examples
    --------
    >>> found = output_feedback([[0.0]], [[1.0]], [[1.0]], [[1.0], [0.0]], [[0.0], [1.0]], fastest_rad_s=2.0)
    >>> found.status.name, round(found.promised, 1)
    ('CERTIFIED', 1.1)
    """
    plant = performance(A, B, E, C, D, F)
    n, m, q, _ = plant.sizes
    (M,) = matrices(M=np.eye(n) if M is None else M)
    (N,) = matrices(N=np.zeros((len(M), q)) if N is None else N)
    fits("M", M, len(M), n)
    fits("N", N, len(M), q)
    pattern = pattern_of(structure, m, len(M))
    if isinstance(tries, bool) or not isinstance(tries, (int, np.integer)) or tries < 1:
        raise SynthesisError(f"tries is {tries!r}, expected a whole number of at least 1: starts of the descent")
    for name, value in (("slack", slack), ("gamma", 1.0 if gamma is None else gamma)):
        if not (np.isfinite(value) and value > 0):
            raise SynthesisError(f"{name} is {value}, expected a positive number")
    vertices, most = starts(vertices, limit, n)
    asked = regions(decay_1_s, damping, disc_rad_s, fastest_rad_s)
    rate = plant_rate(plant.A, plant.B)
    T = balanced(plant.A, plant.B, plant.E, plant.C, plant.D)
    bound = _bound(plant, T, bool(np.any(N)), margin, backend, options)
    if bound.status is LmiStatus.INFEASIBLE:
        return failed(bound)

    scaled, units = in_units(plant, T, M, pattern, rate)
    loop = OutputLoop(plant, M, N, scaled, asked, rate)
    best = sought(loop, tries)
    reached = float(np.exp(best.value))
    if best.out > 0 or (gamma is not None and reached > gamma):
        left = poles(loop.closed(loop.gain(best.numbers))[0])
        told = f"a norm below gamma; the smallest is {reached:.4g}"
        if best.out > 0:
            told = f"poles in their regions; the slowest that is left lies at {left[0]:.3g} rad/s"
        missing = f"None of {tries} starts led to {told}. Give more tries, or loosen what is asked."
        return Synthesis(GainStatus.NOT_FOUND, {}, bound, poles=left, missing=missing)
    numbers = smaller(loop, best, (1 + slack) * reached if gamma is None else gamma)
    K = loop.gain(numbers)
    a, e, c, f = loop.closed(K)
    proof, promised = _proof(a, e, c, f, margin, backend, options)
    gains = {"K": K} if not pattern.names else dict(zip(pattern.names, map(np.asarray, units * numbers), strict=True))
    found = certify_gains(
        gains,
        proof,
        a,
        rate,
        promised=promised,
        norm=h_infinity_norm(a, e, c, f),
        regions=asked,
        peak=peak_from(a, K @ M, vertices, rate),
        limit=most,
        parts=(plant.A, -plant.B @ K @ M),
        missing=plant.missing,
    )
    return replace(found, smallest=(min(max(bound.least, 0.0), reached), reached))


def _bound(
    plant: Performance, T: np.ndarray, noisy: bool, margin: float, backend: Any, options: dict[str, Any]
) -> LmiAnswer:
    """Return the answer for a feedback that knows x, and w where the measurement is noisy: none is better."""
    n, m, q, p = plant.sizes
    inverse = np.linalg.inv(T)
    a, b, e, c = T @ plant.A @ inverse, T @ plant.B, T @ plant.E, plant.C @ inverse
    lmis = Lmis()
    X, W, gamma = lmis.symmetric("X", n), lmis.rectangular("W", m, n), lmis.scalar("gamma")
    V = lmis.rectangular("V", m, q) if noisy else np.zeros((m, q))
    moved = a @ X - b @ W
    lmis.psd(X, margin=margin, name="Lyapunov matrix")
    rows = [
        [moved + moved.T, e - b @ V, (c @ X - plant.D @ W).T],
        [-gamma * np.eye(q), (plant.F - plant.D @ V).T],
        [-gamma * np.eye(p)],
    ]
    lmis.nsd(block_matrix(rows), margin=margin, name="bounded real")
    lmis.minimize(gamma)
    return with_small_margins(lmis, margin, 0.01, backend, options)[0]


def _proof(
    a: np.ndarray, e: np.ndarray, c: np.ndarray, f: np.ndarray, margin: float, backend: Any, options: dict[str, Any]
) -> tuple[LmiAnswer, float]:
    """Return the answer to the bounded-real inequality of a closed loop, and the gamma that it promises."""
    n, q, p = len(a), e.shape[1], len(c)
    T = balanced(a, np.zeros((n, 1)), e, c, np.zeros((p, 1)))
    inverse = np.linalg.inv(T)
    lmis = Lmis()
    X, gamma = lmis.symmetric("X", n), lmis.scalar("gamma")
    moved = T @ a @ inverse @ X
    lmis.psd(X, margin=margin, name="Lyapunov matrix")
    rows = [[moved + moved.T, T @ e, (c @ inverse @ X).T], [-gamma * np.eye(q), f.T], [-gamma * np.eye(p)]]
    lmis.nsd(block_matrix(rows), margin=margin, name="bounded real")
    lmis.minimize(gamma)
    answer = with_small_margins(lmis, margin, COST, backend, options)[0]
    return answer, answer.objective if answer.status.holds else float("nan")
