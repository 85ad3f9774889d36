"""What a closed loop really does, from its matrices alone: poles, H-infinity norm, tolerated ratio.

The norm: for a stable A and gamma above the largest singular value of D, the norm of
G(s) = C (sI - A)^-1 B + D is below gamma if and only if the Hamiltonian

    H = [A + B R^-1 D'C,  B R^-1 B';  -C'(I + D R^-1 D')C,  -(A + B R^-1 D'C)'],   R = gamma^2 I - D'D

has no eigenvalue on the imaginary axis. Those that it has are the frequencies where a singular value of
G crosses gamma: the largest singular value between two of them is a better lower bound
(N. A. Bruinsma, M. Steinbuch, 1990, doi:10.1016/0167-6911(90)90049-Z).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from casadi_gnc.errors import SynthesisError
from casadi_gnc.mathematics.arrays import real_array


@dataclass(frozen=True)
class Norm:
    """Hold an H-infinity norm.

    Parameters
    ----------
    lower : a singular value that is attained; upper : the bound by the Hamiltonian.
    frequency_rad_s : where the lower bound is attained; may be infinite.
    """

    lower: float
    upper: float
    frequency_rad_s: float


def matrices(**given: Any) -> list[np.ndarray]:
    """Return matrices as finite two-dimensional arrays; raise `SynthesisError` with the name of one that is none."""
    found = []
    for name, value in given.items():
        matrix = real_array(name, value, SynthesisError)
        if matrix.ndim != 2 or not np.all(np.isfinite(matrix)):
            raise SynthesisError(f"{name} has shape {matrix.shape}, expected a matrix of finite numbers")
        found.append(matrix)
    return found


def fits(name: str, matrix: np.ndarray, rows: int, columns: int) -> None:
    """Raise `SynthesisError` if a matrix has not the shape expected."""
    if matrix.shape != (rows, columns):
        raise SynthesisError(f"{name} has shape {matrix.shape}, expected ({rows}, {columns})")


def system(A: Any, B: Any, C: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the matrices of a system; raise `SynthesisError` where their shapes do not fit each other."""
    A, B, C = matrices(A=A, B=B, C=C)
    fits("A", A, len(A), len(A))
    fits("B", B, len(A), B.shape[1])
    fits("C", C, len(C), len(A))
    return A, B, C


def poles(A: np.ndarray) -> np.ndarray:
    """Return the eigenvalues of A, (n,), [rad/s], the slowest first."""
    values = np.linalg.eigvals(A)
    return values[np.argsort(-values.real)]


def gain_at(A: np.ndarray, B: np.ndarray, C: np.ndarray, D: np.ndarray, frequency_rad_s: float) -> float:
    """Return the largest singular value of G at a frequency."""
    if np.isinf(frequency_rad_s):
        return float(np.linalg.norm(D, 2))
    return float(np.linalg.norm(C @ np.linalg.solve(1j * frequency_rad_s * np.eye(len(A)) - A, B) + D, 2))


def h_infinity_norm(A: Any, B: Any, C: Any, D: Any = None, *, relative: float = 1e-9) -> Norm:
    """Return the H-infinity norm of C (sI - A)^-1 B + D between two bounds.

    Parameters
    ----------
    A : (n, n), Hurwitz. B : (n, m). C : (p, n). D : (p, m), zero by default.
    relative : wanted distance of the bounds.

    Raises
    ------
    SynthesisError
        For wrong shapes. An unstable A has the norm infinity.

    Examples
    --------
    >>> round(h_infinity_norm([[-2.0]], [[1.0]], [[3.0]]).upper, 6)
    1.5
    """
    A, B, C = system(A, B, C)
    (D,) = matrices(D=np.zeros((len(C), B.shape[1])) if D is None else D)
    fits("D", D, len(C), B.shape[1])
    values = np.linalg.eigvals(A)
    if values.real.max(initial=-1.0) >= 0:
        return Norm(np.inf, np.inf, float(abs(values[np.argmax(values.real)].imag)))
    starts = np.unique(np.concatenate([[0.0, np.inf], np.abs(values), np.abs(values.imag)]))
    gains = [gain_at(A, B, C, D, w) for w in starts]
    lower, frequency = max(gains), float(starts[int(np.argmax(gains))])
    if lower == 0.0:
        return Norm(0.0, 0.0, 0.0)
    for _ in range(60):
        upper = (1 + 2 * relative) * lower
        crossings = _crossings(A, B, C, D, upper)
        middles = (crossings[1:] + crossings[:-1]) / 2
        better = [(gain_at(A, B, C, D, w), float(w)) for w in np.concatenate([crossings, middles])]
        best, where = max(better, default=(0.0, 0.0))
        if best <= upper:
            return Norm(lower, upper, frequency)
        lower, frequency = best, where
    return Norm(lower, np.inf, frequency)


def _crossings(A: np.ndarray, B: np.ndarray, C: np.ndarray, D: np.ndarray, gamma: float) -> np.ndarray:
    """Return the frequencies, sorted, at which eigenvalues of the Hamiltonian lie on the axis, to rounding.

    Rounding moves a double eigenvalue by the root of its size: those nearer than that are taken as
    crossings too, and the caller evaluates the gain there.
    """
    R = gamma**2 * np.eye(B.shape[1]) - D.T @ D
    inner = A + B @ np.linalg.solve(R, D.T @ C)
    corner = C.T @ (np.eye(len(C)) + D @ np.linalg.solve(R, D.T)) @ C
    top, balance = B @ np.linalg.solve(R, B.T), 1.0
    if np.any(top) and np.any(corner):
        balance = np.sqrt(np.linalg.norm(corner) / np.linalg.norm(top))
    values = np.linalg.eigvals(np.block([[inner, balance * top], [-corner / balance, -inner.T]]))
    near = np.abs(values.real) <= 1e-6 * np.maximum(np.abs(values), 1e-3 * np.max(np.abs(values)))
    return np.unique(np.abs(values[near].imag))


def stable_ratios(fixed: Any, scaled: Any, *, around: float = 1.0) -> tuple[float, float]:
    """Return the interval of ratios r about a stable one for which fixed + r scaled is Hurwitz.

    Use it for a loop whose input matrix is multiplied by (assumed mass) / (true mass).

    Parameters
    ----------
    fixed, scaled : (n, n), the parts of the closed loop's matrix.
    around : a ratio, positive, at which the loop is stable.

    Notes
    -----
    At an end of the interval two eigenvalues add up to zero, so the Lyapunov operator
    X -> A X + X A' on symmetric X is singular: the ends are among its eigenvalues, and between two of
    those the loop is stable everywhere or nowhere, so one ratio there tells.

    Examples
    --------
    >>> low, high = stable_ratios([[1.0]], [[-2.0]])
    >>> round(low, 9), high
    (0.5, inf)
    """
    fixed, scaled = matrices(fixed=fixed, scaled=scaled)
    fits("fixed", fixed, len(fixed), len(fixed))
    fits("scaled", scaled, *fixed.shape)
    middle = _lyapunov(fixed + around * scaled)

    def stable(ratio: float) -> bool:
        return bool(poles(fixed + ratio * scaled)[0].real < 0)

    if not stable(around):
        raise SynthesisError(f"the loop is unstable at the ratio {around:g}; start from a ratio where it is stable")
    inverse = np.linalg.eigvals(-np.linalg.solve(middle, _lyapunov(scaled)))
    size = np.max(np.abs(inverse), initial=0.0)
    real = inverse[(np.abs(inverse.imag) <= 1e-7 * size) & (np.abs(inverse) > 1e-12 * size)].real
    steps, found = 1 / real, []
    for sign in (-1.0, 1.0):
        lengths = np.sort(np.abs(steps[np.sign(steps) == sign]))
        beyond = np.append((lengths[1:] + lengths[:-1]) / 2, 2 * lengths[-1:])
        left = (end for end, there in zip(lengths, beyond, strict=True) if not stable(around + sign * there))
        found.append(around + sign * float(next(left, np.inf)))
    return found[0], found[1]


def _lyapunov(A: np.ndarray) -> np.ndarray:
    """Return X -> A X + X A' on the triangles of symmetric matrices."""
    row, column = np.tril_indices(len(A))
    images = []
    for i, j in zip(row, column, strict=True):
        unit = np.zeros_like(A)
        unit[i, j] = unit[j, i] = 1.0
        images.append((A @ unit + unit @ A.T)[row, column])
    return np.array(images).T
