"""What every sensor has: when it looks, how late it tells, what it loses, and how its numbers walk.

A sensor names what it adds to the columns of a plant: signals that are measured, states that walk, standard normal
numbers that are drawn for every sample and held over it. Its methods are pure functions of them.

==========  ================================================================================
symbol      meaning
==========  ================================================================================
q, w        true attitude of the body from inertial, (4,), and its rate, (3,), [rad/s]
h           base period of the flight, [s]: random walks grow by their density times sqrt(h)
n           standard normal numbers, fresh at every sample
==========  ================================================================================

What is measured at sample k was true `delay` samples before; at the start of a flight, what is true then. A sensor with
a longer `period` looks at whole multiples of it; with a period, drop-outs or a limited view it has a signal NAME_valid
that is 1 where its value may be used, and 0 where it may not.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, ClassVar

import casadi as ca

from casadi_gnc.errors import FlightError
from casadi_gnc.mathematics import bounds, exact, normal
from casadi_gnc.signals import Layout, Signal

#: Longest delay, [samples]: all of them are states of the plant.
LATEST = 50


@dataclass(frozen=True, eq=False)
class Sensor:
    """Base of all sensors.

    Parameters
    ----------
    name : prefix of its signals.
    hold : base period of the flight, [s], as a mission sets it; until then 0, and no random walk.
    period : between two of its values, [s], a whole multiple of `hold`; 0: `hold`.
    dropout : chance that a value which is due does not come, 0 to below 1.
    delay : samples of the flight from the look to the value, at most `LATEST`.
    """

    #: States of the plant by which the truth that it looks at can be told.
    looks_at: ClassVar[tuple[str, ...]] = ()

    name: str
    hold: float = field(default=0.0, kw_only=True)
    period: float = field(default=0.0, kw_only=True)
    dropout: float = field(default=0.0, kw_only=True)
    delay: int = field(default=0, kw_only=True)

    def __post_init__(self) -> None:
        if self.hold and self.period and abs(self.period / self.hold - self.every) > 1e-9 * self.every:
            raise FlightError(
                f"{self.name}: a value every {self.period:g} s, expected a whole multiple of the sample period "
                f"{self.hold:g} s, at least once"
            )
        if exact.is_number(self.dropout) and not 0 <= self.dropout < 1:
            raise FlightError(f"{self.name}: the chance of a drop-out is {self.dropout:g}, expected 0 to below 1")
        if not 0 <= self.delay <= LATEST:
            raise FlightError(f"{self.name}: a delay of {self.delay} samples, expected 0 to {LATEST}")

    @property
    def every(self) -> int:
        """Samples of the flight from value to value."""
        return max(1, round(self.period / self.hold)) if self.hold else 1

    def density(self, walk: float) -> Any:
        """Return walk/sqrt(h), what a random walk makes of a normal number held over a sample; 0 before h is known."""
        return walk / exact.sqrt(self.hold) if self.hold else 0.0

    @property
    def loses(self) -> bool:
        """Whether values may not come."""
        return not exact.is_zero(self.dropout)

    @property
    def is_partial(self) -> bool:
        """Whether there is a signal NAME_valid."""
        return self.period > 0 or self.loses

    @property
    def value(self) -> Signal:
        """The signal that is measured."""
        raise TypeError(f"{type(self).__name__} defines no value")

    @property
    def measured(self) -> Layout:
        """What is added to the measurement."""
        valid = (Signal(f"{self.name}_valid", 1, "", limit=1.0),) if self.is_partial else ()
        return Layout((self.value, *valid))

    @property
    def state(self) -> Layout:
        """What is added to the plant's state."""
        return Layout()

    @property
    def noise(self) -> Layout:
        """Standard normal numbers."""
        lost = (Signal(f"{self.name}_dropout"),) if self.loses else ()
        return Layout((Signal(f"{self.name}_noise", self.value.size if self.value.size != 4 else 3), *lost))

    def start(self) -> dict[str, Any]:
        """Return the states at t = 0, by signal."""
        return {}

    def rate(self, t: Any, own: Any, drawn: Any) -> dict[str, Any]:
        """Return d(state)/dt by signal; `own` has the states by name, `drawn` the normal numbers."""
        return {}

    def read(self, truth: Any, own: Any, noise: Any) -> tuple[Any, Any]:
        """Return the value, and 1 where the truth lets it be seen, for normal numbers `noise`."""
        raise TypeError(f"{type(self).__name__} defines no read")

    def measure(self, t: Any, truth: Any, own: Any, drawn: Any) -> dict[str, Any]:
        """Return what is measured, by signal.

        Parameters
        ----------
        truth : as it was `delay` samples ago, by name: quaternion, rate, and what the sensor looks at of wheel_speed,
            magnetic_field (body, [T]), sun (unit vector, body) and sunlight (0 to 1).
        """
        value, seen = self.read(truth, own, getattr(drawn, f"{self.name}_noise"))
        found = {self.value.name: value}
        if self.is_partial:
            flags = [ca.SX(seen), self._due(t)]
            if self.loses:
                # A standard normal number is above the quantile of 1 - p with the chance p.
                least = normal.quantile_of(1 - self.dropout)
                flags.append(getattr(drawn, f"{self.name}_dropout") < least)
            found[f"{self.name}_valid"] = ca.if_else(bounds.all_of(ca.vertcat(*flags)), 1.0, 0.0)
        return found

    def _due(self, t: Any) -> Any:
        """Return whether a value is due at a sample's time; a whole number is made of it first, for rounding."""
        if self.every == 1:
            return ca.SX(1)
        sample = ca.floor(t / self.hold + 0.5)
        looked = sample - self.delay
        due = ca.fabs(looked - self.every * ca.floor((looked + 0.5) / self.every)) < 0.5
        return ca.logic_or(due, sample < 0.5) if self.delay else due
