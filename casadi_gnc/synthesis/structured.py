"""Bounds on the structured singular value mu of a matrix, or of a loop at frequencies.

1/mu is the size of the smallest perturbation Delta of a structure with det(I - M Delta) = 0; mu is 0 where none is.

| paper | code | meaning |
|---|---|---|
| Delta | `perturbation` | block diagonal; see `Uncertainty` |
| D = D* > 0, D Delta = Delta D | `D` | scaling |
| G = G*, G Delta = Delta* G | `G` | scaling that knows real blocks, zero at the others |
| beta | `upper` | M* D M + j (G M - M* G) - beta^2 D < 0 proves mu < beta |

The upper bound is bisected over these LMIs (M. K. H. Fan, A. L. Tits, J. C. Doyle, 1991, doi:10.1109/9.62265).
Hermitian S + jK is posed as the real [S, -K; K, S]. The lower bound is a perturbation that `power_iteration` finds.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import casadi as ca
import numpy as np

from casadi_gnc.errors import SynthesisError
from casadi_gnc.synthesis.answer import LmiAnswer
from casadi_gnc.synthesis.bisection import least
from casadi_gnc.synthesis.lmis import Lmis
from casadi_gnc.synthesis.power_iteration import perturbation_of

_KINDS = ("full", "complex", "real")
_NOTHING = 1e-6  # of the norm of M: what mu is called zero below
Pair = tuple[Any, Any]  # real and imaginary part


@dataclass(frozen=True)
class Uncertainty:
    """Hold a block of the perturbation.

    Parameters
    ----------
    kind : "full", any complex matrix; "complex" or "real", one such number times the identity.
    size : rows and columns.
    """

    kind: Literal["full", "complex", "real"]
    size: int = 1

    def __post_init__(self) -> None:
        """Refuse what is none."""
        if self.kind not in _KINDS:
            raise SynthesisError(f"a block of the perturbation is {self.kind!r}, expected one of {', '.join(_KINDS)}")
        if isinstance(self.size, bool) or not isinstance(self.size, (int, np.integer)) or self.size < 1:
            raise SynthesisError(f"a {self.kind} block has the size {self.size!r}, expected a whole number, at least 1")


@dataclass(frozen=True, eq=False)
class MuBounds:
    """Hold bounds on mu.

    Parameters
    ----------
    lower, upper : mu lies between them; the upper one is certified by eigenvalues of the inequalities, the lower one
        is the inverse size of `perturbation`, or 0.
    perturbation : (n, n), complex, of the structure, with M perturbation having the eigenvalue one; None with lower 0.
    D, G : (n, n), complex, of the upper bound.
    lmis : answer to the inequalities at the upper bound.
    """

    lower: float
    upper: float
    perturbation: np.ndarray | None
    D: np.ndarray
    G: np.ndarray
    lmis: LmiAnswer


def mu_bounds(
    M: Any,
    structure: Sequence[Uncertainty],
    *,
    relative: float = 1e-4,
    starts: int = 12,
    backend: Any = None,
    **options: Any,
) -> MuBounds:
    """Return bounds on the structured singular value of a matrix.

    Parameters
    ----------
    M : (n, n), real or complex.
    structure : blocks of the perturbation, in the order of M's rows; their sizes add up to n.
    relative : to which the upper bound is bisected.
    starts : of the iteration for the lower bound, from fixed seeds.
    backend, options : see `casadi_gnc.synthesis.backends`.

    Raises
    ------
    SynthesisError
        For what is no square matrix of finite numbers, blocks that do not fill it, and an upper bound that no back end
        certifies.

    Examples
    --------
    >>> found = mu_bounds([[0.0, 4.0], [1.0, 0.0]], [Uncertainty("full"), Uncertainty("full")])
    >>> round(found.lower, 3), round(found.upper, 3)
    (2.0, 2.0)
    """
    M = _complex(M)
    _refuse_misfit(M, structure)
    if not (np.isfinite(relative) and relative > 0):
        raise SynthesisError(f"relative is {relative}, expected a positive number")
    size = float(np.linalg.norm(M, 2))
    lower, delta = perturbation_of(M, structure, starts)
    if size == 0:
        size = 1.0
    shape = M / size
    pair = (np.ascontiguousarray(shape.real), np.ascontiguousarray(shape.imag))

    posed = [_pose(pair, structure, square) for square in (0.0, 1.0)]
    zero, one = (lmis.data() for lmis in posed)

    def attempt(beta: float, prove: bool) -> LmiAnswer:
        return posed[0].attempt(zero.towards(one, beta**2), backend, prove=prove, **options)

    found = least(attempt, 1.0 + 2 * relative, relative, 4.0, floor=_NOTHING)
    if not found.answer.status.holds:
        raise SynthesisError(f"no upper bound is certified by this back end: {found.answer.sentence()}")
    D, G = _scalings(found.answer, structure)
    return MuBounds(lower, size * found.value, delta, D, size * G, found.answer)  # M was divided by its size


def mu_of_loop(
    A: Any, B: Any, C: Any, D: Any, structure: Sequence[Uncertainty], frequencies_rad_s: Any, **options: Any
) -> list[MuBounds]:
    """Return bounds on mu of C (jw I - A)^-1 B + D at each frequency; between them nothing is said.

    Parameters
    ----------
    A : (n, n), Hurwitz. B : (n, k). C : (k, n). D : (k, k).
    structure, options : as of `mu_bounds`.
    frequencies_rad_s : (F,), [rad/s].

    Raises
    ------
    SynthesisError
        As `mu_bounds`, and for a loop that is not stable: its response says nothing.
    """
    from casadi_gnc.synthesis.analysis import fits, matrices, poles

    A, B, C, D = matrices(A=A, B=B, C=C, D=D)
    fits("A", A, len(A), len(A))
    fits("B", B, len(A), B.shape[1])
    fits("C", C, B.shape[1], len(A))
    fits("D", D, B.shape[1], B.shape[1])
    (line,) = matrices(frequencies_rad_s=np.atleast_2d(np.asarray(frequencies_rad_s, dtype=float)))
    slowest = poles(A)[0]
    if slowest.real >= 0:
        raise SynthesisError(f"the loop has the pole {slowest:.3g}; only of a stable one mu says what it bears")
    unit = np.eye(len(A))
    return [mu_bounds(C @ np.linalg.solve(1j * w * unit - A, B) + D, structure, **options) for w in line.ravel()]


def _complex(M: Any) -> np.ndarray:
    from casadi_gnc.synthesis.analysis import matrices

    array: Any = np.asarray(M)
    if np.iscomplexobj(array):
        real, imaginary = matrices(**{"M": array.real, "the imaginary part of M": array.imag})
        return real + 1j * imaginary
    return matrices(M=M)[0].astype(complex)


def _refuse_misfit(M: np.ndarray, structure: Sequence[Uncertainty]) -> None:
    count = sum(block.size for block in structure)
    if M.shape[0] != M.shape[1] or M.shape[0] != count:
        raise SynthesisError(
            f"M has shape {M.shape} and the blocks of the perturbation {count} rows; expected a square matrix with as "
            "many"
        )


def _product(a: Pair, b: Pair) -> Pair:
    return a[0] @ b[0] - a[1] @ b[1], a[0] @ b[1] + a[1] @ b[0]


def _pose(M: Pair, structure: Sequence[Uncertainty], square: float) -> Lmis:
    """Return the inequalities for beta^2 = square."""
    lmis = Lmis()
    D, G = _unknowns(lmis, structure)
    adjoint = M[0].T, -M[1].T
    first, mixed = _product(adjoint, _product(D, M)), _product(G, M)
    # j (G M - (G M)*) has the real part -(I + I') and the imaginary part R - R', with G M = R + jI.
    real = first[0] - (mixed[1] + mixed[1].T) - square * D[0]
    imaginary = first[1] + (mixed[0] - mixed[0].T) - square * D[1]
    lmis.psd(_embedded(D), margin=1.0, name="scaling")  # in no unit: D and G may be multiplied by any number
    lmis.nsd(_embedded((real, imaginary)), margin=1e-9, name="upper bound")
    return lmis


def _unknowns(lmis: Lmis, structure: Sequence[Uncertainty]) -> tuple[Pair, Pair]:
    parts: list[list[ca.SX]] = [[], [], [], []]
    for i, block in enumerate(structure):
        k, none = block.size, ca.SX(block.size, block.size)
        if block.kind == "full":
            entries = [lmis.scaled_identity(f"D{i}", k), none, none, none]
        else:
            entries = [*_hermitian(lmis, f"D{i}", k), none, none]
            if block.kind == "real":
                entries[2:] = _hermitian(lmis, f"G{i}", k)
        for part, entry in zip(parts, entries, strict=True):
            part.append(entry)
    real, imaginary, of_G, imaginary_of_G = (ca.diagcat(*part) for part in parts)
    return (real, imaginary), (of_G, imaginary_of_G)


def _hermitian(lmis: Lmis, name: str, size: int) -> Pair:
    real, imaginary = lmis.symmetric(name, size), ca.SX(size, size)
    if size > 1:
        above = lmis.rectangular(f"{name}i", size * (size - 1) // 2, 1)
        for number, (row, column) in enumerate(zip(*np.triu_indices(size, 1), strict=True)):
            imaginary[int(row), int(column)], imaginary[int(column), int(row)] = above[number], -above[number]
    return real, imaginary


def _embedded(pair: Pair) -> ca.SX:
    return ca.vertcat(ca.horzcat(pair[0], -pair[1]), ca.horzcat(pair[1], pair[0]))


def _scalings(answer: LmiAnswer, structure: Sequence[Uncertainty]) -> tuple[np.ndarray, np.ndarray]:
    """Return D and G as complex matrices."""
    from scipy.linalg import block_diag

    found: list[list[np.ndarray]] = []
    for letter in ("D", "G"):
        parts = []
        for i, block in enumerate(structure):
            part = np.zeros((block.size, block.size), dtype=complex)
            part += answer.unknowns.get(f"{letter}{i}", 0.0)
            if f"{letter}{i}i" in answer.unknowns:
                rows = np.triu_indices(block.size, 1)
                part[rows] += 1j * answer.unknowns[f"{letter}{i}i"].ravel()
                part[rows[1], rows[0]] -= 1j * answer.unknowns[f"{letter}{i}i"].ravel()
            parts.append(part)
        found.append(parts)
    D, G = (np.asarray(block_diag(*parts)) for parts in found)
    return D, G
