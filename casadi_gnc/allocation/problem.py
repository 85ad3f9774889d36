"""Robust control allocation as a min-max problem, and the certificate of any answer to it.

    minimise over lower <= F <= upper
        F'M1 F + (F - Fp)'M2 (F - Fp) + h max_v |u - (A + D_v E) F|^2

=========  ======================================================  ======================
symbol     meaning                                                 name in the code
=========  ======================================================  ======================
F, Fp      forces now and at the previous sample, (N,), [N]        forces, previous
u          wanted effort, (R,), [N m]                              command
A          nominal effectiveness, (R, N), [m]                      effectiveness
E          what the errors act on, (P, N): net force               coupling
D_v        error at vertex v, (V, R, P), [m]                       errors
M1, M2     effort and change weights, diagonals, (N,)              effort_weight, change_weight
h          weight of the effort error                              accuracy_weight
=========  ======================================================  ======================

The error enters linearly, the cost is convex in it, so the corners of its box decide.

**Certificate.** For any F in the box and any weights lambda on the simplex of vertices, the
lambda-weighted cost is a lower model of the max and has curvature at least q = 2 (M1 + M2). With
its gradient g at F,

    f(F) - f* <= max_v c_v - sum lambda_v c_v - sum_i min_d (g_i d + q_i d^2/2),

where c_v is the vertex cost and d runs over what the box leaves. No solver's word is needed.

Source: Huang, Biggs, Duan (2020), eqs (57)-(62), doi:10.1016/j.ast.2019.105572.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from casadi_gnc.errors import AllocationError


@dataclass(frozen=True, eq=False)
class AllocationProblem:
    """Hold the data that stay the same from sample to sample.

    Parameters
    ----------
    effectiveness : (R, N), finite.
    coupling : (P, N); (0, N) for a problem without uncertainty.
    errors : (V, R, P), V >= 1.
    lower, upper : (N,), amplitude bounds, lower <= upper.
    effort_weight, change_weight : (N,), non-negative.
    accuracy_weight : h > 0.

    Raises
    ------
    AllocationError
        Where a shape, a sign or a bound is wrong; the message names it.
    """

    effectiveness: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    coupling: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    errors: np.ndarray = field(default_factory=lambda: np.zeros((1, 0, 0)))
    effort_weight: np.ndarray = field(default_factory=lambda: np.ones(1))
    change_weight: np.ndarray = field(default_factory=lambda: np.ones(1))
    accuracy_weight: float = 1e6

    def __post_init__(self) -> None:
        rows, count = _matrix("effectiveness", self.effectiveness)
        if not self.coupling.size:
            object.__setattr__(self, "coupling", np.zeros((0, count)))
            object.__setattr__(self, "errors", np.zeros((1, rows, 0)))
        for name in ("lower", "upper", "effort_weight", "change_weight"):
            value = np.asarray(getattr(self, name), dtype=float)
            value = np.full(count, value.reshape(-1)[0]) if value.size == 1 else value
            if value.shape != (count,) or not np.all(np.isfinite(value)):
                raise AllocationError(f"{name} has shape {value.shape}, expected {count} finite numbers")
            object.__setattr__(self, name, value)
        expected = (self.errors.shape[0], rows, self.coupling.shape[0])
        if self.coupling.shape[1] != count or self.errors.shape != expected or not expected[0]:
            raise AllocationError(
                f"errors has shape {self.errors.shape} and coupling {self.coupling.shape}; "
                f"expected (vertices, {rows}, P) and (P, {count})"
            )
        crossed = np.flatnonzero(self.lower > self.upper)
        if crossed.size:
            i = crossed[0]
            raise AllocationError(f"actuator {i + 1}: lower bound {self.lower[i]} exceeds upper {self.upper[i]}")
        if np.any(self.effort_weight < 0) or np.any(self.change_weight < 0):
            raise AllocationError("effort and change weights must not be negative")
        if not self.accuracy_weight > 0:
            raise AllocationError(f"accuracy_weight is {self.accuracy_weight}, expected a positive number")

    @cached_property
    def vertices(self) -> np.ndarray:
        """Effectiveness at every vertex, (V, R, N)."""
        return self.effectiveness + np.einsum("vrp,pn->vrn", self.errors, self.coupling)

    def vertex_costs(self, forces: np.ndarray, command: np.ndarray) -> np.ndarray:
        """Return h |u - (A + D_v E) F|^2 for every vertex, (V,)."""
        missing = command - self.vertices @ forces
        return self.accuracy_weight * np.einsum("vr,vr->v", missing, missing)

    def objective(self, forces: np.ndarray, command: np.ndarray, previous: np.ndarray) -> float:
        """Return the cost of `forces`."""
        effort = self.effort_weight @ forces**2 + self.change_weight @ (forces - previous) ** 2
        return float(effort + self.vertex_costs(forces, command).max())

    def gap(
        self,
        forces: np.ndarray,
        weights: np.ndarray,
        command: np.ndarray,
        previous: np.ndarray,
        lower: np.ndarray,
        upper: np.ndarray,
    ) -> float:
        """Return a rigorous bound on how far `forces` are from optimal in cost.

        Parameters
        ----------
        forces : (N,), inside the box.
        weights : (V,), any numbers; they are projected to the simplex by clipping and scaling.
        """
        lam = np.maximum(weights, 0.0)
        lam = lam / lam.sum() if lam.sum() > 0 else np.full(len(lam), 1 / len(lam))
        costs = self.vertex_costs(forces, command)
        missing = command - self.vertices @ forces
        gradient = -2 * self.accuracy_weight * np.einsum("v,vrn,vr->n", lam, self.vertices, missing)
        gradient += 2 * self.effort_weight * forces + 2 * self.change_weight * (forces - previous)
        curvature = 2 * (self.effort_weight + self.change_weight)
        down, up = lower - forces, upper - forces
        with np.errstate(divide="ignore", invalid="ignore"):
            free = np.where(curvature > 0, -gradient / curvature, np.where(gradient > 0, -np.inf, np.inf))
        step = np.clip(free, down, up)
        decrease = gradient * step + curvature * step**2 / 2
        return float(costs.max() - lam @ costs - decrease.sum())


def _matrix(name: str, value: np.ndarray) -> tuple[int, int]:
    if value.ndim != 2 or 0 in value.shape or not np.all(np.isfinite(value)):
        raise AllocationError(f"{name} has shape {value.shape}, expected a finite matrix (rows, actuators)")
    return value.shape
