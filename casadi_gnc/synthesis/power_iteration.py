"""Perturbations of a structure that make a loop singular, sought by a power iteration.

P. M. Young, J. C. Doyle, 1990, doi:10.1109/CDC.1990.203817: b = Q a, z = Q* w for a perturbation Q of size at most
one, M b = beta a and M* z = beta w. It need not converge, and with real blocks it often does not. So every Q on the
way is judged, and from some of them t is maximised subject to det(t I - M Q) = 0 by sequential quadratic programming.
Where M Q has an eigenvalue r, real or, where no block is real, of any phase, Q/r makes I - M Delta singular.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

_STEPS = 60
_CLIMBS = 6  # starts from which t is maximised
_REAL = 1e-9  # of an eigenvalue: how large an imaginary part rounding may leave
_SINGULAR = 1e-8  # smallest singular value of I - M Delta that counts as zero


def perturbation_of(M: np.ndarray, structure: Sequence[Any], starts: int) -> tuple[float, np.ndarray | None]:
    """Return a lower bound on mu of M, (n, n), complex, and the perturbation that attains it; 0 and None without one.

    Parameters
    ----------
    structure : blocks with a `kind` and a `size`, see `casadi_gnc.synthesis.structured.Uncertainty`.
    starts : from fixed seeds.
    """
    places, start = [], 0
    for block in structure:
        places.append((block.kind, slice(start, start + block.size)))
        start += block.size
    is_real = any(kind == "real" for kind, _ in places)
    best, found = 0.0, None
    begun = []
    for seed in range(starts):
        own, here = -1.0, np.zeros_like(M)
        for Q in _passed(M, places, seed):
            value, phase = _singular(M @ Q, is_real)
            if value >= own:  # zero too: where none is singular, the last
                own, here = value, phase * Q
        begun.append(here)
        if own > best:
            best, found = own, here
    for Q in ([] if found is None else [found]) + begun[:_CLIMBS]:
        Q = _climbed(M, places, Q)
        value, phase = _singular(M @ Q, is_real)
        if value > best:
            best, found = value, phase * Q
    if found is None or not np.linalg.svd(np.eye(len(M)) - M @ found / best)[1][-1] <= _SINGULAR:
        return 0.0, None
    return best, found / best


def _passed(M: np.ndarray, places: Sequence[Any], seed: int) -> Iterator[np.ndarray]:
    """Yield the perturbations, (n, n), of size at most one, that the iteration passes from a start."""
    rng = np.random.default_rng(seed)
    b = _unit(rng.normal(size=len(M)) + 1j * rng.normal(size=len(M)))
    w, q = b, np.sign(rng.normal(size=len(places)))
    for _ in range(_STEPS):
        a = _unit(M @ b)
        q = _shares(places, a, b, w, q)
        w = _unit(M.conj().T @ _aligned(places, w, a, q))
        q = _shares(places, a, b, w, q)
        b = _aligned(places, a, w, q)
        yield _perturbation(places, a, b, w, q)
        if not np.any(b):
            return


def _climbed(M: np.ndarray, places: Sequence[Any], Q: np.ndarray) -> np.ndarray:
    """Return a perturbation from a start with a locally largest t for which t I - M Q is singular."""
    from scipy.optimize import minimize

    size = max(float(np.linalg.norm(M, 2)), 1e-300)
    parts, widths = [], []
    for kind, at in places:
        block = Q[at, at]
        if kind == "real":
            part = np.array([block[0, 0].real])
        elif kind == "complex":
            part = np.array([np.angle(block[0, 0])])
        else:
            left, _, right = np.linalg.svd(block)
            part = np.concatenate([np.real(left[:, 0]), np.imag(left[:, 0]), np.real(right[0]), np.imag(right[0])])
        parts.append(part)
        widths.append(len(part))
    splits = np.cumsum(widths)[:-1]

    def built(x: np.ndarray) -> np.ndarray:
        made = np.zeros_like(Q)
        for (kind, at), part in zip(places, np.split(x[1:], splits), strict=True):
            if kind == "full":
                a, b, c, d = np.split(part, 4)
                made[at, at] = np.outer(_unit(a + 1j * b), _unit(c + 1j * d))
            else:
                value = part[0] if kind == "real" else np.exp(1j * part[0])
                made[at, at] = value * np.eye(at.stop - at.start)
        return made

    def lacking(x: np.ndarray) -> np.ndarray:
        value = np.linalg.det(x[0] * np.eye(len(M)) - M @ built(x) / size)
        return np.array([value.real, value.imag])

    bounds = [(0.0, 1.0)]
    for (kind, _), width in zip(places, widths, strict=True):
        bounds += [(-1.0, 1.0) if kind == "real" else (None, None)] * width
    values = np.linalg.eigvals(M @ Q / size)
    start = np.concatenate([[float(np.max(np.abs(values)))], *parts])
    done = minimize(
        lambda x: -x[0],
        start,
        method="SLSQP",
        bounds=bounds,
        constraints={"type": "eq", "fun": lacking},
        options={"maxiter": 80, "ftol": 1e-13},
    )
    return built(np.clip(done.x, [-np.inf if low is None else low for low, _ in bounds], np.inf))


def _unit(vector: np.ndarray) -> np.ndarray:
    length = np.linalg.norm(vector)
    return vector / length if length > 0 else vector


def _phase(number: Any) -> complex:
    return complex(number / abs(number)) if abs(number) > 0 else 1.0 + 0j


def _share(q: float, a: np.ndarray, b: np.ndarray, w: np.ndarray) -> float:
    """Return the next value of a real block, between -1 and 1."""
    length = np.linalg.norm(a)
    alpha = np.sign(q) * np.linalg.norm(b) / length + np.real(np.vdot(a, w)) if length > 0 else np.sign(q)
    return float(np.clip(alpha, -1.0, 1.0))


def _shares(places: Sequence[Any], a: np.ndarray, b: np.ndarray, w: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Return the next values of the real blocks; those of the others stay."""
    q = q.copy()
    for i, (kind, at) in enumerate(places):
        if kind == "real":
            q[i] = _share(q[i], a[at], b[at], w[at])
    return q


def _aligned(places: Sequence[Any], this: np.ndarray, other: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Return, block by block, what a perturbation of size one makes of `this` that is nearest to `other`."""
    found = np.zeros_like(this)
    for i, (kind, at) in enumerate(places):
        if kind == "real":
            found[at] = q[i] * this[at]
        elif kind == "complex":
            found[at] = _phase(np.vdot(this[at], other[at])) * this[at]
        else:
            found[at] = np.linalg.norm(this[at]) * _unit(other[at])
    return found


def _perturbation(places: Sequence[Any], a: np.ndarray, b: np.ndarray, w: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Return Q with b = Q a, block by block, of size one where it is not a real number."""
    Q = np.zeros((len(a), len(a)), dtype=complex)
    for i, (kind, at) in enumerate(places):
        if kind == "real":
            Q[at, at] = q[i] * np.eye(at.stop - at.start)
        elif kind == "complex":
            Q[at, at] = _phase(np.vdot(a[at], w[at])) * np.eye(at.stop - at.start)
        else:
            Q[at, at] = np.outer(_unit(b[at]), _unit(a[at]).conj())
    return Q


def _singular(loop: np.ndarray, is_real: bool) -> tuple[float, complex]:
    """Return the largest eigenvalue that a factor of modulus one, a sign if a block is real, turns to the real axis."""
    values = np.linalg.eigvals(loop)
    if is_real:
        values = values[np.abs(values.imag) <= _REAL * np.abs(values)].real
    if not len(values):
        return 0.0, 1.0
    largest = values[np.argmax(np.abs(values))]
    return float(abs(largest)), _phase(complex(largest)).conjugate()
