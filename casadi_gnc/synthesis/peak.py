"""The largest control a linear loop commands from a set of starts, by simulation from its vertices.

The command u(t) = C exp(A t) x0 is linear in x0 and a norm is convex, so the worst start of a polytope
is a vertex. The exponential is exact; between samples h apart u leaves the chord, on which |u| is at most
that of an end, by h^2/8 max |u''|. Lyapunov's function bounds |u''| on the way and the tail of |u|.
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
    from scipy.linalg import expm, solve_continuous_lyapunov

    A, C, vertices = matrices(A=A, C=C, vertices=vertices)
    fits("A", A, len(A), len(A))
    fits("C", C, len(C), len(A))
    fits("vertices", vertices, len(vertices), len(A))
    values = poles(A)
    if values[0].real >= 0:
        raise SynthesisError(f"the loop has the pole {values[0]:.3g}; only of a stable one the command has a peak")
    horizon = 12 / abs(values[0].real)
    step = min(horizon / _SAMPLES, 0.02 / np.max(np.abs(values)))
    advance, states = expm(A * step), vertices.T.copy()
    P = solve_continuous_lyapunov(A.T, -np.eye(len(A)))
    root = np.linalg.inv(np.linalg.cholesky((P + P.T) / 2))  # |C x| <= |C root'| sqrt(x'Px)
    reach, curve = np.linalg.norm(C @ root.T, 2), np.linalg.norm(C @ A @ A @ root.T, 2)
    best, bound, where, when, t = 0.0, 0.0, 0, 0.0, 0.0
    previous, energy = None, np.zeros(len(vertices))
    for _ in range(min(200_000, 2 + int(np.ceil(horizon / step)))):
        commands = C @ states
        size = np.max(np.abs(commands), axis=0) if per_channel else np.linalg.norm(commands, axis=0)
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
