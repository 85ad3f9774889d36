"""Minimum, maximum and clipping by comparison.

`fmin` and `fmax` treat signed zeros differently from one compiler and target to the next, so the
tapes compare instead: the same words everywhere.
"""

from __future__ import annotations

from typing import Any

import casadi as ca


def minimum(a: Any, b: Any) -> Any:
    """Return a where a < b, else b, element by element."""
    return ca.if_else(a < b, a, b)


def maximum(a: Any, b: Any) -> Any:
    """Return a where a > b, else b, element by element."""
    return ca.if_else(a > b, a, b)


def clip(value: Any, lower: Any, upper: Any) -> Any:
    """Return value moved into [lower, upper], element by element; lower <= upper."""
    return minimum(maximum(value, lower), upper)


def outside(value: Any, lower: Any, upper: Any) -> Any:
    """Return 1 where any element lies outside [lower, upper], else 0; NaN counts as outside."""
    inside = ca.logic_and(value >= lower, value <= upper)
    return ca.logic_not(all_of(inside))


def all_of(flags: Any) -> Any:
    """Return 1 where every element of a column of flags is non-zero."""
    result = flags[0]
    for i in range(1, flags.numel()):
        result = ca.logic_and(result, flags[i])
    return result


def any_of(flags: Any) -> Any:
    """Return 1 where some element of a column of flags is non-zero."""
    result = flags[0]
    for i in range(1, flags.numel()):
        result = ca.logic_or(result, flags[i])
    return result


def largest(values: Any) -> Any:
    """Return the largest element of a column."""
    result = values[0]
    for i in range(1, values.numel()):
        result = maximum(values[i], result)
    return result
