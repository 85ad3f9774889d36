"""An uncertain map that contracts: one inequality for all perturbations, at all frequencies at once.

s' = (A + sum_i L_i d_i R_i) s, free to change from step to step, each d_i either a real number times the identity,
abs(d_i) <= f, or, where its shape is not square, any matrix of a norm up to f.

| symbol | code | meaning |
|---|---|---|
| L_i, R_i | `left`, `right` | where a perturbation enters, and what it multiplies |
| f | `factor` | size of the set |
| rho | `rate` | factor of each step |
| P > 0 | `P` | s' P s falls by rho^2 at least in each step |
| D_i = D_i' > 0 | `D` | scaling; any matrix if d_i is a number (and few are unknown), else a multiple of 1 |
| G_i = -G_i' | `G` | scaling that knows that d_i is real; 0 of rank one, and of a matrix |

With M = [A L; f R 0] and w = d z for z = R s,

    M' diag(P, D) M - diag(rho^2 P, D) + [f R 0]' G [0 1] + its transpose < 0

proves it, since z' D z - w' D w >= 0 and z' G w = 0. It is the upper bound on the structured singular value of M with a
block 1/z of the state's size, which stands for all frequencies, and constant scalings (A. Packard and J. Doyle, The
complex structured singular value, 1993, doi:10.1016/0005-1098(93)90175-S, section 10): 1/f is an upper bound of mu of
the perturbation. It is no more than a bound: what it does not prove may hold all the same.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

from casadi_gnc.errors import SynthesisError
from casadi_gnc.synthesis.answer import LmiAnswer
from casadi_gnc.synthesis.bisection import least
from casadi_gnc.synthesis.lmis import Lmis

#: Perturbations of so many rows have full scalings; with more, which take half a minute, each has a single number.
_FULL = 12
#: Slack of the inequality, relative to P >= 1.
_MARGIN = 1e-9


@dataclass(frozen=True, eq=False)
class UncertainMap:
    """Hold s' = (A + sum_i L_i d_i R_i) s, d_i up to 1.

    Parameters
    ----------
    A : (n, n).
    left, right : L_i, (n, q_i), and R_i, (r_i, n); d_i is a number where q_i = r_i, else a matrix, (q_i, r_i).

    Raises
    ------
    SynthesisError
        For shapes that do not fit each other.
    """

    A: np.ndarray
    left: tuple[np.ndarray, ...]
    right: tuple[np.ndarray, ...]

    def __post_init__(self) -> None:
        n = len(self.A)
        fits = self.A.shape == (n, n) and len(self.left) == len(self.right)
        for L, R in zip(self.left, self.right, strict=False):
            fits = fits and L.shape[0] == n == R.shape[1]
        if not fits:
            shapes = [(L.shape, R.shape) for L, R in zip(self.left, self.right, strict=False)]
            raise SynthesisError(
                f"A has shape {self.A.shape} and the perturbations {shapes}; expected (n, n), and (n, q) with (r, n)"
            )

    @property
    def radius(self) -> float:
        """The spectral radius without perturbation."""
        return float(np.abs(np.linalg.eigvals(self.A)).max(initial=0.0))


@dataclass(frozen=True, eq=False)
class Contraction:
    """Hold a proof: sqrt(s' P s) becomes at most `rate` times itself in each step, whatever the perturbation.

    Parameters
    ----------
    P : (n, n), symmetric, P >= 1.
    rate : rho.
    lmis : the certified answer.
    """

    P: np.ndarray
    rate: float
    lmis: LmiAnswer


def contraction(of: UncertainMap, rate: float) -> Contraction | None:
    """Return the proof of a rate whose P has the least trace, None where none is certified.

    Parameters
    ----------
    of : with states in units in which 1 is alike.
    rate : rho, above 0.
    """
    turn = _turn(len(of.A))
    lmis, P = _posed(of, rate, 1.0)
    lmis.minimize(ca.trace(P))
    answer = lmis.attempt(lmis.data(), prove=False)
    return Contraction(turn.T @ answer.unknowns["P"] @ turn, rate, answer) if answer.status.holds else None


def borne(of: UncertainMap, *, most: float = 64.0, relative: float = 1e-2) -> float:
    """Return by which factor the set may be enlarged so that it is still proved to be stable.

    Parameters
    ----------
    of : a map that is stable without perturbation.
    most : where the search ends.
    relative : to which the factor is found; at least the value that is returned is proved.

    Returns
    -------
    float
        0 where nothing is proved. Its inverse is an upper bound of mu.

    Examples
    --------
    A gain of 0.5 bears 0.5 more or less; perturbed by 0.25 the set may be twice as large:

    >>> one = UncertainMap(np.array([[0.5]]), (np.array([[0.25]]),), (np.array([[1.0]]),))
    >>> 1.95 < borne(one) < 2.0
    True
    """
    if of.radius >= 1:
        return 0.0
    rate = 1.0 - 1e-6 * (1.0 - of.radius)

    def attempt(inverse: float, prove: bool) -> LmiAnswer:
        lmis, _ = _posed(of, rate, 1.0 / inverse)
        return lmis.attempt(lmis.data(), prove=False)

    found = least(attempt, 1.0, relative, 64.0, floor=1.0 / most)
    return 1.0 / found.value if found.answer.status.holds else 0.0


def _posed(of: UncertainMap, rate: float, factor: float) -> tuple[Lmis, ca.SX]:
    """Return the inequalities of a rate and a size of the set, and P, of turned states."""
    lmis, n = Lmis(), len(of.A)
    turn = _turn(n)
    of = UncertainMap(turn @ of.A @ turn.T, tuple(turn @ L for L in of.left), tuple(R @ turn.T for R in of.right))
    P = lmis.symmetric("P", n)
    every = sum(L.shape[1] for L in of.left)
    inner, outer, mixed = ca.SX(n, n), [], []
    for i, (L, R) in enumerate(zip(of.left, of.right, strict=True)):
        width, size = L.shape[1], R.shape[0]
        if width == size and every <= _FULL:
            D, G = lmis.symmetric(f"D{i}", size), _skew(lmis, f"G{i}", size)
        else:
            D, G = lmis.scaled_identity(f"D{i}", max(width, size)), ca.SX(size, width)
        lmis.psd(D, margin=_MARGIN, name=f"scaling {i}")
        inner += factor**2 * ca.mtimes([R.T, D[:size, :size], R])
        outer.append(D[:width, :width])
        mixed.append(factor * ca.mtimes(R.T, G))
    ahead = np.hstack([of.A, *of.left])  # of (s, w)
    across, D = ca.horzcat(ca.SX(n, 0), *mixed), ca.diagcat(ca.SX(0, 0), *outer)
    inequality = ca.mtimes([ahead.T, P, ahead]) - ca.blockcat([[rate**2 * P - inner, -across], [-across.T, D]])
    lmis.psd(P, margin=1.0, name="size")  # P and the scalings may be multiplied by any number
    lmis.nsd(inequality, margin=_MARGIN, name="contraction")
    return lmis, P


def _turn(size: int) -> np.ndarray:
    """Return an orthogonal matrix that turns states so that no entry of a map is zero, (size, size).

    Of several like axes that know nothing of each other, Clarabel calls infeasible what has points.
    """
    return np.linalg.qr(np.random.default_rng(0).standard_normal((size, size)))[0]


def _skew(lmis: Lmis, name: str, size: int) -> ca.SX:
    """Return an unknown antisymmetric matrix."""
    skew = ca.SX(size, size)
    if size > 1:
        above = lmis.rectangular(name, size * (size - 1) // 2, 1)
        for number, (row, column) in enumerate(zip(*np.triu_indices(size, 1), strict=True)):
            skew[int(row), int(column)], skew[int(column), int(row)] = above[number], -above[number]
    return skew
