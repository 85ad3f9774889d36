"""Priorities among the axes of effort: give up those of low priority first.

Axes are weighted apart by a stated ratio; the minority axes then cost at most 1/ratio of what they would.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from casadi_gnc.allocation.problem import AllocationProblem
from casadi_gnc.errors import AllocationError


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
