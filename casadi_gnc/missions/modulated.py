"""Actuators that know on and off alone: what is asked becomes pulses on board, and what these lack is carried over.

    measure -> ... -> allocate -> judge -> modulate -> advance

The allocation asks for as much of each actuator as if it could make any; the modulation makes a pulse of it, which is
what the actuator is told. Observers and anti-windup hear of the pulses, the next allocation of what was asked.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import casadi as ca

from casadi_gnc.errors import LawError
from casadi_gnc.laws import Law
from casadi_gnc.missions.wrapped import Wrapped, advanced
from casadi_gnc.signals import Layout
from casadi_gnc.status import StepStatus


class Modulation(Protocol):
    """Make pulses of what is asked."""

    @property
    def memory(self) -> Layout:
        """What is carried over from sample to sample, zero at first; it is recorded too."""
        ...

    def check(self, period: float) -> None:
        """Raise `GncError` where no such pulse can be made in a sample period [s]."""
        ...

    def __call__(self, asked: Any, carried: Any, period: float) -> tuple[Any, Any]:
        """Return what the actuators are told, (N,), and what is carried over, for a sample period [s]."""
        ...


@dataclass(frozen=True, eq=False, kw_only=True)
class Modulated(Wrapped):
    """Keep what pulses have not delivered yet, after the memory of a law.

    Parameters
    ----------
    law : commands an effort; a `Navigated` one too.
    modulation : what makes the pulses.
    """

    modulation: Modulation

    def __post_init__(self) -> None:
        own = self.modulation.memory
        for name in sorted(set(own.names) & {*self.law.memory.names, *self.law.outputs.names}):
            raise LawError(f"{type(self.modulation).__name__} and {type(self.law).__name__} both name {name!r}; rename")
        columns = {
            "inputs": self.law.inputs,
            "effort": self.law.effort,
            "memory": self.law.memory + own,
            "funnels": self.law.funnels,
            "outputs": self.law.outputs + own,
        }
        for name, value in columns.items():
            object.__setattr__(self, name, value)

    def split(self, m: Any) -> tuple[Any, Any]:
        """Return the law's memory and what is carried over."""
        own = self.law.memory.size
        return m[:own], m[own:]

    def read(self, t: Any, y: Any, m: Any) -> Any:
        """Return what the innermost law reads."""
        return super().read(t, y, self.split(m)[0])

    def start(self, t: Any, y: Any) -> Any:
        """Return the memory at the first measurement: nothing is carried over."""
        return ca.vertcat(ca.SX(self.law.start(t, y)), ca.DM.zeros(self.modulation.memory.size))

    def jump(self, t: Any, y: Any, m: Any) -> Any:
        """Return the memory after what changes at once at a sample."""
        own, carried = self.split(m)
        return ca.vertcat(self.law.jump(t, y, own), carried)

    def command(self, t: Any, y: Any, m: Any) -> Any:
        """Return the law's command."""
        return self.law.command(t, y, self.split(m)[0])

    def rate(self, t: Any, y: Any, m: Any, wanted: Any, achieved: Any) -> Any:
        """Return d(memory)/dt; what is carried over moves at samples only."""
        own, carried = self.split(m)
        return ca.vertcat(self.law.rate(t, y, own, wanted, achieved), ca.DM.zeros(carried.shape[0]))

    def advanced(self, t: Any, y: Any, m: Any, wanted: Any, achieved: Any) -> Any:
        """Return the memory one hold later; what is carried over was settled with the pulses."""
        own, carried = self.split(m)
        return ca.vertcat(advanced(self.law, t, y, own, wanted, achieved), carried)

    def status(self, t: Any, y: Any, m: Any) -> dict[StepStatus, Any]:
        """Return the law's flags."""
        return self.law.status(t, y, self.split(m)[0])

    def show(self, t: Any, y: Any, m: Any) -> dict[str, Any]:
        """Return what the law shows, and what is carried over."""
        own, carried = self.split(m)
        return {**self.law.show(t, y, own), **vars(self.modulation.memory.split(carried))}


def made_of(law: Law, modulation: Modulation | None) -> Law:
    """Return a law as it flies with a modulation, or without one."""
    if modulation is None:
        return law
    return Modulated(hold=law.hold, printed=law.printed, law=law, modulation=modulation)
