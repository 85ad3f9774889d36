"""Pulses of actuators that know on and off alone: one a sample, its width rounded, the rest carried over.

==========  ====================================================================================
symbol      meaning
==========  ====================================================================================
F           what is asked of an actuator for a sample, 0 to F_max, [N]
h           sample period, [s]
q, d        least difference of two widths, and least width that is not zero, a whole number of q, [s]
c           what was asked and not delivered before, [N s]
t           width of the pulse, [s]
==========  ====================================================================================

    wanted = F h + c,    t = the nearest of {0} u {d} u {q, 2 q, ... beyond d} to wanted/F_max, at most h
    told = F_max t/h,    c' = wanted - F_max t

c stays within half of F_max max(d, q), the least bit, so that at every sample what was delivered is within half a least
bit of what was asked, however long the flight: the first difference of the error is what a sigma-delta modulator
shapes. Without carrying over, c is always zero: plain modulation of the width.

**Valves** that must not be open together, and a largest number of open ones: of the pulses that are due, the one with
the largest wanted impulse is made, those that it forbids are not, then the next one, until as many are open as may be.
What a valve is not allowed stays in its c, so that its turn comes; c is at most F_max h there, one sample's worth, and
what is asked beyond that is lost.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca

from casadi_gnc.errors import AllocationError
from casadi_gnc.mathematics import bounds
from casadi_gnc.mathematics.exact import is_number, is_zero
from casadi_gnc.signals import Layout, Signal

#: How far from a whole number of quanta a least width may be, in quanta: rounding of a decimal text.
_WHOLE = 1e-4


@dataclass(frozen=True)
class Pulse:
    """Say what pulses an actuator can make.

    Parameters
    ----------
    least_on : d, [s], a whole number of quanta; 0 for none.
    quantum : q, [s], as a timer ticks; 0 for any width.
    carries : whether what a pulse lacks is carried over.
    """

    least_on: Any = 0.0
    quantum: Any = 0.0
    carries: bool = True

    def check(self, number: int, period: float) -> None:
        """Raise `AllocationError` where an actuator, counted from 1, makes no such pulse in a period [s].

        A least width that is no whole number of quanta is one that its timer cannot make.
        """
        for what, value in (("least width", self.least_on), ("quantum", self.quantum)):
            if is_number(value) and not 0 <= value <= period:
                told = f"the {what} is {value:g} s"
                raise AllocationError(f"thruster {number}: {told}, expected 0 to the period, {period:g} s")
        if is_number(self.least_on) and is_number(self.quantum) and self.quantum:
            count = self.least_on / self.quantum
            if abs(count - round(count)) > _WHOLE:
                near = [f"{k * self.quantum:.9g}" for k in (math.floor(count), math.ceil(count)) if k]
                raise AllocationError(
                    f"thruster {number}: no whole number of quanta of {self.quantum:g} s makes the least width, "
                    f"{self.least_on:g} s; give {' or '.join(near)} s"
                )

    def width(self, wanted: Any, period: float) -> Any:
        """Return t for a wanted width, both [s]."""
        width = wanted
        if not is_zero(self.quantum):
            width = self.quantum * ca.floor(wanted / self.quantum + 0.5)
        if not is_zero(self.least_on):
            short = ca.if_else(wanted < 0.5 * self.least_on, 0.0, self.least_on)
            width = ca.if_else(width < self.least_on, short, width)
        return bounds.clip(width, 0.0, period)


@dataclass(frozen=True)
class Valves:
    """Say which valves may be open together.

    Parameters
    ----------
    never_together : pairs of actuators, counted from 0.
    open_at_most : how many; any number if left out.
    """

    never_together: tuple[tuple[int, int], ...] = ()
    open_at_most: int | None = None

    def __bool__(self) -> bool:
        return bool(self.never_together) or self.open_at_most is not None

    def check(self, count: int) -> None:
        """Raise `AllocationError` where the rules are none for so many actuators."""
        for pair in self.never_together:
            if len(set(pair)) != 2 or not all(0 <= i < count for i in pair):
                told = " and ".join(str(i + 1) for i in pair)
                raise AllocationError(f"valves {told} never together: expected two different ones of 1 to {count}")
        if self.open_at_most is not None and self.open_at_most < 1:
            raise AllocationError(f"at most {self.open_at_most} valves open, expected 1 or more")

    def admitted(self, due: Sequence[Any], wanted: Sequence[Any]) -> list[Any]:
        """Return which of the pulses that are due may be made, flags, the largest wanted impulse first."""
        waiting, opened = list(due), [ca.SX(0) for _ in due]
        partners = [[sum(pair) - i for pair in self.never_together if i in pair] for i in range(len(waiting))]
        for _ in range(len(waiting) if self.open_at_most is None else min(self.open_at_most, len(waiting))):
            best, none = ca.SX(-1), ca.SX(1)
            for flag, impulse in zip(waiting, wanted, strict=True):
                best = bounds.maximum(best, ca.if_else(flag, impulse, -1))
            for i, impulse in enumerate(wanted):
                chosen = ca.logic_and(ca.logic_and(waiting[i], impulse >= best), none)
                none, opened[i] = ca.logic_and(none, ca.logic_not(chosen)), ca.logic_or(opened[i], chosen)
                for j in (i, *partners[i]):
                    waiting[j] = ca.logic_and(waiting[j], ca.logic_not(chosen))
        return opened


@dataclass(frozen=True, eq=False)
class PulseModulation:
    """Make pulses for some of the actuators; the others are told what is asked.

    Parameters
    ----------
    pulses : of each actuator; None for one that makes what it is told.
    most : F_max of each, [N].
    valves : which of the actuators that make pulses may be open together.
    """

    pulses: Sequence[Pulse | None]
    most: Sequence[Any]
    valves: Valves = Valves()

    @property
    def memory(self) -> Layout:
        """Return c of each actuator that makes pulses."""
        return Layout((Signal("impulse_carry", sum(each is not None for each in self.pulses), "N s"),))

    def check(self, period: float) -> None:
        """Raise `AllocationError` where an actuator makes no such pulse in a sample period [s]."""
        for number, pulse in enumerate((each for each in self.pulses if each is not None), 1):
            pulse.check(number, period)

    def __call__(self, asked: Any, carried: Any, period: float) -> tuple[Any, Any]:
        """Return what the actuators are told, (N,), and c', for what is asked of them, (N,)."""
        self.check(period)
        told: list[Any] = [asked[i] for i in range(len(self.pulses))]
        both = enumerate(zip(self.pulses, self.most, strict=True))
        made = [(i, pulse, most) for i, (pulse, most) in both if pulse is not None]
        wanted = [asked[i] * period + carried.impulse_carry[place] for place, (i, _, _) in enumerate(made)]
        widths = [pulse.width(each / most, period) for each, (_, pulse, most) in zip(wanted, made, strict=True)]
        if self.valves:
            widths = self._allowed(widths, wanted, [i for i, _, _ in made])
        left = []
        for (i, pulse, most), width, each in zip(made, widths, wanted, strict=True):
            told[i] = most * width / period
            rest = each - most * width
            if self.valves:
                rest = bounds.clip(rest, -most * period, most * period)
            left.append(rest if pulse.carries else ca.SX(0))
        return ca.vertcat(*told), ca.vertcat(*left)

    def _allowed(self, widths: list[Any], wanted: list[Any], places: list[int]) -> list[Any]:
        """Return the widths, zero where the valves' rules say so."""
        pairs = tuple((places.index(i), places.index(j)) for i, j in self.valves.never_together)
        rules = Valves(pairs, self.valves.open_at_most)
        opened = rules.admitted([width > 0 for width in widths], wanted)
        return [ca.if_else(flag, width, 0.0) for flag, width in zip(opened, widths, strict=True)]
