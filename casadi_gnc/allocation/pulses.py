"""Pulses of actuators that know on and off alone: one a sample, its width rounded, the rest carried over.

==========  ====================================================================================
symbol      meaning
==========  ====================================================================================
F           what is asked of an actuator for a sample, 0 to F_max, [N]
h           sample period, [s]
q, d        least difference of two widths, and least width that is not zero, [s]
c           what was asked and not delivered before, [N s]
t           width of the pulse, [s]
==========  ====================================================================================

    wanted = F h + c,    t = the nearest of {0} u {d} u {q, 2 q, ... beyond d} to wanted/F_max, at most h
    told = F_max t/h,    c' = wanted - F_max t

c stays within half of F_max max(d, q), the least bit, so that at every sample what was delivered is within half a least
bit of what was asked, however long the flight: the first difference of the error is what a sigma-delta modulator
shapes. Without carrying over, c is always zero: plain modulation of the width.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca

from casadi_gnc.mathematics import bounds
from casadi_gnc.mathematics.exact import is_zero
from casadi_gnc.signals import Layout, Signal


@dataclass(frozen=True)
class Pulse:
    """Say what pulses an actuator can make.

    Parameters
    ----------
    least_on : d, [s]; 0 for none.
    quantum : q, [s]; 0 for any width.
    carries : whether what a pulse lacks is carried over.
    """

    least_on: Any = 0.0
    quantum: Any = 0.0
    carries: bool = True

    def width(self, wanted: Any, period: float) -> Any:
        """Return t for a wanted width, both [s]."""
        width = wanted
        if not is_zero(self.quantum):
            width = self.quantum * ca.floor(wanted / self.quantum + 0.5)
        if not is_zero(self.least_on):
            short = ca.if_else(wanted < 0.5 * self.least_on, 0.0, self.least_on)
            width = ca.if_else(width < self.least_on, short, width)
        return bounds.clip(width, 0.0, period)


@dataclass(frozen=True, eq=False)
class PulseModulation:
    """Make pulses for some of the actuators; the others are told what is asked.

    Parameters
    ----------
    pulses : of each actuator; None for one that makes what it is told.
    most : F_max of each, [N].
    """

    pulses: Sequence[Pulse | None]
    most: Sequence[Any]

    @property
    def memory(self) -> Layout:
        """Return c of each actuator that makes pulses."""
        return Layout((Signal("impulse_carry", sum(each is not None for each in self.pulses), "N s"),))

    def __call__(self, asked: Any, carried: Any, period: float) -> tuple[Any, Any]:
        """Return what the actuators are told, (N,), and c', for what is asked of them, (N,)."""
        told, left = [], []
        for i, (pulse, most) in enumerate(zip(self.pulses, self.most, strict=True)):
            if pulse is None:
                told.append(asked[i])
                continue
            wanted = asked[i] * period + carried.impulse_carry[len(left)]
            width = pulse.width(wanted / most, period)
            told.append(most * width / period)
            left.append(wanted - most * width if pulse.carries else ca.SX(0))
        return ca.vertcat(*told), ca.vertcat(*left)
