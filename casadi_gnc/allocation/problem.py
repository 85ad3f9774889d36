"""Robust control allocation as a min-max problem, and the certificate of any answer to it.

    minimise over lower <= F <= upper
        (F - Fs)'M1 (F - Fs) + (F - Fp)'M2 (F - Fp) + h max_v |u - (A + D_v E) F|^2

=========  ======================================================  ======================
symbol     meaning                                                 name in the code
=========  ======================================================  ======================
F, Fp      forces now and at the previous sample, (N,), [N]        forces, previous
Fs         preferred forces, often zero, (N,), [N]                 preferred
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

from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np

from casadi_gnc.errors import AllocationError
from casadi_gnc.mathematics.arrays import real_array
from casadi_gnc.mechanics.thrusters import ThrusterGeometry, corner_errors


@dataclass(frozen=True, eq=False)
class AllocationProblem:
    """Hold the data that stay the same from sample to sample; plain arrays are enough.

    Actuators may be thrusters [N], wheels [rad/s^2] or both; the units given here are for thrusters.

    Parameters
    ----------
    effectiveness : A, (R, N), effort per force, finite; rows are torque axes, or torque and force.
    lower, upper : (N,) or one number for all, amplitude bounds [N], lower <= upper. Equal bounds are
        a dead or stuck actuator.
    coupling : E, (P, N); left out for a problem without uncertainty.
    errors : D, (V, R, P), the vertices of the uncertainty.
    effort_weight, change_weight : diagonals of M1 and M2, (N,) or one number, non-negative. Where both are zero the
        forces would not be unique, and ``M1 = 1e-9 h |A|^2 I`` is minimised and certified; see `effort_weights`.
    accuracy_weight : h > 0.
    max_step : (N,) or one number, largest change of a force in one sample [N]; `inf` for none.
    preferred : Fs, (N,) or one number [N].

    Raises
    ------
    AllocationError
        Where a shape, a sign or a bound is wrong; the message names it.

    Examples
    --------
    >>> import numpy as np
    >>> problem = AllocationProblem(np.array([[1.0, -1.0]]), lower=0.0, upper=2.0)
    >>> problem.objective(np.array([1.0, 0.0]), command=np.array([1.0]), previous=np.zeros(2))
    2.0
    """

    effectiveness: np.ndarray
    lower: Any
    upper: Any
    coupling: Any = None
    errors: Any = None
    effort_weight: Any = 1.0
    change_weight: Any = 1.0
    accuracy_weight: float = 1e6
    max_step: Any = np.inf
    preferred: Any = 0.0

    def __post_init__(self) -> None:
        put = partial(object.__setattr__, self)
        put("effectiveness", _finite("effectiveness", self.effectiveness, 2))
        rows, count = self.effectiveness.shape
        if not rows or not count:
            raise AllocationError(f"effectiveness has shape {rows} x {count}; there is nothing to allocate")
        if (self.coupling is None) != (self.errors is None):
            raise AllocationError("coupling and errors describe the uncertainty together; give both or neither")
        put("coupling", np.zeros((0, count)) if self.coupling is None else _finite("coupling", self.coupling, 2))
        put("errors", np.zeros((1, rows, 0)) if self.errors is None else _finite("errors", self.errors, 3))
        errors, coupling = np.asarray(self.errors), np.asarray(self.coupling)
        if coupling.shape[1] != count or errors.shape != (len(errors), rows, len(coupling)) or not len(errors):
            raise AllocationError(
                f"errors has shape {errors.shape} and coupling {coupling.shape}; "
                f"expected (vertices, {rows}, P) and (P, {count})"
            )
        for name in ("lower", "upper", "effort_weight", "change_weight", "preferred"):
            put(name, _each(name, getattr(self, name), count))
        put("max_step", _each("max_step", self.max_step, count, finite=False))
        crossed = np.flatnonzero(self.lower > self.upper)
        if crossed.size:
            i = crossed[0]
            raise AllocationError(f"actuator {i + 1}: lower bound {self.lower[i]} exceeds upper {self.upper[i]}")
        for name in ("effort_weight", "change_weight", "max_step"):
            if np.any(getattr(self, name) < 0):
                raise AllocationError(f"{name} must not be negative; its least entry is {getattr(self, name).min()}")
        if not (np.isfinite(self.accuracy_weight) and self.accuracy_weight > 0):
            raise AllocationError(f"accuracy_weight is {self.accuracy_weight}, expected a positive number")

    @classmethod
    def of_thrusters(
        cls, geometry: ThrusterGeometry, rotation: Any, centre_error: tuple[Any, Any], **other: Any
    ) -> AllocationProblem:
        """Return the problem of thrusters whose common centre of mass is known within a box.

        Parameters
        ----------
        geometry : nominal positions and directions, combined frame.
        rotation : chaser frame -> combined frame, (3, 3).
        centre_error : lower and upper corner of the box of errors, (3,) each, chaser frame [m].
        other : further arguments of the class: bounds, weights.
        """
        return cls(
            effectiveness=np.array(geometry.effectiveness),
            coupling=np.array(geometry.directions),
            errors=corner_errors(rotation, list(centre_error[0]), list(centre_error[1])),
            **other,
        )

    @property
    def count(self) -> int:
        """N, number of actuators."""
        return self.effectiveness.shape[1]

    @property
    def is_robust(self) -> bool:
        """Whether there is any uncertainty."""
        return bool(np.any(self.errors) and np.any(self.coupling))

    def box(self, previous: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the bounds of this sample: amplitude and rate; the amplitude wins where they clash."""
        lower = np.clip(previous - self.max_step, self.lower, self.upper)
        upper = np.clip(previous + self.max_step, self.lower, self.upper)
        return lower, upper

    @cached_property
    def full_effort(self) -> float:
        """Norm of the effort that the actuators could make at most, in its unit."""
        reach = np.maximum(np.abs(self.lower), np.abs(self.upper))
        return float(np.linalg.norm(self.effectiveness * reach, 2))

    @cached_property
    def vertices(self) -> np.ndarray:
        """Effectiveness at every vertex, (V, R, N)."""
        return self.effectiveness + np.einsum("vrp,pn->vrn", self.errors, self.coupling)

    @cached_property
    def effort_weights(self) -> np.ndarray:
        """M1 as it is minimised and certified, (N,): the one given, or ``1e-9 h |A|^2`` where M1 = M2 = 0.

        Without any weight the forces are not unique; the on-board solver adds the same.
        """
        if np.any(self.effort_weight) or np.any(self.change_weight):
            return self.effort_weight
        return np.full(self.count, 1e-9 * self.accuracy_weight * float(np.sum(self.effectiveness**2)))

    @cached_property
    def _long_vertices(self) -> np.ndarray:
        long = np.longdouble
        return self.effectiveness.astype(long) + np.einsum(
            "vrp,pn->vrn", self.errors.astype(long), self.coupling.astype(long)
        )

    def missing(self, forces: np.ndarray, command: np.ndarray) -> np.ndarray:
        """Return u - (A + D_v E) F for every vertex, (V, R): summed in long doubles, because it cancels."""
        made = np.einsum("vrn,n->vr", self._long_vertices, np.asarray(forces, dtype=np.longdouble))
        return (command - made).astype(float)

    def vertex_costs(self, forces: np.ndarray, command: np.ndarray) -> np.ndarray:
        """Return ``h |u - (A + D_v E) F|^2`` for every vertex, (V,)."""
        missing = self.missing(forces, command)
        return self.accuracy_weight * np.einsum("vr,vr->v", missing, missing)

    def objective(self, forces: np.ndarray, command: np.ndarray, previous: np.ndarray) -> float:
        """Return the cost of `forces`."""
        effort = self.effort_weights @ (forces - self.preferred) ** 2
        effort += self.change_weight @ (forces - previous) ** 2
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
        missing = self.missing(forces, command)
        gradient = -2 * self.accuracy_weight * np.einsum("v,vrn,vr->n", lam, self.vertices, missing)
        gradient += 2 * self.effort_weights * (forces - self.preferred)
        gradient += 2 * self.change_weight * (forces - previous)
        curvature = 2 * (self.effort_weights + self.change_weight)
        down, up = lower - forces, upper - forces
        with np.errstate(divide="ignore", invalid="ignore"):
            free = np.where(curvature > 0, -gradient / curvature, np.where(gradient > 0, -np.inf, np.inf))
        step = np.clip(free, down, up)
        decrease = gradient * step + curvature * step**2 / 2
        return float(costs.max() - lam @ costs - decrease.sum())


def _finite(name: str, value: Any, dimensions: int) -> np.ndarray:
    array = real_array(name, value, AllocationError)
    if array.ndim != dimensions or not np.all(np.isfinite(array)):
        raise AllocationError(f"{name} has shape {array.shape}, expected {dimensions} dimensions of finite numbers")
    return array


def _each(name: str, value: Any, count: int, *, finite: bool = True) -> np.ndarray:
    array = real_array(name, value, AllocationError)
    if array.ndim == 0:
        array = np.full(count, float(array))
    good = np.isfinite(array) if finite else ~np.isnan(array)
    if array.shape != (count,) or not np.all(good):
        kind = "finite numbers" if finite else "numbers"
        raise AllocationError(f"{name} has shape {array.shape}, expected {count} {kind} or one for all")
    return array
