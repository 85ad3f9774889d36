"""How the forces of an answer change with the command and with the forces before: by its optimality conditions.

At a minimum with free actuators f and active vertices a (those with a weight), t the worst cost, the conditions

    sum_a lambda_a grad c_a + 2 M1 (F - Fs) + 2 M2 (F - Fp) = 0 on f,    c_a = t,    sum lambda_a = 1

hold with the same sets for commands nearby. Differentiated, they are linear in dF, dlambda and dt. An actuator at an
amplitude bound stays; one at a rate bound moves with its force before.

Where a set is about to change (an actuator at its bound without a price, two vertices that tie) the forces have one
derivative on each side, and what is returned is one of them; `is_determined` says so.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from casadi_gnc.allocation.answer import Answer, Saturation
from casadi_gnc.allocation.problem import AllocationProblem
from casadi_gnc.errors import AllocationError
from casadi_gnc.mathematics.arrays import real_array

#: Weight of a vertex, and price of a bound over the largest price there is, below which they count as none.
_NOTHING = 1e-6


@dataclass(frozen=True, eq=False)
class Jacobian:
    """Hold derivatives of the forces.

    Parameters
    ----------
    by_command : dF/du, (N, R), force per effort.
    by_previous : dF/dFp, (N, N).
    is_determined : whether the active set is the same on both sides.
    """

    by_command: np.ndarray
    by_previous: np.ndarray
    is_determined: bool


def jacobian(problem: AllocationProblem, answer: Answer, command: Any, previous: Any) -> Jacobian:
    """Return the derivatives of an answer.

    Parameters
    ----------
    answer : of this problem; the more exact (`duality_gap`), the surer its active set. Back ends that end on one
        ("online", "daqp", "sqpmethod") are best.
    command, previous : that it was given, (R,) and (N,).

    Raises
    ------
    AllocationError
        For wrong shapes, or an answer that is not certified: it has no optimality conditions to differentiate.

    Examples
    --------
    >>> from casadi_gnc.allocation import solve
    >>> problem = AllocationProblem(np.array([[1.0]]), -9.0, 9.0, change_weight=2.0, accuracy_weight=3.0)
    >>> found = jacobian(problem, solve(problem, [1.0], [0.0], backend="daqp"), [1.0], [0.0])
    >>> found.by_command.round(6).tolist(), found.by_previous.round(6).tolist()  # 3/6 and 2/6
    ([[0.5]], [[0.333333]])
    """
    u = real_array("command", command, AllocationError)
    last = real_array("previous", previous, AllocationError)
    rows, count = problem.effectiveness.shape
    if u.shape != (rows,) or last.shape != (count,) or answer.forces.shape != (count,):
        raise AllocationError(
            f"command has shape {u.shape}, expected ({rows},); previous {last.shape} and forces {answer.forces.shape}, "
            f"expected ({count},)"
        )
    if not answer.status.is_certified:
        raise AllocationError(f"an answer that is {answer.status.name} has no derivatives; certify it first")
    forces, h = answer.forces, problem.accuracy_weight
    free = answer.saturation == Saturation.FREE
    active = answer.vertex_weights > _NOTHING
    weights, made = answer.vertex_weights[active], problem.vertices[active]
    missing = problem.missing(forces, u)[active]
    slopes = -2 * h * np.einsum("vrn,vr->vn", made, missing)
    curvature = np.diag(2 * (problem.effort_weights + problem.change_weight))
    curvature = curvature + 2 * h * np.einsum("v,vrn,vrm->nm", weights, made, made)
    by_command = 2 * h * np.einsum("v,vrn->nr", weights, made)  # of minus the gradient
    change = 2 * np.diag(problem.change_weight)
    follows = np.isin(answer.saturation, (Saturation.LOWER_RATE, Saturation.UPPER_RATE))
    fixed = np.diag(follows.astype(float))  # d of those that are held, by previous

    size, several = int(free.sum()), int(active.sum())
    unit = max(float(np.abs(curvature).max()), 1e-300)
    system = np.zeros((size + several + 1, size + several + 1))
    system[:size, :size] = curvature[np.ix_(free, free)]
    system[:size, size : size + several] = slopes[:, free].T
    system[size : size + several, :size] = slopes[:, free]
    system[size : size + several, -1] = -1.0
    system[-1, size : size + several] = -1.0
    right = np.zeros((len(system), rows + count))
    right[:size, :rows] = by_command[free]
    right[:size, rows:] = change[free] - curvature[free] @ fixed
    right[size : size + several, :rows] = -2 * h * missing
    right[size : size + several, rows:] = -slopes @ fixed
    scale = np.concatenate([np.full(size, unit**-0.5), np.ones(several + 1)])
    steep = max(float(np.abs(slopes[:, free]).max(initial=0.0)), 1e-300) * unit**-0.5
    scale[size:-1], scale[-1] = 1 / steep, steep
    solved = scale[:, None] * np.linalg.lstsq(scale[:, None] * system * scale, scale[:, None] * right, 1e-13)[0]

    found = np.hstack([np.zeros((count, rows)), fixed])
    found[free] = solved[:size]
    return Jacobian(found[:, :rows], found[:, rows:], _is_determined(problem, answer, last, slopes.T @ weights))


def _is_determined(problem: AllocationProblem, answer: Answer, last: np.ndarray, sloped: np.ndarray) -> bool:
    """Return whether every bound that is held has a price and every worst vertex a weight."""
    gradient = sloped + 2 * problem.effort_weights * (answer.forces - problem.preferred)
    gradient = gradient + 2 * problem.change_weight * (answer.forces - last)
    held = (answer.saturation != Saturation.FREE) & (answer.saturation != Saturation.STUCK)
    upper = np.isin(answer.saturation, (Saturation.UPPER_AMPLITUDE, Saturation.UPPER_RATE))
    prices = np.where(upper, -gradient, gradient)[held]
    terms = np.abs(sloped).max(initial=0.0)
    return bool(np.all(prices > _NOTHING * terms)) and bool(
        np.all(answer.vertex_weights[_worst(problem, answer)] > _NOTHING)
    )


def _worst(problem: AllocationProblem, answer: Answer) -> np.ndarray:
    made = problem.vertices @ answer.forces
    costs = np.sum((answer.unallocated + problem.effectiveness @ answer.forces - made) ** 2, axis=1)
    distinct = np.linalg.norm(made - made[answer.worst_vertex], axis=1) > 1e-9 * problem.full_effort
    near = costs >= costs.max() * (1 - 1e-9)
    near[answer.worst_vertex] = True
    return near & (distinct | (np.arange(len(made)) == answer.worst_vertex))
