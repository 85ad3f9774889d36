"""The least number for which LMIs have a point, by bisection, with one proof at its end.

What has no point for a number has none for a smaller one. So of all the steps that found none only the largest needs a
proof, and the others are told by what the multipliers promise. Where that promise is not kept, the search goes again
with a proof at every step.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from casadi_gnc.synthesis.answer import LmiAnswer


@dataclass(frozen=True, eq=False)
class Least:
    """Hold the end of a bisection.

    Parameters
    ----------
    value : the least number with a point that was found; where none was, the largest that was tried.
    answer : at it.
    below : the largest number tried without a point, 0 for none.
    """

    value: float
    answer: LmiAnswer
    below: float


def least(
    attempt: Callable[[float, bool], LmiAnswer],
    start: float,
    relative: float,
    largest: float,
    *,
    floor: float = 0.0,
    prove: bool = False,
) -> Least:
    """Return the least positive number for which an attempt holds.

    Parameters
    ----------
    attempt : takes the number, and whether to seek a proof that there is no point; see `Lmis.attempt`.
    start : tried first, and doubled until there is a point.
    relative : to which the number is sought.
    largest : the last number tried.
    floor : to which the number is sought where it tends to zero.
    prove : whether every step is to have its proof.
    """
    high, low = min(start, largest), 0.0
    best = attempt(high, prove)
    while not best.status.holds:
        if high >= largest:
            last = best if prove else attempt(high, True)
            if not last.status.holds:
                return Least(high, last, high)
            best = last
            break
        low, high = high, min(2 * high, largest)
        best = attempt(high, prove)
    while high - low > max(relative * high, floor):
        middle = float(np.sqrt(low * high)) if low > 0.1 * high else (low + high) / 2
        trial = attempt(middle, prove)
        if trial.status.holds:
            high, best = middle, trial
        else:
            low = middle
    if not prove and low > 0 and attempt(low, True).status.holds:
        return least(attempt, start, relative, largest, floor=floor, prove=True)
    return Least(high, best, low)
