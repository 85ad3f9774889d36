"""A formula on the signals of a flight: margins of its comparisons, and how they are joined over samples.

Negations are moved down to the comparisons, so that the tree takes least and largest of margins and nothing else.
A margin is how far a comparison is from changing, 0.1 - x of x <= 0.1:

* at least 0 where the comparison holds, below 0 where it does not; of a strict one between equal numbers it is -`EDGE`;
* -`BEYOND` where it is no number: what is not a number meets nothing, whichever way it is asked;
* within `BEYOND` in magnitude, which stands for infinity wherever printed C can have none.

So the sign of what comes out says whether the formula holds, without exception.
"""

from __future__ import annotations

import difflib
import math
from dataclasses import dataclass
from typing import Any

import casadi as ca

from casadi_gnc.errors import RequirementError
from casadi_gnc.mathematics import bounds
from casadi_gnc.missions.requirements import syntax
from casadi_gnc.missions.requirements.parsing import misplaced
from casadi_gnc.signals import Layout
from casadi_gnc.status import StepStatus

#: Stands for infinity, in single precision too.
BEYOND = 1e30
#: The least magnitude of a margin that says no to a strict comparison.
EDGE = 1e-37
_CONTRARY = {"<": ">=", ">=": "<", ">": "<=", "<=": ">", "==": "!=", "!=": "=="}
#: Share of a sample by which rounding may move a time.
_ROUNDING = 1e-6


@dataclass(frozen=True)
class Node:
    """Base: a margin at every sample."""


@dataclass(frozen=True)
class Margin(Node):
    """A comparison, by its number."""

    number: int


@dataclass(frozen=True)
class Join(Node):
    """The least of several (every), or the largest."""

    every: bool
    parts: tuple[Node, ...]


@dataclass(frozen=True)
class Window(Node):
    """The least (every), or the largest, from `first` to `last` samples later; None is the end of the flight.

    Beyond the end there is nothing: an empty window is met where all of it must be, and not where some of it must.
    """

    every: bool
    first: int
    last: int | None
    part: Node


@dataclass(frozen=True)
class Held(Node):
    """The least (every) over this sample and `samples` before it, -`BEYOND` while there are fewer; or its contrary."""

    every: bool
    samples: int
    part: Node


@dataclass(frozen=True)
class Until(Node):
    """The largest, from `first` to `last` samples later, of the least of `goal` there and `keep` before.

    every: its contrary, largest and least exchanged.
    """

    every: bool
    first: int
    last: int | None
    keep: Node
    goal: Node


@dataclass(frozen=True, eq=False)
class Bound:
    """A formula on signals.

    Parameters
    ----------
    tree : how the margins are joined.
    margins : an expression for each comparison.
    unit : of the margins, "" where they differ or have none.
    names : the signals that are read.
    """

    tree: Node
    margins: tuple[ca.SX, ...]
    unit: str
    names: frozenset[str]


def bind(condition: syntax.Condition, text: str, layout: Layout, column: Any, period: float) -> Bound:
    """Return what a formula says of some signals.

    Parameters
    ----------
    condition : from `parse`.
    text : from which it was read, for messages.
    layout, column : the signals, and the symbols that stand for one sample of them.
    period : from sample to sample [s].

    Raises
    ------
    RequirementError
        For a signal that is not there, an element or a size that does not fit, an interval without a sample.
    """
    binder = _Binder(text, layout, vars(layout.split(column)), period)
    tree = binder.node(condition, False)
    binder.refuse_infinities()
    names = frozenset(binder.names)
    return Bound(tree, tuple(binder.margins), _shared(binder.units) or "", names)


def _shared(units: list[str | None]) -> str | None:
    """Return the unit of all; None if none has one, "" if they differ."""
    known = {unit for unit in units if unit is not None}
    return known.pop() if len(known) == 1 else "" if known else None


class _Binder:
    def __init__(self, text: str, layout: Layout, signals: dict[str, Any], period: float) -> None:
        self._text, self._layout, self._signals, self._period = text, layout, signals, period
        self.margins: list[ca.SX] = []
        self.units: list[str | None] = []
        self.compared: list[tuple[syntax.Part, ca.SX]] = []
        self.names: set[str] = set()

    def _wrong(self, part: syntax.Part, told: str) -> RequirementError:
        return misplaced(self._text, part.place, told)

    # Conditions.

    def node(self, part: syntax.Condition, contrary: bool) -> Node:
        """Return the tree of a condition, or of its contrary."""
        if isinstance(part, syntax.Not):
            return self.node(part.part, not contrary)
        if isinstance(part, syntax.Junction):
            return Join(part.every != contrary, tuple(self.node(each, contrary) for each in part.conditions))
        if isinstance(part, syntax.Until):
            window = self._samples(part, part.interval)
            return Until(contrary, *window, self.node(part.keep, contrary), self.node(part.goal, contrary))
        if isinstance(part, syntax.Temporal):
            if part.word == "held":
                return Held(not contrary, self._length(part), self.node(part.part, contrary))
            every = (part.word == "always") != contrary
            return Window(every, *self._samples(part, part.interval), self.node(part.part, contrary))
        if isinstance(part, syntax.Raised):
            margin = self._raised(part, contrary)
        else:
            assert isinstance(part, syntax.Comparison)
            margin = self._compared(part, contrary)
        self.margins.append(margin)
        return Margin(len(self.margins) - 1)

    def refuse_infinities(self) -> None:
        """Refuse numbers that overflow where they stand: C has no text for them."""
        if _are_finite(ca.SX(ca.vertcat(*(value for _, value in self.compared)))):
            return
        part = next(part for part, value in self.compared if not _are_finite(value))
        raise self._wrong(part, "a number in this comparison is beyond the largest there is")

    def _samples(self, part: syntax.Part, interval: syntax.Interval) -> tuple[int, int | None]:
        """Return the first and the last sample of an interval."""
        first = _up(interval.first / self._period)
        if interval.last is None:
            return first, None
        last = _down(interval.last / self._period)
        if last < first:
            raise self._wrong(
                part,
                f"no sample lies from {interval.first:g} to {interval.last:g} s; there is one every {self._period:g} s",
            )
        return first, last

    def _length(self, part: syntax.Temporal) -> int:
        """Return how many samples back a condition was held for at least so long."""
        return _up((part.interval.last or 0.0) / self._period)

    def _raised(self, part: syntax.Raised, contrary: bool) -> ca.SX:
        status = self._named(syntax.Named(part.place, "status"))[0]
        self.units.append("")
        bit = StepStatus[part.name].value
        raised = ca.floor(status / bit) - 2 * ca.floor(status / (2 * bit))
        return ca.if_else(raised == (0 if contrary else 1), 1.0, -1.0)

    def _compared(self, part: syntax.Comparison, contrary: bool) -> ca.SX:
        sides = [self._quantity(side) for side in (part.left, part.right)]
        for side, (value, _) in zip((part.left, part.right), sides, strict=True):
            if value.numel() != 1:
                raise self._wrong(
                    side,
                    f"{_called(side)} has {value.numel()} elements, and a comparison takes one number; take its norm, "
                    "max(abs(...)) or an element such as rate[1]",
                )
        self.units.append(_shared([unit for _, unit in sides]))
        self.compared += [(part, value) for value, _ in sides]
        return _margin(_CONTRARY[part.operator] if contrary else part.operator, sides[0][0], sides[1][0])

    # Values: an expression, and its unit; None for a plain number.

    def _quantity(self, part: syntax.Value) -> tuple[ca.SX, str | None]:
        if isinstance(part, syntax.Number):
            return ca.SX(part.number), None
        if isinstance(part, syntax.Named):
            return self._named(part)
        if isinstance(part, syntax.Vector):
            elements = [self._quantity(each) for each in part.elements]
            for each, (value, _) in zip(part.elements, elements, strict=True):
                if value.numel() != 1:
                    raise self._wrong(each, f"an element of a vector has {value.numel()} elements, expected one number")
            return ca.vertcat(*(value for value, _ in elements)), _shared([unit for _, unit in elements])
        if isinstance(part, syntax.Arithmetic):
            return self._operated(part)
        assert isinstance(part, syntax.Call)
        return self._function(part)

    def _named(self, part: syntax.Named) -> tuple[ca.SX, str | None]:
        if part.name not in self._layout:
            near = difflib.get_close_matches(part.name, self._layout.names, 1)
            hint = f"did you mean {near[0]}?" if near else f"there is {', '.join(self._layout.names)}"
            raise self._wrong(part, f"there is no signal {part.name!r}; {hint}")
        self.names.add(part.name)
        signal, value = self._layout.signal(part.name), ca.SX(self._signals[part.name])
        if part.element is None:
            return value, signal.unit
        if part.element > signal.size:
            count = f"{signal.size} element{'s' * (signal.size > 1)}"
            raise self._wrong(part, f"{part.name} has {count}, counted from 1; there is no {part.name}[{part.element}]")
        return value[part.element - 1], signal.unit

    def _operated(self, part: syntax.Arithmetic) -> tuple[ca.SX, str | None]:
        (left, one), (right, other) = self._quantity(part.left), self._quantity(part.right)
        if left.numel() != right.numel() and 1 not in (left.numel(), right.numel()):
            raise self._wrong(
                part, f"{_called(part.left)} has {left.numel()} elements and {_called(part.right)} {right.numel()}"
            )
        if part.operator == "/":
            if any(right[i].is_zero() for i in range(right.numel())):
                raise self._wrong(part.right, "a division by zero")
            return left / right, one if other is None else ""
        if part.operator == "*":
            return left * right, other if one is None else one if other is None else ""
        return (left + right if part.operator == "+" else left - right), _shared([one, other])

    def _function(self, part: syntax.Call) -> tuple[ca.SX, str | None]:
        given = [self._quantity(each) for each in part.arguments]
        values, unit = [value for value, _ in given], _shared([unit for _, unit in given])
        expected = {"norm": 1, "abs": 1, "sqrt": 1, "dot": 2}.get(part.function, len(values))
        if len(values) != expected:
            raise self._wrong(
                part, f"{part.function} takes {expected} argument{'s' * (expected > 1)}, got {len(values)}"
            )
        if part.function == "abs":
            return ca.fabs(values[0]), unit
        if part.function == "sqrt":
            return ca.sqrt(values[0]), ""
        if part.function == "norm":
            return ca.sqrt(_sum(values[0] * values[0])), unit
        if part.function == "dot":
            if values[0].numel() != values[1].numel():
                raise self._wrong(part, f"dot of {values[0].numel()} and {values[1].numel()} elements")
            return _sum(values[0] * values[1]), ""
        numbers = ca.vertcat(*values)
        best = bounds.maximum if part.function == "max" else bounds.minimum
        found = numbers[0]
        for i in range(1, numbers.numel()):
            found = best(numbers[i], found)
        return found, unit


def _sum(terms: ca.SX) -> ca.SX:
    """Return the sum of the elements, from the first on."""
    total = terms[0]
    for i in range(1, terms.numel()):
        total = total + terms[i]
    return total


def _are_finite(values: ca.SX) -> bool:
    """Return whether all numbers that stand in expressions are finite."""
    tape = ca.Function("values", [ca.vertcat(*ca.symvar(values))], [values])
    constants = [k for k in range(tape.n_instructions()) if tape.instruction_id(k) == ca.OP_CONST]
    return all(math.isfinite(tape.instruction_constant(k)) for k in constants)


def _margin(operator: str, a: ca.SX, b: ca.SX) -> ca.SX:
    """Return the margin of a comparison, as the head of this file says."""
    apart = {"<": b - a, "<=": b - a, ">": a - b, ">=": a - b, "!=": ca.fabs(a - b), "==": 0 - ca.fabs(a - b)}[operator]
    margin = ca.if_else(ca.fabs(apart) <= BEYOND, apart, ca.if_else(apart > 0, BEYOND, -BEYOND))
    return ca.if_else(margin > 0, margin, bounds.minimum(margin, -EDGE)) if operator in ("<", ">", "!=") else margin


def _called(part: syntax.Value) -> str:
    """Return what a value is called in a message."""
    if isinstance(part, syntax.Named):
        return part.name if part.element is None else f"{part.name}[{part.element}]"
    return f"{part.function}(...)" if isinstance(part, syntax.Call) else "this value"


def _up(samples: float) -> int:
    return math.ceil(samples - _ROUNDING * max(1.0, samples)) if samples < 1e15 else 10**15


def _down(samples: float) -> int:
    return math.floor(samples + _ROUNDING * max(1.0, samples)) if samples < 1e15 else 10**15
