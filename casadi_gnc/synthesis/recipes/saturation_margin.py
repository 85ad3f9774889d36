"""How far a command may exceed its limit before a loop with saturation is no longer proved stable.

| paper | code | meaning |
|---|---|---|
| x' = A x + B sat(v), v = -K x | `A`, `B`, `K` | plant, and its feedback |
| q = v - sat(v) | | what the limits take away: x' = (A - B K) x - B q |
| s | `share` | q_i lies between 0 and s v_i as long as abs(v_i) is at most 1/(1 - s) times its limit |
| T > 0, diagonal | `T` | multiplier of the sector: 2 q'T (s v - q) >= 0 |
| Lp, Lm >= 0, diagonal | `rising`, `falling` | multipliers of Popov |

V = x'P x + 2 sum (Lp - Lm)_i (integral of q_i from 0 to v_i) falls along every motion if, with a = A - B K and
L = Lp - Lm,

    [P a + a'P,  -P B - a'K'L - s K'T;
     *,          -2 T + L K B + B'K'L]  < 0,     P - s K'Lm K > 0

and the second, by the integral being at most s v_i^2 / 2, says V > 0. With L = 0 this is the circle criterion, else
Popov's with a factor of either sign (H. K. Khalil, Nonlinear Systems, 3rd edition, 2002, section 7.1). Nothing is asked
of the limits' shape but the sector. The largest s up to 1 is sought by bisection of 1/s; s = 1 says: stable from
everywhere.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Literal

import casadi as ca
import numpy as np

from casadi_gnc.errors import SynthesisError
from casadi_gnc.synthesis.analysis import fits, matrices
from casadi_gnc.synthesis.answer import LmiAnswer
from casadi_gnc.synthesis.balancing import balanced
from casadi_gnc.synthesis.bisection import least
from casadi_gnc.synthesis.gains import Synthesis, certify_gains, failed, plant_rate
from casadi_gnc.synthesis.lmis import Lmis
from casadi_gnc.synthesis.unknowns import block_matrix

_CRITERIA = ("circle", "popov")


def saturation_margin(
    A: Any,
    B: Any,
    K: Any,
    *,
    criterion: Literal["circle", "popov"] = "popov",
    relative: float = 1e-4,
    margin: float = 1e-7,
    largest: float = 1e4,
    backend: Any = None,
    **options: Any,
) -> Synthesis:
    """Return the gain K as it was given, and the largest share of its command that saturation may take.

    Parameters
    ----------
    A : (n, n), [1/s]. B : (n, m). K : (m, n), of v = -K x, each command with a limit of its own.
    criterion : "circle" holds for limits that change with time too, "popov" for those that do not, and proves more.
    relative : to which the share is sought.
    margin : of the inequalities, in balanced coordinates and with multipliers of at least one.
    largest : the inverse of the share from which on it is taken for nothing.
    backend, options : see `casadi_gnc.synthesis.backends`.

    Returns
    -------
    Synthesis
        With gain "K"; `share` is s: what is proved holds as long as no command asks for more than 1/(1 - s) times its
        limit. `ratios` are factors of B that the loop without limits tolerates.

    Raises
    ------
    SynthesisError
        For wrong shapes, numbers out of range, and a criterion that is none.

    Examples
    --------
    >>> found = saturation_margin([[1.0]], [[1.0]], [[2.0]])  # at half of what it asks for the loop no longer decays
    >>> found.status.name, round(found.share, 3)
    ('CERTIFIED', 0.5)
    """
    A, B, K = matrices(A=A, B=B, K=K)
    n, m = len(A), B.shape[1]
    fits("A", A, n, n)
    fits("B", B, n, m)
    fits("K", K, m, n)
    if criterion not in _CRITERIA:
        raise SynthesisError(f"criterion is {criterion!r}, expected one of {', '.join(_CRITERIA)}")
    for name, value in (("relative", relative), ("largest", largest)):
        if not (np.isfinite(value) and value > 0):
            raise SynthesisError(f"{name} is {value}, expected a positive number")
    loop = A - B @ K
    inverse = np.linalg.inv(balanced(loop, np.zeros((n, 1)), B, K, np.zeros((m, 1))))
    a, b, k = np.linalg.solve(inverse, loop @ inverse), np.linalg.solve(inverse, B), K @ inverse
    posed = [_pose(a, b, k, criterion == "popov", step, margin) for step in (0.0, 1.0)]
    zero, one = (lmis.data() for lmis in posed)

    def attempt(over: float, prove: bool) -> LmiAnswer:
        return posed[0].attempt(zero.towards(one, over), backend, prove=prove, **options)

    over, answer = 1.0, attempt(1.0, False)
    if not answer.status.holds:
        found = least(attempt, 2.0, relative, largest)
        over, answer = found.value, found.answer
    if not answer.status.holds:
        return failed(answer)
    certified = certify_gains({"K": K}, answer, loop, plant_rate(A, B), parts=(A, -B @ K))
    return replace(certified, share=1 / over)


def _pose(a: np.ndarray, b: np.ndarray, k: np.ndarray, popov: bool, over: float, margin: float) -> Lmis:
    """Return the inequalities for 1/s = over."""
    m, n = k.shape
    lmis = Lmis()
    P, T = lmis.symmetric("P", n), lmis.diagonal("T", m)
    falls = P @ a + a.T @ P
    cross, corner = -P @ b - k.T @ T, -2 * over * T
    lmis.psd(P, margin=margin, name="Lyapunov matrix")
    lmis.nonnegative(ca.diag(T), margin=1.0, name="multiplier")  # in no unit: all may be multiplied by any number
    if popov:
        rising, falling = lmis.diagonal("rising", m), lmis.diagonal("falling", m)
        signed = rising - falling
        cross -= a.T @ k.T @ signed
        corner += signed @ k @ b + b.T @ k.T @ signed
        lmis.nonnegative(ca.diag(rising), margin=0.0, name="rising")
        lmis.nonnegative(ca.diag(falling), margin=0.0, name="falling")
        lmis.psd(over * P - k.T @ falling @ k, margin=margin, name="positive function")
    lmis.nsd(block_matrix([[falls, cross], [corner]]), margin=margin, name="criterion")
    return lmis
