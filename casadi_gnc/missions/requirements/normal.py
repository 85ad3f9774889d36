"""A formula on the signals of a flight: margins of its comparisons, and how they are joined over samples.

Negations are moved down to the comparisons, so that the tree takes least and largest of margins and nothing else.
A margin is how far a comparison is from changing, 0.1 - x of x <= 0.1:

* at least 0 where the comparison holds, below 0 where it does not; of a strict one between equal numbers it is -`EDGE`;
* -`BEYOND` where it is no number: what is not a number meets nothing, whichever way it is asked;
* within `BEYOND` in magnitude, which stands for infinity wherever printed C can have none.

So the sign of what comes out says whether the formula holds, without exception.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import casadi as ca

from casadi_gnc.errors import RequirementError
from casadi_gnc.mathematics import bounds
from casadi_gnc.missions.requirements import syntax
from casadi_gnc.missions.requirements.quantities import Quantities, called, shared_unit
from casadi_gnc.missions.requirements.tokens import misplaced
from casadi_gnc.missions.requirements.tree import BEYOND, Held, Join, Margin, Node, Until, Window
from casadi_gnc.signals import Layout
from casadi_gnc.status import StepStatus

#: The least magnitude of a margin that says no to a strict comparison.
EDGE = 1e-37
_CONTRARY = {"<": ">=", ">=": "<", ">": "<=", "<=": ">", "==": "!=", "!=": "=="}
#: Share of a sample by which rounding may move a time.
_ROUNDING = 1e-6


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
    binder = _Binder(text, Quantities(text, layout, column), period)
    tree = binder.node(condition, False)
    binder.refuse_infinities()
    names = frozenset(binder.values.names)
    return Bound(tree, tuple(binder.margins), shared_unit(binder.units) or "", names)


class _Binder:
    def __init__(self, text: str, values: Quantities, period: float) -> None:
        self._text, self.values, self._period = text, values, period
        self.margins: list[ca.SX] = []
        self.units: list[str | None] = []
        self.compared: list[tuple[syntax.Part, ca.SX]] = []

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
        status = self.values.named(syntax.Named(part.place, "status"))[0]
        self.units.append("")
        bit = StepStatus[part.name].value
        raised = ca.floor(status / bit) - 2 * ca.floor(status / (2 * bit))
        return ca.if_else(raised == (0 if contrary else 1), 1.0, -1.0)

    def _compared(self, part: syntax.Comparison, contrary: bool) -> ca.SX:
        sides = [self.values.of(side) for side in (part.left, part.right)]
        for side, (value, _) in zip((part.left, part.right), sides, strict=True):
            if value.numel() != 1:
                raise self._wrong(
                    side,
                    f"{called(side)} has {value.numel()} elements, and a comparison takes one number; take its norm, "
                    "max(abs(...)) or an element such as rate[1]",
                )
        self.units.append(shared_unit([unit for _, unit in sides]))
        self.compared += [(part, value) for value, _ in sides]
        return _margin(_CONTRARY[part.operator] if contrary else part.operator, sides[0][0], sides[1][0])


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


def _up(samples: float) -> int:
    return math.ceil(samples - _ROUNDING * max(1.0, samples)) if samples < 1e15 else 10**15


def _down(samples: float) -> int:
    return math.floor(samples + _ROUNDING * max(1.0, samples)) if samples < 1e15 else 10**15
