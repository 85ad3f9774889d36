"""The largest control a linear loop commands from a set of starts, by simulation from its vertices.

The command u(t) = C exp(A t) x0 is linear in x0 and a norm is convex, so the worst start of a polytope
is a vertex. The exponential is exact; between samples h apart u leaves the chord, on which |u| is at most
that of an end, by h^2/8 max |u''|. Lyapunov's function bounds |u''| on the way and the tail of |u|. Where poles are
so many decades apart that it has none to rounding, or that steps of the fastest never reach the end, the sum over the
modes of their sizes does: each of them decays by itself, and steps grow as the fast ones end.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from casadi_gnc.errors import SynthesisError
from casadi_gnc.mathematics.arrays import real_array
from casadi_gnc.synthesis.analysis import fits, matrices, poles

_SAMPLES = 4000  # along the horizon
_LONGEST = 200_000  # steps
_LEAN = 1e10  # condition of the modes from which their sum says nothing
_BEND = 1e-3  # of the largest command: what may lie between two samples, where steps grow
_MOST = 12  # uncertain states of a box: 2^12 vertices


@dataclass(frozen=True, eq=False)
class Peak:
    """Hold a peak of the command.

    Parameters
    ----------
    value : largest sample. bound : no command is larger, between samples and after the horizon too.
    start : (n,), the worst vertex. time_s : when.
    """

    value: float
    bound: float
    start: np.ndarray
    time_s: float


def box_vertices(lower: Any, upper: Any) -> np.ndarray:
    """Return the vertices, (V, n), of a box; sides of length zero are not doubled."""
    low, high = real_array("lower", lower, SynthesisError), real_array("upper", upper, SynthesisError)
    if low.shape != high.shape or low.ndim != 1 or not np.all(low <= high):
        raise SynthesisError(f"a box has bounds of one length, lower below upper; got {low} and {high}")
    if np.sum(low < high) > _MOST:
        raise SynthesisError(f"a box with {np.sum(low < high)} uncertain states has too many vertices; at most {_MOST}")
    sides = [(a,) if a == b else (a, b) for a, b in zip(low.tolist(), high.tolist(), strict=True)]
    return np.array(list(product(*sides)))


def peak_command(A: Any, C: Any, vertices: Any, *, per_channel: bool = False) -> Peak:
    """Return the largest command C x of x' = A x from any start in the hull of the vertices.

    Parameters
    ----------
    A : (n, n), Hurwitz, [1/s]. C : (m, n), from state to command.
    vertices : (V, n), starts.
    per_channel : largest channel instead of the Euclidean norm.

    Raises
    ------
    SynthesisError
        For wrong shapes or an unstable A.
    """
    A, C, vertices = matrices(A=A, C=C, vertices=vertices)
    fits("A", A, len(A), len(A))
    fits("C", C, len(C), len(A))
    fits("vertices", vertices, len(vertices), len(A))
    values = poles(A)
    if values[0].real >= 0:
        raise SynthesisError(f"the loop has the pole {values[0]:.3g}; only of a stable one the command has a peak")
    unit = float(np.max(np.abs(vertices), initial=0.0)) or 1.0  # squares of huge starts are no numbers
    found = _peak(A, C, vertices / unit, values, per_channel)
    return Peak(found.value * unit, found.bound * unit, found.start * unit, found.time_s)


def _peak(A: np.ndarray, C: np.ndarray, vertices: np.ndarray, values: np.ndarray, per_channel: bool) -> Peak:
    """Return the peak for starts near one; `values` are the poles."""
    from scipy.linalg import expm, solve_continuous_lyapunov

    horizon = 12 / abs(values[0].real)
    step = min(horizon / _SAMPLES, 0.02 / np.max(np.abs(values)))
    P = solve_continuous_lyapunov(A.T, -np.eye(len(A))) if horizon <= _LONGEST * step else np.full_like(A, np.nan)
    try:
        root = np.linalg.inv(np.linalg.cholesky((P + P.T) / 2))  # |C x| <= |C root'| sqrt(x'Px)
        reach, curve = np.linalg.norm(C @ root.T, 2), np.linalg.norm(C @ A @ A @ root.T, 2)
    except np.linalg.LinAlgError:
        reach = curve = np.inf
    if not np.isfinite(reach + curve):
        return _by_modes(A, C, vertices, horizon, per_channel)
    advance, states = expm(A * step), vertices.T.copy()
    best, bound, where, when, t = 0.0, 0.0, 0, 0.0, 0.0
    previous, energy = None, np.zeros(len(vertices))
    for _ in range(2 + int(np.ceil(horizon / step))):
        commands = C @ states
        size = _sizes(commands, per_channel)
        energy = np.sqrt(np.maximum(np.einsum("iv,ij,jv->v", states, P, states), 0.0))
        if previous is not None:  # energy falls, so its old value bounds the curve on the way
            bound = max(bound, float(np.max(np.maximum(previous[0], size) + step**2 / 8 * curve * previous[1])))
        if size.max() > best:
            best, where, when = float(size.max()), int(np.argmax(size)), t
        if reach * energy.max() <= best:  # whatever comes is smaller
            break
        previous, states, t = (size, energy), advance @ states, t + step
    bound = max(bound, reach * float(energy.max())) if reach * energy.max() > bound else bound
    return Peak(best, float(bound), vertices[where], float(when))


def _sizes(commands: np.ndarray, per_channel: bool) -> np.ndarray:
    return np.max(np.abs(commands), axis=0) if per_channel else np.linalg.norm(commands, axis=0)


def _by_modes(A: np.ndarray, C: np.ndarray, vertices: np.ndarray, horizon: float, per_channel: bool) -> Peak:
    """Return the peak by the modes exp(lambda t) of the loop; without a bound where they are nearly dependent."""
    values, vectors = np.linalg.eig(A)
    condition, shapes = float(np.linalg.cond(vectors)), C @ vectors
    if not condition < _LEAN:
        sizes = _sizes(C @ vertices.T, per_channel)
        return Peak(float(sizes.max()), np.inf, vertices[int(np.argmax(sizes))], 0.0)
    begun, weight = np.linalg.solve(vectors, vertices.T.astype(complex)), np.linalg.norm(shapes, axis=0)
    doubt = len(A) * np.finfo(float).eps * condition * float(np.max(weight @ np.abs(begun)))
    best, bound, where, when, t, step, curve = 0.0, 0.0, 0, 0.0, 0.0, 0.0, 0.0
    tail, previous = np.inf, np.zeros(len(vertices))
    for _ in range(_LONGEST):
        modes = begun * np.exp(values * t)[:, None]
        size = _sizes((shapes @ modes).real, per_channel)
        bound = max(bound, float(np.max(np.maximum(previous, size))) + step**2 / 8 * curve)
        if size.max() > best:
            best, where, when = float(size.max()), int(np.argmax(size)), t
        tail = float(np.max(weight @ np.abs(modes)))
        if tail <= best or t > horizon:
            break
        curve = float(np.max((weight * np.abs(values) ** 2) @ np.abs(modes)))
        previous = size
        # The first command may be zero: until there is one the curve, or the modes' sum, is the measure.
        step = float(np.sqrt(8 * _BEND * max(best, _BEND * tail) / curve))
        t += step
    return Peak(best, max(bound, tail) + doubt, vertices[where], float(when))
