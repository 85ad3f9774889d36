"""What stands between the sensors and a law: estimate where the craft is, and compare with where it should be.

A `Navigation` is given the accepted measurement of every sample and returns the signals that laws read. It may
carry memory, which moves at samples only: `jump` takes an estimate from the last sample to this one and corrects
it by what was measured. A law that flies behind a navigation need not know of it.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any, ClassVar

import casadi as ca

from casadi_gnc.signals import Layout
from casadi_gnc.status import StepStatus


@dataclass(frozen=True, eq=False)
class Navigation:
    """Base of all navigations; a subclass names its columns and gives `seen`.

    Parameters
    ----------
    hold : sample period [s], which a mission sets; 0 in continuous flight, where memory is refused.
    """

    hold: float = dataclasses.field(default=0.0, kw_only=True)

    #: Measured signals that it reads, by the plant's names.
    inputs: ClassVar[Any] = Layout()
    #: What laws may read. Must be given.
    signals: ClassVar[Any] = Layout()
    #: What it carries from one sample to the next; it moves in `jump`.
    memory: ClassVar[Any] = Layout()
    #: What it shows besides, for records and plots.
    outputs: ClassVar[Any] = Layout()

    @property
    def changed(self) -> tuple[str, ...]:
        """Names of signals that are measured too and mean something else there."""
        return ()

    def start(self, t: Any, y: Any) -> Any:
        """Return the memory at the first measurement y."""
        return ca.DM.zeros(self.memory.size)

    def jump(self, t: Any, y: Any, m: Any) -> Any:
        """Return the memory at this sample, from that of the last one, or of the start, and the measurement."""
        return m

    def seen(self, t: Any, y: Any, m: Any) -> Any:
        """Return a column of `signals`, after `jump`."""
        raise TypeError(f"{type(self).__name__} defines no seen")

    def status(self, t: Any, y: Any, m: Any) -> dict[StepStatus, Any]:
        """Return flags (0 or 1 expressions) by status bit."""
        return {}

    def show(self, t: Any, y: Any, m: Any) -> dict[str, Any]:
        """Return the signals of `outputs`."""
        return {}


class Estimator:
    """Base of what estimates attitude and rate from sensors; a subclass is a frozen dataclass of its numbers."""

    #: Measured signals that it reads.
    inputs: Any = Layout()
    #: Its memory.
    memory: Any = Layout()
    #: What it shows, for records and plots.
    outputs: Any = Layout()

    def start(self, t: Any, y: Any) -> Any:
        """Return the memory at the first measurement."""
        raise TypeError(f"{type(self).__name__} defines no start")

    def jump(self, t: Any, y: Any, m: Any, hold: float) -> Any:
        """Return the memory at this sample, one sample period `hold` [s] after the last; at the start, as it is."""
        raise TypeError(f"{type(self).__name__} defines no jump")

    def estimate(self, t: Any, y: Any, m: Any) -> SimpleNamespace:
        """Return the estimated `quaternion` (4,) of the body from inertial, and its `rate` (3,), [rad/s], body axes."""
        raise TypeError(f"{type(self).__name__} defines no estimate")

    def status(self, t: Any, y: Any, m: Any) -> dict[StepStatus, Any]:
        """Return flags by status bit."""
        return {}

    def show(self, t: Any, y: Any, m: Any) -> dict[str, Any]:
        """Return the signals of `outputs`."""
        return {}


@dataclass(frozen=True, eq=False)
class Wanted:
    """Hold the attitude that is asked for at a time, and how it moves.

    Parameters
    ----------
    quaternion : (4,), scalar first, of the reference frame from inertial.
    rate : (3,), [rad/s], of the reference frame from inertial, in its own axes.
    acceleration : (3,), [rad/s^2], the derivative of that, in the same axes.
    """

    quaternion: Any
    rate: Any = dataclasses.field(default_factory=lambda: ca.DM.zeros(3))
    acceleration: Any = dataclasses.field(default_factory=lambda: ca.DM.zeros(3))


class Reference:
    """Base of what says where a craft should point; the default is to stay with the inertial frame."""

    #: Measured signals that it needs: some of position (3) [m] and velocity (3) [m/s], inertial.
    reads: Any = Layout()

    @property
    def is_inertial(self) -> bool:
        """Whether the reference frame is the inertial one, always."""
        return type(self) is Reference

    def at(self, t: Any, known: Any) -> Wanted:
        """Return what is wanted at time t [s]; `known` has the signals of `reads` by name."""
        return Wanted(ca.DM([1.0, 0.0, 0.0, 0.0]))
