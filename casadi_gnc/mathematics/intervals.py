"""Intervals that hold every value of an expression while its inputs lie in theirs.

Each operation is rounded outward, so what is enclosed stays enclosed. An operation that is not known here, and one that
is not defined over all of its interval (a root of what may be negative), gives the whole line: wide, never wrong.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

#: Units in the last place by which libraries' elementary functions may be wrong.
_LIBRARY = 4


@dataclass(frozen=True, eq=False)
class Interval:
    """Hold ends, arrays of one shape, any of them infinite; the whole line where one is no number."""

    low: np.ndarray
    high: np.ndarray

    @staticmethod
    def of(value: Any) -> Interval:
        """Return the interval that is one number, or many."""
        array = np.asarray(value, dtype=float)
        return Interval(array, array)

    @staticmethod
    def line(shape: tuple[int, ...] = ()) -> Interval:
        """Return the whole line."""
        return Interval(np.full(shape, -math.inf), np.full(shape, math.inf))

    @property
    def is_line(self) -> np.ndarray:
        """Whether an end is infinite, elementwise."""
        return ~(np.isfinite(self.low) & np.isfinite(self.high))


def _outward(low: Any, high: Any, units: int = 1) -> Interval:
    """Return ends moved out by units in the last place; the whole line where one of them is no number."""
    bad = np.isnan(low) | np.isnan(high)
    low, high = np.where(bad, -math.inf, low), np.where(bad, math.inf, high)
    for _ in range(units):
        low, high = np.nextafter(low, -math.inf), np.nextafter(high, math.inf)
    return Interval(low, high)


def _add(a: Interval, b: Interval) -> Interval:
    found = _outward(a.low + b.low, a.high + b.high)
    positive = (a.low >= 0) & (b.low >= 0)  # and so is the sum: a root may follow
    return Interval(np.where(positive, np.maximum(found.low, 0.0), found.low), found.high)


def _negative(a: Interval) -> Interval:
    return Interval(-a.high, -a.low)


def _product(a: Interval, b: Interval) -> Interval:
    ends = np.stack(np.broadcast_arrays(a.low * b.low, a.low * b.high, a.high * b.low, a.high * b.high))
    zero = ((a.low == 0) & (a.high == 0)) | ((b.low == 0) & (b.high == 0))
    found = _outward(ends.min(axis=0), ends.max(axis=0))  # 0 times infinity is no number: the line, but of 0 itself
    return Interval(np.where(zero, 0.0, found.low), np.where(zero, 0.0, found.high))


def _inverse(a: Interval) -> Interval:
    return _where((a.low > 0) | (a.high < 0), _outward(1.0 / a.high, 1.0 / a.low))


def _square(a: Interval) -> Interval:
    large = np.maximum(np.abs(a.low), np.abs(a.high))
    small = np.where((a.low <= 0) & (a.high >= 0), 0.0, np.minimum(np.abs(a.low), np.abs(a.high)))
    found = _outward(small * small, large * large)
    return Interval(np.maximum(found.low, 0.0), found.high)


def _root(a: Interval) -> Interval:
    found = _outward(np.sqrt(np.maximum(a.low, 0.0)), np.sqrt(np.maximum(a.high, 0.0)))
    return _where(a.low >= 0, Interval(np.maximum(found.low, 0.0), found.high))


def _magnitude(a: Interval) -> Interval:
    low = np.where((a.low <= 0) & (a.high >= 0), 0.0, np.minimum(np.abs(a.low), np.abs(a.high)))
    return Interval(low, np.maximum(np.abs(a.low), np.abs(a.high)))


def _sine(a: Interval, ahead: float = 0.0) -> Interval:
    """Return the sine of a + ahead, a quarter turn for the cosine."""
    function = np.cos if ahead else np.sin
    ends = function(a.low), function(a.high)
    found = _outward(np.minimum(*ends), np.maximum(*ends), _LIBRARY)
    slack = 1e-12 * (1.0 + np.abs(a.low) + np.abs(a.high))  # of the turns that are counted: rather one too many

    def holds(top: float) -> np.ndarray:
        turns = 2 * math.pi
        first = np.ceil((a.low - slack + ahead - top) / turns)
        return first * turns + top <= a.high + slack + ahead

    low = np.where(holds(-math.pi / 2), -1.0, np.maximum(found.low, -1.0))
    return Interval(low, np.where(holds(math.pi / 2), 1.0, np.minimum(found.high, 1.0)))


def _rising(function: Callable[[Any], Any], low: float = -math.inf, high: float = math.inf) -> Any:
    """Return the interval of a function that rises from `low` to `high` and is defined there alone."""

    def found(a: Interval) -> Interval:
        inside = (a.low > low) & (a.high < high)
        told = _outward(function(np.where(inside, a.low, 0.5)), function(np.where(inside, a.high, 0.5)), _LIBRARY)
        return _where(inside, told)

    return found


def _where(good: Any, found: Interval) -> Interval:
    return Interval(np.where(good, found.low, -math.inf), np.where(good, found.high, math.inf))


def _truth(certain: Any, never: Any) -> Interval:
    return Interval(np.where(certain, 1.0, 0.0), np.where(never, 0.0, 1.0))


def _chosen(a: Interval, b: Interval) -> Interval:
    """Return b where a holds, else 0; both where that is open, and the line where a is (see `smooth`)."""
    holds = (a.low > 0) | (a.high < 0)
    never = (a.low == 0) & (a.high == 0)
    low = np.where(holds, b.low, np.where(never, 0.0, np.minimum(b.low, 0.0)))
    high = np.where(holds, b.high, np.where(never, 0.0, np.maximum(b.high, 0.0)))
    return _where(np.isfinite(a.low) | np.isfinite(a.high), Interval(low, high))


def _is_true(a: Interval) -> tuple[Any, Any]:
    """Return whether a is certainly not zero, and whether it certainly is."""
    return (a.low > 0) | (a.high < 0), (a.low == 0) & (a.high == 0)


def _and(a: Interval, b: Interval) -> Interval:
    (a_true, a_never), (b_true, b_never) = _is_true(a), _is_true(b)
    return _truth(a_true & b_true, a_never | b_never)


def _not(a: Interval) -> Interval:
    holds, never = _is_true(a)
    return _truth(never, holds)


def _same(a: Interval, b: Interval) -> Interval:
    one = (a.low == a.high) & (b.low == b.high) & (a.low == b.low)
    return _truth(one, (a.high < b.low) | (b.high < a.low))


_ONE: dict[int, Callable[[Interval], Interval]] = {
    ca.OP_NEG: _negative,
    ca.OP_ASSIGN: lambda a: a,
    ca.OP_TWICE: lambda a: Interval(2 * a.low, 2 * a.high),
    ca.OP_SQ: _square,
    ca.OP_SQRT: _root,
    ca.OP_INV: _inverse,
    ca.OP_FABS: _magnitude,
    ca.OP_SIN: _sine,
    ca.OP_COS: lambda a: _sine(a, math.pi / 2),
    ca.OP_EXP: _rising(np.exp),
    ca.OP_LOG: _rising(np.log, 0.0),
    ca.OP_ATAN: _rising(np.arctan),
    ca.OP_ASIN: _rising(np.arcsin, -1.0, 1.0),
    ca.OP_ACOS: lambda a: _add(Interval.of(math.pi / 2), _negative(_rising(np.arcsin, -1.0, 1.0)(a))),
    ca.OP_TANH: _rising(np.tanh),
    ca.OP_SINH: _rising(np.sinh),
    ca.OP_FLOOR: lambda a: Interval(np.floor(a.low), np.floor(a.high)),
    ca.OP_NOT: _not,
}
_TWO: dict[int, Callable[[Interval, Interval], Interval]] = {
    ca.OP_ADD: _add,
    ca.OP_SUB: lambda a, b: _add(a, _negative(b)),
    ca.OP_MUL: _product,
    ca.OP_DIV: lambda a, b: _product(a, _inverse(b)),
    ca.OP_FMIN: lambda a, b: Interval(np.minimum(a.low, b.low), np.minimum(a.high, b.high)),
    ca.OP_FMAX: lambda a, b: Interval(np.maximum(a.low, b.low), np.maximum(a.high, b.high)),
    ca.OP_LT: lambda a, b: _truth(a.high < b.low, a.low >= b.high),
    ca.OP_LE: lambda a, b: _truth(a.high <= b.low, a.low > b.high),
    ca.OP_EQ: _same,
    ca.OP_NE: lambda a, b: _not(_same(a, b)),
    ca.OP_AND: _and,
    ca.OP_OR: lambda a, b: _not(_and(_not(a), _not(b))),
    ca.OP_IF_ELSE_ZERO: _chosen,
}
#: What jumps: a comparison and what is made of them, and whole numbers below.
_JUMPS = (ca.OP_LT, ca.OP_LE, ca.OP_EQ, ca.OP_NE, ca.OP_AND, ca.OP_OR, ca.OP_NOT, ca.OP_FLOOR)


def enclose(function: ca.Function, inputs: Sequence[Interval], *, smooth: bool = False) -> list[Interval]:
    """Return intervals that hold every output while the inputs lie in theirs.

    Parameters
    ----------
    function : of symbols SX, dense.
    inputs : of each input, ends (size, ...): its elements in their order, by columns, then whatever is looked at side
        by side, the same of all inputs.
    smooth : whether what may jump over its interval is the whole line: what is finite then has no jump.

    Returns
    -------
    list of Interval
        Of each output, (size, ...), by columns.
    """
    shape = np.broadcast_shapes(*(each.low.shape[1:] for each in inputs)) if inputs else ()
    found = [Interval.line((function.nnz_out(i), *shape)) for i in range(function.n_out())]
    work: dict[int, Interval] = {}
    with np.errstate(all="ignore"):
        for k in range(function.n_instructions()):
            code, to = function.instruction_id(k), function.instruction_output(k)
            source = function.instruction_input(k)
            if code == ca.OP_CONST:
                work[to[0]] = Interval.of(function.instruction_constant(k))
            elif code == ca.OP_INPUT:
                given = inputs[source[0]]
                work[to[0]] = _outward(given.low[source[1]], given.high[source[1]], 0)
            elif code == ca.OP_OUTPUT:
                value = work[source[0]]
                found[to[0]].low[to[1]], found[to[0]].high[to[1]] = value.low, value.high
            elif code in _ONE:
                work[to[0]] = _ONE[code](work[source[0]])
            elif code in _TWO:
                work[to[0]] = _TWO[code](work[source[0]], work[source[1]])
            else:
                work[to[0]] = Interval.line()
            if smooth and code in _JUMPS:
                value = work[to[0]]
                work[to[0]] = _where(value.low == value.high, value)
    return found
