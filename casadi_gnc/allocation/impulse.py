"""Minimum impulse: every force is zero or at least what a thruster can make.

Which thrusters fire is a choice of on and off; for each the forces are a convex problem. Branch and bound: the relaxed
problem (0 <= F) bounds every choice below it from below, by its certificate; the most undecided thruster is split into
off and on, the likelier first. A branch is left where its bound is above the best found less `WITHIN`, so that the best
found is within that of the best of all choices, unless the number of problems runs out first.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from casadi_gnc.allocation.allocator import Accuracy, Allocator
from casadi_gnc.allocation.answer import ACCURACIES, AllocationStatus, Answer, judge, saturation
from casadi_gnc.allocation.problem import AllocationProblem
from casadi_gnc.errors import AllocationError
from casadi_gnc.mathematics.arrays import real_array

#: Cost above the least of all choices, of the cost, that is allowed.
WITHIN = 0.05
_MOST = 600  # convex problems a command
_EDGE = 1e-9  # of the least force: rounding

Box = tuple[np.ndarray, np.ndarray]


def with_minimum_impulse(
    problem: AllocationProblem,
    command: np.ndarray,
    least: float,
    previous: np.ndarray | None = None,
    *,
    backend: str = "clarabel",
    accuracy: Accuracy = "mid",
) -> Answer:
    """Return an allocation in which every force is zero or at least `least` [N].

    Among all choices of thrusters that fire the cost is within 5 % of the least, up to 600 convex problems a command:
    always for up to 8 thrusters, nearly always for 12. `duality_gap` bounds the cost above the optimum of the problem
    *without* the dead band: what the dead band costs at most. The status is OPTIMAL only where that is next to
    nothing. Where stuck actuators, bounds or a rate limit allow neither zero nor `least`, they win.
    """
    if not least >= 0 or np.any(problem.lower < 0):
        raise AllocationError("a minimum impulse needs least >= 0 and actuators that push one way (lower >= 0)")
    last = np.zeros(problem.count) if previous is None else real_array("previous", previous, AllocationError)
    last = np.clip(last, problem.lower, problem.upper) if previous is None else last
    command = real_array("command", command, AllocationError)
    allocator = Allocator(problem, backend, accuracy=accuracy)
    relaxed = allocator.solve(command, last)
    if relaxed.status in (AllocationStatus.BAD_COMMAND, AllocationStatus.FAILED):
        return relaxed
    low, high = problem.box(last)
    u = command
    best = _search(problem, allocator, u, last, relaxed, (low, high), least)
    forces = best.forces
    cost = problem.objective(forces, u, last)
    gap = cost - (relaxed.objective - relaxed.duality_gap)
    return replace(
        best,
        forces=forces,
        objective=cost,
        duality_gap=gap,
        vertex_weights=relaxed.vertex_weights,
        worst_vertex=int(np.argmax(problem.vertex_costs(forces, u))),
        unallocated=u - problem.effectiveness @ forces,
        saturation=saturation(problem, forces, (low, high)),
        status=judge(problem, u, cost, gap, ACCURACIES[accuracy]),
    )


def never_fires(problem: AllocationProblem, least: float) -> np.ndarray:
    """Return the actuators, numbered from 1, that can never reach a least force from rest."""
    from_rest = np.minimum(np.maximum(problem.lower, 0.0) + problem.max_step, problem.upper)
    movable = problem.upper > problem.lower
    return np.flatnonzero(movable & (from_rest < least * (1 - _EDGE))) + 1


def _search(
    problem: AllocationProblem,
    allocator: Allocator,
    u: np.ndarray,
    last: np.ndarray,
    relaxed: Answer,
    box: Box,
    least: float,
) -> Answer:
    """Return the best answer with every force at zero or above the least, as far as the bounds allow it."""
    low, high = box
    off, on = low <= 0.0, high >= least
    split = off & on & (low < high) & (low < least)  # both may be: the choice
    lower, upper = low.copy(), high.copy()
    lower = np.where(~off & on & (low < high), np.maximum(low, least), lower)
    upper = np.where(off & ~on & (low < high), 0.0, upper)
    start = relaxed if np.array_equal(lower, low) and np.array_equal(upper, high) else None
    start = allocator.solve(u, last, (lower, upper)) if start is None else start
    best, cost, solved = _rounded(problem, allocator, u, last, start, (lower, upper), split, least), np.inf, 1
    if best is not None:
        cost = best.objective
    waiting = [(lower, upper, split, start)]
    while waiting and solved < _MOST:
        lower, upper, open_, answer = waiting.pop()
        if answer.objective - answer.duality_gap >= cost * (1 - WITHIN):
            continue
        inside = open_ & (answer.forces > _EDGE * least) & (answer.forces < least * (1 - _EDGE))
        if not np.any(inside):
            cleaned = _cleaned(problem, u, last, answer, split, least)
            if cleaned.objective < cost:
                best, cost = cleaned, cleaned.objective
            continue
        i = int(np.argmin(np.where(inside, np.abs(answer.forces - least / 2), np.inf)))
        children = []
        for fires in (False, True):
            below, above, still = lower.copy(), upper.copy(), open_.copy()
            still[i] = False
            below[i], above[i] = (max(low[i], least), high[i]) if fires else (0.0, 0.0)
            child = allocator.solve(u, last, (below, above))
            solved += 1
            if _allowed(child.forces, still, least):
                tried = _cleaned(problem, u, last, child, split, least)
                if tried.objective < cost:
                    best, cost = tried, tried.objective
            children.append((below, above, still, child))
        children.sort(key=lambda node: -node[3].objective)  # the cheaper one is taken first
        waiting += children
    return start if best is None else best


def _rounded(
    problem: AllocationProblem,
    allocator: Allocator,
    u: np.ndarray,
    last: np.ndarray,
    answer: Answer,
    box: Box,
    split: np.ndarray,
    least: float,
) -> Answer | None:
    """Return a first answer: forces inside the dead band go to the nearer end, the largest first."""
    (lower, upper), open_ = (bound.copy() for bound in box), split.copy()
    for _ in range(problem.count + 1):
        inside = open_ & (answer.forces > _EDGE * least) & (answer.forces < least * (1 - _EDGE))
        if not np.any(inside):
            return _cleaned(problem, u, last, answer, split, least)
        i = int(np.argmax(np.where(inside, answer.forces, -1.0)))
        open_[i] = False
        if answer.forces[i] < least / 2:
            lower[i] = upper[i] = 0.0
        else:
            lower[i] = max(lower[i], least)
        answer = allocator.solve(u, last, (lower.copy(), upper.copy()))
    return None


def _allowed(forces: np.ndarray, open_: np.ndarray, least: float) -> bool:
    return not np.any(open_ & (forces > _EDGE * least) & (forces < least * (1 - _EDGE)))


def _cleaned(
    problem: AllocationProblem, u: np.ndarray, last: np.ndarray, answer: Answer, open_: np.ndarray, least: float
) -> Answer:
    """Return the answer with rounding beside zero and beside the least force taken away."""
    forces = np.where(open_ & (answer.forces <= _EDGE * least), 0.0, answer.forces)
    forces = np.where(open_ & (np.abs(forces - least) <= _EDGE * least), least, forces)
    return replace(answer, forces=forces, objective=problem.objective(forces, u, last))
