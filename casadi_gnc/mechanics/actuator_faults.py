"""Faults of actuators that grow, stay and may end.

An actuator (or a torque axis) that is told v makes e(t) v + u(t). A fault that starts at t_i grows
as b(t) = 1 - e^(-a (t - t_i)) and, if it ends, ends at once:

    e(t) = 1 - (1 - e) b(t),        u(t) = bias b(t)                                   (20)-(21)

Source: Huang and Duan (2019), section II.C, doi:10.1109/ACCESS.2019.2949285.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import casadi as ca

from casadi_gnc.errors import FlightError
from casadi_gnc.mathematics.exact import is_number, is_zero


@dataclass(frozen=True)
class ActuatorFault:
    """Describe one fault of one actuator.

    Parameters
    ----------
    actuator : number, from 1.
    effectiveness : share of the command that is made once the fault has grown, 0 to 1.
    bias : what is added once the fault has grown, unit of the command.
    start, end : [s]; without an end it stays.
    growth : a, [1/s], how fast it grows.
    group : what is numbered, for messages.

    Raises
    ------
    FlightError
        For numbers out of range, or an end that is not after the start.
    """

    actuator: int
    effectiveness: float = 1.0
    bias: float = 0.0
    start: float = 0.0
    end: float = math.inf
    growth: float = 1.0
    group: str = "actuator"

    def __post_init__(self) -> None:
        if not all(map(is_number, (self.effectiveness, self.bias, self.start, self.end, self.growth))):
            return  # symbols in the place of numbers, whose ranges whoever put them there looks after
        if not 0 <= self.effectiveness <= 1:
            raise FlightError(f"{self}: effectiveness is {self.effectiveness:g}, expected 0 (dead) to 1 (sound)")
        if not math.isfinite(self.bias):
            raise FlightError(f"{self}: bias is {self.bias}, expected a finite number")
        if not 0 <= self.start < math.inf:
            raise FlightError(f"{self}: it starts at {self.start:g} s, expected 0 s or later")
        if not self.end > self.start:
            raise FlightError(f"{self}: it ends at {self.end:g} s, before it starts at {self.start:g} s; exchange them")
        if not 0 < self.growth < math.inf:
            raise FlightError(f"{self}: its growth is {self.growth:g} 1/s, expected a positive number")

    def __str__(self) -> str:
        return f"fault of {self.group} {self.actuator}"

    @property
    def span(self) -> str:
        """When it acts, in words."""
        return f"from {self.start:g} s" + ("" if self.end == math.inf else f" to {self.end:g} s")

    def profile(self, t: Any) -> Any:
        """Return b(t): 0 before the fault, towards 1 while it grows, 0 after its end (eq. 21)."""
        grown = -ca.expm1(-self.growth * ca.if_else(t > self.start, t - self.start, 0.0))
        return grown if is_number(self.end) and self.end == math.inf else ca.if_else(t < self.end, grown, 0.0)

    @property
    def weakens(self) -> bool:
        """Whether less is made of a command than it asks."""
        return not (is_number(self.effectiveness) and self.effectiveness == 1)

    @property
    def biases(self) -> bool:
        """Whether something is added."""
        return not is_zero(self.bias)

    def clashes(self, other: ActuatorFault) -> bool:
        """Tell whether both change the same quantity of the same actuator at the same time."""
        if self.actuator != other.actuator or not all(map(is_number, (self.start, self.end, other.start, other.end))):
            return False
        same = (self.weakens and other.weakens) or (self.biases and other.biases)
        return same and self.start < other.end and other.start < self.end


@dataclass(frozen=True, eq=False)
class FaultSchedule:
    """Hold the faults of a group of actuators.

    Parameters
    ----------
    count : how many actuators there are.
    faults : in any order.

    Raises
    ------
    FlightError
        For an actuator that does not exist, or two faults that change the same thing at a time.

    Examples
    --------
    >>> schedule = FaultSchedule(3, (ActuatorFault(1, effectiveness=0.5, start=5.0),))
    >>> schedule.apply(0.0, ca.DM([1, 1, 1])), schedule.apply(100.0, ca.DM([1, 1, 1]))
    (DM([1, 1, 1]), DM([0.5, 1, 1]))
    """

    count: int
    faults: Sequence[ActuatorFault] = ()

    def __post_init__(self) -> None:
        for fault in self.faults:
            if not 1 <= fault.actuator <= self.count:
                raise FlightError(f"{fault}, but there are 1 to {self.count}")
        for one, other in combinations(self.faults, 2):
            if one.clashes(other):
                spans = " and ".join(f.span for f in (one, other))
                raise FlightError(
                    f"two faults of {one.group} {one.actuator} overlap, {spans}; end one before the other"
                )

    def apply(self, t: Any, command: Any) -> Any:
        """Return what the actuators make of a command, (count,), at time t [s]."""
        rows = [command[i] for i in range(self.count)]
        for i in range(self.count):
            own = [fault for fault in self.faults if fault.actuator == i + 1]
            lost = sum((1 - fault.effectiveness) * fault.profile(t) for fault in own if fault.weakens)
            bias = sum(fault.bias * fault.profile(t) for fault in own if fault.biases)
            rows[i] = (1 - lost) * rows[i] + bias
        return ca.vertcat(*rows)
