"""The H2 norm of a loop: the root of the energy with which it answers impulses, or white noise in the mean.

With A X + X A' + B B' = 0 and A'Y + Y A + C'C = 0 it is the root of trace(C X C') = trace(B'Y B). For an X with a
residual R = A X + X A' + B B' the square is trace(C X C') + trace(R Y): that bounds what rounding did to X.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from casadi_gnc.synthesis.analysis import system


@dataclass(frozen=True)
class Energy:
    """Hold an H2 norm between two bounds, with what is known of it beforehand.

    Parameters
    ----------
    lower, upper : bounds; both infinite for a loop that is not stable.
    promised : bound on the norm that inequalities imply; NaN if none do.
    least : no gains are promised less by the same inequalities without their margins; NaN if not sought.
    """

    lower: float
    upper: float
    promised: float = float("nan")
    least: float = float("nan")


def h_two_norm(A: Any, B: Any, C: Any) -> Energy:
    """Return the H2 norm of C (sI - A)^-1 B.

    Parameters
    ----------
    A : (n, n), Hurwitz. B : (n, m). C : (p, n).

    Raises
    ------
    SynthesisError
        For wrong shapes. An unstable A has the norm infinity.

    Examples
    --------
    >>> round(h_two_norm([[-2.0]], [[1.0]], [[3.0]]).upper, 6)
    1.5
    """
    from scipy.linalg import solve_continuous_lyapunov

    A, B, C = system(A, B, C)
    if np.linalg.eigvals(A).real.max(initial=-1.0) >= 0:
        return Energy(np.inf, np.inf)
    X, Y = solve_continuous_lyapunov(A, -B @ B.T), solve_continuous_lyapunov(A.T, -C.T @ C)
    X, Y = (X + X.T) / 2, (Y + Y.T) / 2
    long_A, long_X = A.astype(np.longdouble), X.astype(np.longdouble)
    moved, push = long_A @ long_X, B.astype(np.longdouble)
    residual = np.asarray(moved + moved.T + push @ push.T, dtype=float)
    square = float(np.trace(C @ X @ C.T))
    # R's entries are at most |R| in the 2-norm, and trace(R Y) at most that times trace(Y); Y has rounding too.
    doubt = 2 * float(np.linalg.norm(residual, 2) * np.trace(Y)) + 8 * len(A) * np.finfo(float).eps * square
    return Energy(float(np.sqrt(max(square - doubt, 0.0))), float(np.sqrt(square + doubt)))
