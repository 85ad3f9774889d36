"""Matrix inequalities from seeds, of which the answer is known without solving them.

============  ===================================================================================
kind          inequalities, and what is known
============  ===================================================================================
feasible      blocks affine in X, W, D and g, of which constants leave 0.3 I at a random point
infeasible    two such blocks, and minus a sum of congruences of both less 0.3 I: they cannot all hold
bounded_real  the smallest gain bound of a random stable system by the bounded-real lemma: its
              H-infinity norm, which needs no LMI
regulator     the largest P with A'P + PA + Q - P B B'P >= 0: the solution of the Riccati equation
============  ===================================================================================
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import casadi as ca
import numpy as np

from casadi_gnc.synthesis import Lmis, LmiStatus, block_matrix, h_infinity_norm
from casadi_gnc.synthesis.conic import ConicData

_MARGIN = 1e-3
#: Where something is minimised: more than solvers lose, less than moves the optimum by 1e-3.
_SMALL = 1e-6


@dataclass(frozen=True, eq=False)
class LmiSample:
    """Hold conic data, the verdict that is right, and the objective at the optimum (NaN if there is none).

    The margins move the optimum a little from `objective`, which knows none.
    """

    data: ConicData
    expected: LmiStatus
    objective: float = float("nan")


def lmi_samples(kind: str, seed: int, count: int, size: int) -> list[LmiSample]:
    """Return samples of a kind, the same for the same seed; `size` is the number of states."""
    make = _KINDS[kind]
    return [make(np.random.default_rng([seed, k]), size) for k in range(count)]


def _affine(rng: np.random.Generator, size: int, count: int) -> tuple[Lmis, list[ca.SX]]:
    """Return unknowns and symmetric expressions in them that leave 0.3 I at some point."""
    lmis = Lmis()
    X, W = lmis.symmetric("X", size), lmis.rectangular("W", 2, size)
    D, g = lmis.diagonal("D", 2), lmis.scalar("g")
    symbols = ca.vertcat(*ca.symvar(ca.vertcat(ca.vec(X), ca.vec(W), ca.vec(D), g)))
    point, blocks = ca.DM(rng.normal(size=symbols.numel())), []
    for _ in range(count):
        m = size + 1
        part = ca.SX(rng.normal(size=(m, size))) @ X @ rng.normal(size=(size, m)) + g * rng.normal(size=(m, m))
        part += ca.SX(rng.normal(size=(m, 2))) @ (W @ rng.normal(size=(size, m)) + D @ rng.normal(size=(2, m)))
        linear = (part + part.T) / 2
        there = np.array(ca.evalf(ca.substitute(linear, symbols, point)))
        root = rng.normal(size=(m, m))
        blocks.append(linear - there + root @ root.T + 0.3 * np.eye(m))
    return lmis, blocks


def _state(lmis: Lmis, blocks: list[ca.SX]) -> ConicData:
    for number, block in enumerate(blocks):
        lmis.psd((block + block.T) / 2, margin=_MARGIN, name=f"block {number}")
    return lmis.data()


def _feasible(rng: np.random.Generator, size: int) -> LmiSample:
    return LmiSample(_state(*_affine(rng, size, 3)), LmiStatus.CERTIFIED)


def _infeasible(rng: np.random.Generator, size: int) -> LmiSample:
    lmis, blocks = _affine(rng, size, 2)
    turned = [ca.SX(turn) @ block @ turn.T for block in blocks for turn in [rng.normal(size=(2, size + 1))]]
    return LmiSample(_state(lmis, [*blocks, -turned[0] - turned[1] - 0.3 * np.eye(2)]), LmiStatus.INFEASIBLE)


def _stable(rng: np.random.Generator, size: int) -> np.ndarray:
    A = rng.normal(size=(size, size))
    return A - (np.max(np.linalg.eigvals(A).real) + 0.5) * np.eye(size)


def _bounded_real(rng: np.random.Generator, size: int) -> LmiSample:
    A, B, C = _stable(rng, size), rng.normal(size=(size, 2)), rng.normal(size=(2, size))
    lmis = Lmis()
    P, g = lmis.symmetric("P", size), lmis.scalar("g")
    eye, zero = g * ca.SX.eye(2), np.zeros((2, 2))
    rows = [[A.T @ P + P @ A, P @ B, C.T], [-eye, zero], [-eye]]
    lmis.psd(P, margin=_SMALL, name="Lyapunov matrix")
    lmis.nsd(block_matrix(rows), margin=_SMALL, name="bounded real")
    lmis.minimize(g)
    return LmiSample(lmis.data(), LmiStatus.CERTIFIED, h_infinity_norm(A, B, C).upper)


def _regulator(rng: np.random.Generator, size: int) -> LmiSample:
    from scipy.linalg import solve_continuous_are

    A, B = rng.normal(size=(size, size)), rng.normal(size=(size, 2))
    lmis = Lmis()
    P = lmis.symmetric("P", size)
    lmis.psd(block_matrix([[A.T @ P + P @ A + np.eye(size), P @ B], [np.eye(2)]]), margin=_SMALL, name="Riccati")
    lmis.minimize(-ca.trace(P))
    optimum = -float(np.trace(solve_continuous_are(A, B, np.eye(size), np.eye(2))))
    return LmiSample(lmis.data(), LmiStatus.CERTIFIED, optimum)


_KINDS: dict[str, Callable[[np.random.Generator, int], LmiSample]] = {
    "feasible": _feasible,
    "infeasible": _infeasible,
    "bounded_real": _bounded_real,
    "regulator": _regulator,
}
