"""What an allocation returns: forces, and our own proof of how good they are."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, IntEnum

import numpy as np

from casadi_gnc.allocation.problem import AllocationProblem

#: Relative gap and rounding floor (share of h |largest effort|^2) by name of the accuracy wanted.
ACCURACIES = {"low": (1e-3, 1e-6), "mid": (1e-6, 1e-10), "high": (1e-8, 1e-14)}
#: Largest gap, of the cost, that counts as certified at the floor, and the share of the floor that always does: costs
#: so small beside the full effort are those of commands that are nothing but rounding.
CLOSE, NOTHING = 1e-3, 1e-10


class AllocationStatus(Enum):
    """How an allocation ended; the value is the sentence for the reader."""

    OPTIMAL = "The forces are optimal to the tolerance, by our certificate."
    AT_ROUNDING = (
        "The forces are optimal to the floor of the accuracy and within 0.1 % of the least cost, by our certificate."
    )
    NOT_CERTIFIED = "The forces are feasible, but the certificate does not reach the tolerance; see the gap."
    FAILED = "The solver returned nothing usable; the previous forces were kept inside the bounds."
    DIRECTION_TURNED = (
        "The command's direction cannot be kept: the effort has the least angle to it that the bounds allow."
    )
    DIRECTION_LOST = "Nothing can be made along the command: the forces are those of least error."
    LIMITS_BROKEN = "No forces inside the bounds keep the linear limits: they are broken as little as can be."
    BAD_COMMAND = "The command or the previous forces are not finite; the previous forces were kept inside the bounds."

    @property
    def is_certified(self) -> bool:
        """Whether the forces are proved optimal."""
        return self in (AllocationStatus.OPTIMAL, AllocationStatus.AT_ROUNDING)


class Saturation(IntEnum):
    """Which bound an actuator sits on."""

    FREE = 0
    LOWER_AMPLITUDE = 1
    UPPER_AMPLITUDE = 2
    LOWER_RATE = 3
    UPPER_RATE = 4
    STUCK = 5


@dataclass(frozen=True, eq=False)
class Level:
    """Hold what became of the rows of effort of one exact priority.

    Parameters
    ----------
    rows : counted from 1.
    error : sum over its rows of what is missing, under the worst error of the geometry.
    gap : rigorous bound on the error above the least that the levels before leave.
    """

    rows: tuple[int, ...]
    error: float
    gap: float


@dataclass(frozen=True, eq=False)
class Answer:
    """Hold one allocation.

    Parameters
    ----------
    forces : (N,), inside the bounds.
    objective : cost of the forces.
    duality_gap : rigorous bound on the cost above the optimum, computed by us from the data.
    vertex_weights : (V,), on the simplex: which error is binding.
    worst_vertex : the error under which most effort is missing.
    unallocated : (R,), command minus nominal effort, in the unit of the command.
    saturation : (N,) of `Saturation` codes.
    status : how it ended.
    iterations : the solver's count.
    claimed : whether the solver itself said it had solved the problem.
    backend : its name.
    seconds, solver_seconds : wall time of the call, and what the solver says it took (NaN: does not say).
    levels : of exact priorities, the most important first; empty where there are none.
    """

    forces: np.ndarray
    objective: float
    duality_gap: float
    vertex_weights: np.ndarray
    worst_vertex: int
    unallocated: np.ndarray
    saturation: np.ndarray
    status: AllocationStatus
    iterations: int
    claimed: bool
    backend: str
    seconds: float = float("nan")
    solver_seconds: float = float("nan")
    levels: tuple[Level, ...] = ()

    @property
    def relative_gap(self) -> float:
        """Gap over cost; 0 where both vanish."""
        return self.duality_gap / self.objective if self.objective > 0 else float(self.duality_gap > 0)


def certify(
    problem: AllocationProblem,
    command: np.ndarray,
    previous: np.ndarray,
    forces: np.ndarray,
    weights: np.ndarray | None,
    accuracy: tuple[float, float],
    box: tuple[np.ndarray, np.ndarray],
) -> tuple[float, float, np.ndarray, AllocationStatus]:
    """Return cost, gap, vertex weights and status of feasible forces.

    Parameters
    ----------
    weights : (V,), the solver's multipliers; where it gives none, or poor ones, weights are sought
        that make the gap small.
    accuracy : relative tolerance and rounding floor, see `ACCURACIES`.
    box : lower and upper bounds of this sample, (N,) each.
    """
    sample = (command, previous, *box)
    cost = problem.objective(forces, command, previous)
    enough = max(accuracy[0] * cost, floor_of(problem, command, accuracy))
    lam, gap = np.full(len(problem.errors), 1 / len(problem.errors)), np.inf
    usable = weights is not None and np.shape(weights) == np.shape(lam) and np.all(np.isfinite(weights))
    if weights is not None and usable and np.max(weights) > 0:
        lam = np.maximum(weights, 0.0) / np.maximum(weights, 0.0).sum()
        gap = problem.gap(forces, lam, *sample)
    if not gap <= enough:  # the forces may still be good where the multipliers are not
        other = best_weights(problem, forces, *sample)
        better = problem.gap(forces, other, *sample)
        lam, gap = (other, better) if not gap <= better else (lam, gap)
    return cost, gap, lam, judge(problem, command, cost, gap, accuracy)


def floor_of(problem: AllocationProblem, command: np.ndarray, accuracy: tuple[float, float]) -> float:
    """Return the gap beyond which nothing counts as rounding: a share of the cost of missing the full effort."""
    effort = np.float64(max(problem.full_effort, float(np.linalg.norm(command))))
    with np.errstate(over="ignore"):
        return float(accuracy[1] * problem.accuracy_weight * effort**2)


def judge(
    problem: AllocationProblem, command: np.ndarray, cost: float, gap: float, accuracy: tuple[float, float]
) -> AllocationStatus:
    """Return the status that a cost and its gap deserve; numbers that are not finite prove nothing."""
    floor = floor_of(problem, command, accuracy)
    if not (np.isfinite(cost) and np.isfinite(gap) and np.isfinite(floor)):
        return AllocationStatus.NOT_CERTIFIED
    if gap <= accuracy[0] * cost:
        return AllocationStatus.OPTIMAL
    if not np.any(command):  # nothing is wanted: the full effort's cost is the only measure there is
        return AllocationStatus.AT_ROUNDING if gap <= floor else AllocationStatus.NOT_CERTIFIED
    close = gap <= floor and gap <= max(CLOSE, accuracy[0]) * cost
    return AllocationStatus.AT_ROUNDING if close or gap <= NOTHING * floor else AllocationStatus.NOT_CERTIFIED


def best_weights(
    problem: AllocationProblem,
    forces: np.ndarray,
    command: np.ndarray,
    previous: np.ndarray,
    lower: np.ndarray,
    upper: np.ndarray,
) -> np.ndarray:
    """Return vertex weights that make the gap of given forces small, for solvers without multipliers.

    The gap is convex in the weights: a vertex costs its distance to the worst one, and an actuator
    whose gradient is -(s + p - m), with p and m not negative, costs s^2/2q + p up + m down, where up
    and down are what the box leaves. That is a non-negative least-squares problem in (lambda, p, m)
    but for its linear part L, which enters as (L + 1/2)^2: the two agree where the gap vanishes.
    """
    vertices = len(problem.errors)
    if vertices == 1:
        return np.ones(1)
    from scipy.optimize import nnls

    costs = problem.vertex_costs(forces, command)
    missing = problem.missing(forces, command)
    gradients = -2 * problem.accuracy_weight * np.einsum("vrn,vr->nv", problem.vertices, missing)
    effort = 2 * problem.effort_weights * (forces - problem.preferred) + 2 * problem.change_weight * (forces - previous)
    moving = upper > lower
    gradients, effort, count = gradients[moving], effort[moving], int(moving.sum())
    up, down = (upper - forces)[moving], (forces - lower)[moving]
    curvature = 2 * (problem.effort_weights + problem.change_weight)[moving]
    stiffness = 2 * problem.accuracy_weight * np.max(np.sum(problem.vertices**2, axis=1), initial=0.0)
    largest = max(problem.full_effort, float(np.linalg.norm(command)))
    unit = max(problem.objective(forces, command, previous), 1e-18 * problem.accuracy_weight * largest**2)
    equal = np.full(vertices, 1 / vertices)
    if not 0 < unit < np.inf or not stiffness > 0:  # no effort can be made: there is nothing to weigh
        return equal
    row = 1 / np.sqrt(2 * unit * np.maximum(curvature, 1e-9 * stiffness))
    rows = np.vstack(
        [
            np.hstack([gradients * row[:, None], np.diag(row), -np.diag(row)]),
            np.concatenate([costs.max() - costs, up, down])[None] / unit,
            1e3 * np.concatenate([np.ones(vertices), np.zeros(2 * count)])[None],
        ]
    )
    right = np.concatenate([-effort * row, [-0.5, 1e3]])
    size = np.maximum(np.linalg.norm(rows, axis=0), 1e-300)
    try:
        weights = (nnls(rows / size, right, maxiter=20 * len(size))[0] / size)[:vertices]
    except RuntimeError:  # too many iterations: any weights are allowed, these are seldom good
        return equal
    return weights / weights.sum() if weights.sum() > 0 else equal


def saturation(problem: AllocationProblem, forces: np.ndarray, box: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """Return the `Saturation` code of every actuator, (N,), at the bounds of this sample."""
    lower, upper = box
    near = 1e-9 * np.maximum(upper - lower, 0.0)
    codes = np.zeros(len(forces), dtype=int)
    at_lower, at_upper = forces <= lower + near, forces >= upper - near
    codes[at_lower] = np.where(lower <= problem.lower, Saturation.LOWER_AMPLITUDE, Saturation.LOWER_RATE)[at_lower]
    codes[at_upper] = np.where(upper >= problem.upper, Saturation.UPPER_AMPLITUDE, Saturation.UPPER_RATE)[at_upper]
    codes[lower >= upper] = Saturation.STUCK
    return codes
