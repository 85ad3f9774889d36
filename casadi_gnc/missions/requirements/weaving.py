"""A formula sample by sample: what was kept, and this sample's margins, to what is kept next and the robustness so far.

What is kept has two forms. A delay line gives a number back so many samples later. A register is a number that each
sample changes: least or largest so far. The rest is a pure expression, so the same text runs in a flight's tally, as a
monitor in Python and as one in C.

A condition over an interval ahead is known when the interval has passed: every part has a delay, in samples, after
which its value at an instant is known. Least and largest over a window of w samples come of those over 1, 2, 4, ...
samples: a comparison for each, and w - 1 numbers kept in all. The formula itself is asked at the first sample alone, so
its outermost intervals need registers only, however long they are.

At the end of a flight some instants are not known yet: their intervals reach beyond it. Steps after the last sample
make them known by what there is: an instant beyond the end adds nothing to the least or the largest.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi as ca

from casadi_gnc.errors import RequirementError
from casadi_gnc.mathematics import bounds
from casadi_gnc.missions.requirements.normal import Bound
from casadi_gnc.missions.requirements.tree import BEYOND, Held, Join, Margin, Node, Until, Window

#: Verdicts of a monitor: nothing can be said yet; met, or not met, whatever comes.
OPEN, MET, NOT_MET = 0, 1, 2


@dataclass(frozen=True, eq=False)
class Line:
    """A number that comes back as `past`, `samples` later than it was `value`."""

    past: ca.SX
    value: ca.SX
    samples: int


@dataclass(frozen=True, eq=False)
class Register:
    """A number that goes from sample to sample."""

    now: ca.SX
    later: ca.SX
    initial: float


@dataclass(frozen=True, eq=False)
class Woven:
    """A formula sample by sample.

    Parameters
    ----------
    lines, registers : what is kept.
    robustness : of what is known by now, within `BEYOND`.
    verdict : `OPEN`, `MET` or `NOT_MET`.
    delay : samples after which an instant can be judged.
    horizon : the number of a sample from which on it no longer matters which one it is.
    """

    lines: tuple[Line, ...]
    registers: tuple[Register, ...]
    robustness: ca.SX
    verdict: ca.SX
    delay: int
    horizon: int

    @property
    def finish(self) -> int:
        """Steps after the last sample until all is known."""
        return max(self.delay, 1)

    @property
    def kept(self) -> int:
        """How many numbers the delay lines hold."""
        return sum(line.samples for line in self.lines)


def weave(bound: Bound, age: Any, after: Any = None) -> Woven:
    """Return a formula sample by sample.

    Parameters
    ----------
    bound : on symbols of one sample.
    age : symbol of the sample's number, from 0.
    after : symbol of how many steps ago the last sample was, 0 up to it; None where nothing comes after it.

    Raises
    ------
    RequirementError
        For an interval up to the end of the flight inside another condition over time: what it says of an instant is
        known at the end alone.
    """
    weaver = _Weaver(bound.margins, age, after)
    value, least, most = weaver.root(bound.tree)
    verdict = ca.if_else(least >= 0, MET, ca.if_else(most < 0, NOT_MET, OPEN))
    if after is not None:
        verdict = ca.if_else(after >= max(weaver.delay, 1), ca.if_else(value >= 0, MET, NOT_MET), verdict)
    lines, registers = tuple(weaver.lines), tuple(weaver.registers)
    return Woven(lines, registers, value, verdict, weaver.delay, weaver.horizon + weaver.delay + 1)


def _picked(every: bool) -> Callable[[Any, Any], Any]:
    return bounds.minimum if every else bounds.maximum


class _Weaver:
    def __init__(self, margins: tuple[ca.SX, ...], age: Any, after: Any) -> None:
        self._margins, self._age, self._after = margins, age, after
        self.lines: list[Line] = []
        self.registers: list[Register] = []
        self.delay = self.horizon = 0

    def _past(self, value: ca.SX, samples: int) -> ca.SX:
        if not samples:
            return value
        self.lines.append(Line(ca.SX.sym(f"past{len(self.lines)}"), value, samples))
        return self.lines[-1].past

    # At every instant: the value there, and after how many samples it is known.

    def _stream(self, node: Node) -> tuple[ca.SX, int]:
        value, delay = self._streamed(node)
        self.delay = max(self.delay, delay)
        return value, delay

    def _streamed(self, node: Node) -> tuple[ca.SX, int]:
        if isinstance(node, Margin):
            return self._margins[node.number], 0
        if isinstance(node, Join):
            return self._joined([self._stream(part) for part in node.parts], node.every)
        if isinstance(node, Held):
            value, delay = self._stream(node.part)
            held = self._window(value, node.samples + 1, node.every)
            return ca.if_else(self._since(delay, node.samples), held, -BEYOND if node.every else BEYOND), delay
        assert isinstance(node, (Window, Until))
        if node.last is None:
            raise RequirementError(
                "an interval up to the end of the flight stands inside another condition over time: what it says of an "
                "instant is known at the end alone. Give it an end in seconds, or move it to the outside",
                "formula",
            )
        if isinstance(node, Window):
            value, delay = self._stream(node.part)
            value = self._there(value, delay, BEYOND if node.every else -BEYOND)
            return self._window(value, node.last - node.first + 1, node.every), delay + node.last
        (keep, goal), delay = self._aligned([self._stream(node.keep), self._stream(node.goal)])
        goal = self._there(goal, delay, BEYOND if node.every else -BEYOND)
        width = node.last - node.first + 1
        found = self._reached(keep, goal, width, node.every)
        if node.first:
            before = self._past(self._window(keep, node.first, not node.every), width)
            found = _picked(not node.every)(before, found)
        return found, delay + node.last

    def _there(self, value: ca.SX, delay: int, otherwise: float) -> ca.SX:
        """Return a value that is known with a delay, and what stands in its place where its instant is past the end."""
        return value if self._after is None else ca.if_else(self._after > delay, otherwise, value)

    def _aligned(self, parts: list[tuple[ca.SX, int]]) -> tuple[list[ca.SX], int]:
        """Return the values of parts at one instant, and the delay of the slowest."""
        delay = max(each for _, each in parts)
        return [self._past(value, delay - own) for value, own in parts], delay

    def _joined(self, parts: list[tuple[ca.SX, int]], every: bool) -> tuple[ca.SX, int]:
        values, delay = self._aligned(parts)
        found = values[0]
        for value in values[1:]:
            found = _picked(every)(found, value)
        return found, delay

    def _window(self, value: ca.SX, width: int, every: bool) -> ca.SX:
        """Return the least (every) or the largest of a value and those of the width - 1 samples before it."""
        pick, reach = _picked(every), 1
        while reach < width:
            step = min(reach, width - reach)
            value, reach = pick(self._past(value, step), value), reach + step
        return value

    def _reached(self, keep: ca.SX, goal: ca.SX, width: int, every: bool) -> ca.SX:
        """Return keep until goal within the `width` samples that end here, seen from the first of them.

        Of two stretches, the one after or upon the other: the goal is reached in the first, or `keep` holds over all of
        it and the goal is reached in the second.
        """
        both, either, reach = _picked(not every), _picked(every), 1
        while reach < width:
            step = min(reach, width - reach)
            first, stays = self._past(goal, step), self._past(keep, step)
            goal, keep, reach = either(first, both(stays, goal)), both(stays, keep), reach + step
        return goal

    # At the first instant alone: what is known so far, and the least and the largest that it can become.

    def root(self, node: Node) -> tuple[ca.SX, ca.SX, ca.SX]:
        """Return the robustness so far, and the least and largest that can come of it."""
        if isinstance(node, Join) and any(_looks_ahead(part) for part in node.parts):
            parts = [self.root(part) for part in node.parts]
            found = parts[0]
            for part in parts[1:]:
                found = tuple(_picked(node.every)(one, other) for one, other in zip(found, part, strict=True))
            return found  # type: ignore[return-value]
        if isinstance(node, Until):
            return self._until(node)
        if not isinstance(node, Window):
            node = Window(True, 0, 0, node)
        value, delay = self._stream(node.part)
        so_far = self._register(BEYOND if node.every else -BEYOND)
        later = ca.if_else(self._counts(delay, node.first, node.last), _picked(node.every)(value, so_far), so_far)
        self.registers[-1] = Register(so_far, later, self.registers[-1].initial)
        done = self._done(delay, node.last)
        if node.every:
            return later, ca.if_else(done, later, -BEYOND), later
        return later, later, ca.if_else(done, later, BEYOND)

    def _until(self, node: Until) -> tuple[ca.SX, ca.SX, ca.SX]:
        """Return keep until goal; of its contrary, least and largest change places."""
        (keep, goal), delay = self._aligned([self._stream(node.keep), self._stream(node.goal)])
        both, either = _picked(not node.every), _picked(node.every)
        worst, best = (BEYOND, -BEYOND) if node.every else (-BEYOND, BEYOND)
        reached, stays = self._register(worst), self._register(best)
        later = ca.if_else(self._counts(delay, node.first, node.last), either(reached, both(goal, stays)), reached)
        kept = ca.if_else(self._counts(delay, 0, node.last), both(stays, keep), stays)
        self.registers[-2:] = [Register(reached, later, worst), Register(stays, kept, best)]
        can_become = ca.if_else(self._done(delay, node.last), later, either(later, kept))
        return (later, can_become, later) if node.every else (later, later, can_become)

    def _register(self, initial: float) -> ca.SX:
        now = ca.SX.sym(f"kept{len(self.registers)}")
        self.registers.append(Register(now, now, initial))
        return now

    def _since(self, delay: int, first: int) -> Any:
        """Return whether the instant that is known now is the `first` one or a later one."""
        self.horizon = max(self.horizon, delay + first)
        return self._age >= delay + first

    def _within(self, delay: int, first: int, last: int | None) -> Any:
        since = self._since(delay, first)
        if last is None:
            return since
        self.horizon = max(self.horizon, delay + last)
        return ca.logic_and(since, self._age <= delay + last)

    def _counts(self, delay: int, first: int, last: int | None) -> Any:
        """Return whether the instant that is known now lies in an interval and not past the end."""
        within = self._within(delay, first, last)
        return within if self._after is None else ca.logic_and(within, self._after <= delay)

    def _done(self, delay: int, last: int | None) -> Any:
        return ca.SX(0) if last is None else self._since(delay, last)


def _looks_ahead(node: Node) -> bool:
    if isinstance(node, (Window, Until)):
        return True
    return isinstance(node, Join) and any(_looks_ahead(part) for part in node.parts)
