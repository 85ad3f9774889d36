"""What to do with commands that cannot, or should not, be met as they are.

* `along_direction`: keep the direction of the command and give up size, so that a saturated torque
  does not turn. The largest s <= 1 with s u attainable by the nominal geometry is a linear program.
* `by_priority`: give up the effort axes of low priority first. Axes are weighted apart by a stated
  ratio; the minority axes then cost at most 1/ratio of what they would.
* `with_minimum_impulse`: commands between zero and the least force that a thruster can make are
  rounded to one of the two and the others are allocated again. The cost of that is stated: the
  answer's gap is taken against the problem without the dead band, so it bounds the loss.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from casadi_gnc.allocation.allocator import LARGEST, Accuracy, Allocator
from casadi_gnc.allocation.answer import ACCURACIES, AllocationStatus, Answer, judge, saturation
from casadi_gnc.allocation.problem import AllocationProblem
from casadi_gnc.errors import AllocationError


def largest_scale(problem: AllocationProblem, command: np.ndarray, previous: np.ndarray) -> float:
    """Return the largest s in [0, 1] for which A F = s u has forces inside the bounds.

    0 where not even the direction's start is attainable (bounds that force an effort elsewhere).
    """
    from scipy.optimize import linprog

    lower, upper = problem.box(previous)
    equality = np.hstack([problem.effectiveness, -np.asarray(command, dtype=float)[:, None]])
    scale = np.maximum(np.abs(equality).max(axis=1), 1e-300)  # rows of like size for the solver
    cost = np.zeros(problem.count + 1)
    cost[-1] = -1.0
    limits = [*zip(lower, upper, strict=True), (0.0, 1.0)]
    found = linprog(cost, A_eq=equality / scale[:, None], b_eq=np.zeros(len(equality)), bounds=limits, method="highs")
    return float(found.x[-1]) if found.status == 0 else 0.0


def along_direction(
    allocator: Allocator, command: np.ndarray, previous: np.ndarray | None = None
) -> tuple[Answer, float]:
    """Return the allocation of s u and s, with s the largest share of the command that is attainable."""
    last = allocator.previous if previous is None else np.asarray(previous, dtype=float)
    command = np.asarray(command, dtype=float)
    if not (np.all(np.abs(command) <= LARGEST) and np.all(np.abs(last) <= LARGEST)):
        return allocator.solve(command, last), 0.0
    share = largest_scale(allocator.problem, command, last)
    answer = allocator.solve(share * command, last)
    return replace(answer, unallocated=command - allocator.problem.effectiveness @ answer.forces), share


def by_priority(problem: AllocationProblem, priorities: Sequence[int], ratio: float = 100.0) -> AllocationProblem:
    """Return the problem with effort axes weighted apart.

    Parameters
    ----------
    priorities : one whole number a row of effort, 0 the most important; the squared error of a row of
        priority p counts ratio**-p.
    ratio : more than 1.

    The rows of the result are scaled: give it commands scaled by `axis_scale`.
    """
    if not ratio > 1:
        raise AllocationError(f"the ratio between priorities is {ratio}, expected more than 1")
    if len(priorities) != len(problem.effectiveness) or min(priorities) < 0:
        raise AllocationError(
            f"{len(priorities)} priorities for {len(problem.effectiveness)} rows of effort; expected one whole number "
            "from 0 for each"
        )
    scale = axis_scale(priorities, ratio)
    if scale.min() < 1e-6:
        raise AllocationError(
            f"priorities {list(priorities)} with ratio {ratio:g} leave an axis less than 1e-12 of its weight"
        )
    return replace(
        problem, effectiveness=scale[:, None] * problem.effectiveness, errors=scale[None, :, None] * problem.errors
    )


def axis_scale(priorities: Sequence[int], ratio: float = 100.0) -> np.ndarray:
    """Return the factor on each row of effort, (R,), that `by_priority` uses."""
    return np.sqrt(float(ratio) ** -np.asarray(priorities, dtype=float))


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

    Forces inside the dead band are rounded to the nearer end that the sample's bounds allow and fixed,
    largest first, and the rest allocated again until none is left inside. `duality_gap` bounds the cost
    above the optimum of the problem *without* the dead band: what the dead band costs at most. The
    status is OPTIMAL only where that is next to nothing. A rate limit that allows neither end wins.
    """
    if not least >= 0 or np.any(problem.lower < 0):
        raise AllocationError("a minimum impulse needs least >= 0 and actuators that push one way (lower >= 0)")
    last = np.clip(np.zeros(problem.count), problem.lower, problem.upper) if previous is None else np.asarray(previous)
    allocator = Allocator(problem, backend, accuracy=accuracy)
    relaxed = allocator.solve(command, last)
    if relaxed.status in (AllocationStatus.BAD_COMMAND, AllocationStatus.FAILED):
        return relaxed
    low, high = problem.box(last)
    lower, upper, answer = low.copy(), high.copy(), relaxed
    for _ in range(problem.count):
        inside = (answer.forces > 1e-9 * least) & (answer.forces < least * (1 - 1e-9)) & (lower < upper)
        if not np.any(inside):
            break
        i = int(np.argmax(np.where(inside, answer.forces, -1.0)))
        ends = [end for end in (0.0, least) if low[i] <= end <= high[i]]
        value = min(ends, key=lambda end: abs(end - answer.forces[i])) if ends else answer.forces[i]
        lower[i] = upper[i] = value
        answer = allocator.solve(command, last, (lower.copy(), upper.copy()))
    forces, u = np.where(answer.forces <= 1e-9 * least, low, answer.forces), np.asarray(command, dtype=float)
    cost = problem.objective(forces, u, last)
    gap = cost - (relaxed.objective - relaxed.duality_gap)
    return replace(
        answer,
        forces=forces,
        objective=cost,
        duality_gap=gap,
        vertex_weights=relaxed.vertex_weights,
        worst_vertex=int(np.argmax(problem.vertex_costs(forces, u))),
        unallocated=u - problem.effectiveness @ forces,
        saturation=saturation(problem, forces, (low, high)),
        status=judge(problem, u, cost, gap, ACCURACIES[accuracy]),
    )
