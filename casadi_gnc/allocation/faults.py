"""Actuators that are dead, stuck or degraded, and whether a fault can turn the loop around.

* Dead or stuck: the bounds meet, nothing else changes (`with_faults`).
* Degraded within an interval: actuator i makes g_i times its force, low_i <= g_i <= high_i. Its
  nominal column is scaled by the middle of the interval, and each uncertain actuator adds one row
  e_i' to E. With D_c the error of the geometry at corner c and delta_i = +- half the interval,

      dA F = D_c E' F + sum_i delta_i (a_i + D_c E_i) F_i,      E' the scaled coupling,

  so the corners of geometry and effectiveness multiply. The residual is affine in each factor alone
  and its square convex, hence the corners of the product bound it.

Minimising against errors of the mass centre alone lets actuators oppose each other; losing one of
them can then push the wrong way. `worst_alignment` looks for that: over vertices v and directions d
it computes the share of effort that really points along d,

    alignment = min_v min_d  d'(A + D_v E) F(r d) / r,

which is the smallest eigenvalue of the symmetric torque map where the map is linear. A negative
value is positive feedback in some direction (Huang and Duan 2019, doi:10.1109/ACCESS.2019.2949285,
whose robust allocation loses its loop to wheel faults that the pseudo-inverse survives).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np

from casadi_gnc.allocation.allocator import Allocator
from casadi_gnc.allocation.problem import AllocationProblem
from casadi_gnc.errors import AllocationError

#: Vertices that the on-board solver is compiled for at most.
MAX_VERTICES = 64


def with_faults(
    problem: AllocationProblem,
    *,
    dead: tuple[int, ...] = (),
    stuck: Mapping[int, float] | None = None,
    degraded: Mapping[int, tuple[float, float]] | None = None,
) -> AllocationProblem:
    """Return the problem of the same craft with faults; actuators are numbered from 1.

    Parameters
    ----------
    dead : actuators that make nothing.
    stuck : force [N] at which an actuator stays.
    degraded : interval (low, high) of the factor on an actuator's force, 0 <= low <= high.

    Raises
    ------
    AllocationError
        For an actuator that does not exist, an inverted interval, or more than 64 vertices.
    """
    stuck, degraded = dict(stuck or {}), dict(degraded or {})
    for number in (*dead, *stuck, *degraded):
        if not 1 <= number <= problem.count:
            raise AllocationError(f"fault on actuator {number}; there are actuators 1 to {problem.count}")
    lower, upper = problem.lower.copy(), problem.upper.copy()
    for number, force in {**stuck, **dict.fromkeys(dead, 0.0)}.items():
        lower[number - 1] = upper[number - 1] = force
    changed = replace(problem, lower=lower, upper=upper)
    return _degrade(changed, degraded) if degraded else changed


def _degrade(problem: AllocationProblem, degraded: dict[int, tuple[float, float]]) -> AllocationProblem:
    vertices = len(problem.errors) * 2 ** len(degraded)
    if vertices > MAX_VERTICES:
        raise AllocationError(
            f"{len(problem.errors)} corners of the geometry and {len(degraded)} uncertain actuators make {vertices} "
            f"vertices; {MAX_VERTICES} are the limit. Name fewer actuators, or drop the geometry's errors"
        )
    middle, half = np.ones(problem.count), []
    for number, (low, high) in degraded.items():
        if not 0 <= low <= high:
            raise AllocationError(f"actuator {number}: effectiveness from {low} to {high}; expected 0 <= low <= high")
        middle[number - 1] = (low + high) / 2
        half.append((number - 1, (high - low) / 2))
    errors = []
    for corner, signs in product(problem.errors, product((-1.0, 1.0), repeat=len(half))):
        columns = [
            sign * width * (problem.effectiveness[:, i] + corner @ problem.coupling[:, i])
            for sign, (i, width) in zip(signs, half, strict=True)
        ]
        errors.append(np.column_stack([corner, *columns]))
    rows = np.zeros((len(half), problem.count))
    for row, (i, _) in enumerate(half):
        rows[row, i] = 1.0
    return replace(
        problem,
        effectiveness=problem.effectiveness * middle,
        coupling=np.vstack([problem.coupling * middle, rows]),
        errors=np.array(errors),
    )


@dataclass(frozen=True, eq=False)
class Alignment:
    """Hold the worst case of `worst_alignment`.

    Parameters
    ----------
    share : least share of the commanded effort that is made along the command; negative turns the
        loop around.
    direction : (R,), unit vector of that command.
    vertex : index of the error.
    """

    share: float
    direction: np.ndarray
    vertex: int


def worst_alignment(
    problem: AllocationProblem,
    faults: AllocationProblem | None = None,
    *,
    size: float | None = None,
    directions: int = 200,
    backend: str = "clarabel",
    seed: int = 0,
    **options: Any,
) -> Alignment:
    """Return the least alignment of made with commanded effort over the vertices of an uncertainty.

    Parameters
    ----------
    problem : what the allocator minimises.
    faults : the errors to test against (by default those of `problem`): typically the same craft with
        degraded actuators.
    size : norm of the commands tried, in the unit of the command; a hundredth of the full effort by
        default, so that bounds matter little.
    directions : how many directions are sampled, besides the axes (seeded).
    """
    truth = problem if faults is None else faults
    rows = len(problem.effectiveness)
    radius = 1e-2 * problem.full_effort if size is None else size
    rng = np.random.default_rng(seed)
    sampled = rng.normal(size=(directions, rows))
    tried = np.vstack([np.eye(rows), -np.eye(rows), sampled / np.linalg.norm(sampled, axis=1)[:, None]])
    allocator = Allocator(problem, backend, **options)
    rest = allocator.solve(np.zeros(rows), np.clip(np.zeros(problem.count), problem.lower, problem.upper)).forces
    worst = Alignment(np.inf, tried[0], 0)
    for direction in tried:
        forces = allocator.solve(radius * direction, rest).forces
        # Dead and stuck actuators of the truth do not follow their command.
        moved = np.clip(forces, truth.lower, truth.upper) - np.clip(rest, truth.lower, truth.upper)
        shares = (truth.vertices @ moved) @ direction / radius
        vertex = int(np.argmin(shares))
        if shares[vertex] < worst.share:
            worst = Alignment(float(shares[vertex]), direction, vertex)
    return worst
