"""The values of a formula on the signals of a flight: expressions and their units."""

from __future__ import annotations

import difflib
from typing import Any

import casadi as ca

from casadi_gnc.errors import RequirementError
from casadi_gnc.mathematics import bounds
from casadi_gnc.missions.requirements import syntax
from casadi_gnc.missions.requirements.tokens import misplaced
from casadi_gnc.signals import Layout


def shared_unit(units: list[str | None]) -> str | None:
    """Return the unit of all; None if none has one, "" if they differ."""
    known = {unit for unit in units if unit is not None}
    return known.pop() if len(known) == 1 else "" if known else None


def called(part: syntax.Value) -> str:
    """Return what a value is called in a message."""
    if isinstance(part, syntax.Named):
        return part.name if part.element is None else f"{part.name}[{part.element}]"
    return f"{part.function}(...)" if isinstance(part, syntax.Call) else "this value"


class Quantities:
    """Make expressions of the values of one formula.

    Parameters
    ----------
    text : of the formula, for messages.
    layout, column : the signals, and the symbols that stand for one sample of them.
    """

    def __init__(self, text: str, layout: Layout, column: Any) -> None:
        self._text, self._layout, self._signals = text, layout, vars(layout.split(column))
        #: The signals that were read.
        self.names: set[str] = set()

    def _wrong(self, part: syntax.Part, told: str) -> RequirementError:
        return misplaced(self._text, part.place, told)

    def of(self, part: syntax.Value) -> tuple[ca.SX, str | None]:
        """Return the expression of a value, and its unit; None for a plain number."""
        if isinstance(part, syntax.Number):
            return ca.SX(part.number), None
        if isinstance(part, syntax.Named):
            return self.named(part)
        if isinstance(part, syntax.Vector):
            elements = [self.of(each) for each in part.elements]
            for each, (value, _) in zip(part.elements, elements, strict=True):
                if value.numel() != 1:
                    raise self._wrong(each, f"an element of a vector has {value.numel()} elements, expected one number")
            return ca.vertcat(*(value for value, _ in elements)), shared_unit([unit for _, unit in elements])
        if isinstance(part, syntax.Arithmetic):
            return self._operated(part)
        assert isinstance(part, syntax.Call)
        return self._function(part)

    def named(self, part: syntax.Named) -> tuple[ca.SX, str | None]:
        """Return a signal or an element of one, and its unit."""
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
        (left, one), (right, other) = self.of(part.left), self.of(part.right)
        if left.numel() != right.numel() and 1 not in (left.numel(), right.numel()):
            raise self._wrong(
                part, f"{called(part.left)} has {left.numel()} elements and {called(part.right)} {right.numel()}"
            )
        if part.operator == "/":
            if any(right[i].is_zero() for i in range(right.numel())):
                raise self._wrong(part.right, "a division by zero")
            return left / right, one if other is None else ""
        if part.operator == "*":
            return left * right, other if one is None else one if other is None else ""
        return (left + right if part.operator == "+" else left - right), shared_unit([one, other])

    def _function(self, part: syntax.Call) -> tuple[ca.SX, str | None]:
        given = [self.of(each) for each in part.arguments]
        values, unit = [value for value, _ in given], shared_unit([unit for _, unit in given])
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
