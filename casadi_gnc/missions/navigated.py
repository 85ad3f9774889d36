"""A law as it flies behind a navigation: both together are one law, so nothing that flies laws need know of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

from casadi_gnc.errors import LawError
from casadi_gnc.missions import asking
from casadi_gnc.missions.wrapped import Wrapped, advanced
from casadi_gnc.navigation import Navigation
from casadi_gnc.status import StepStatus


@dataclass(frozen=True, eq=False, kw_only=True)
class Navigated(Wrapped):
    """Fly a law on what a navigation makes of the measurement; its memory is the navigation's, then the law's.

    Parameters
    ----------
    law : reads signals of the navigation.
    navigation : reads the measurement.
    """

    navigation: Navigation

    def __post_init__(self) -> None:
        twice = set(self.navigation.memory.names) & set(self.law.memory.names)
        shown = set(self.navigation.outputs.names) & set(self.law.outputs.names)
        for name in sorted(twice | shown):
            raise LawError(
                f"{type(self.navigation).__name__} and {type(self.law).__name__} both name {name!r}; rename one"
            )
        if self.navigation.memory.size and not self.law.hold:
            raise LawError(f'{type(self.navigation).__name__} remembers from sample to sample; take mode = "sampled"')
        columns = {
            "inputs": self.navigation.inputs,
            "effort": self.law.effort,
            "memory": self.navigation.memory + self.law.memory,
            "funnels": self.law.funnels,
            "outputs": self.navigation.outputs + self.law.outputs,
        }
        for name, value in columns.items():
            object.__setattr__(self, name, value)

    def _parts(self, m: Any) -> tuple[Any, Any]:
        own = self.navigation.memory.size
        return m[:own], m[own:]

    def read(self, t: Any, y: Any, m: Any) -> Any:
        """Return what the law reads of the signals, in its order, at a measurement and the memory of both."""
        return self._seen(t, y, self._parts(m)[0])

    def _seen(self, t: Any, y: Any, known: Any) -> Any:
        """Return what the law reads, in its order."""
        told = asking.ask(self.navigation, "seen", t, y, known)
        signals = self.navigation.signals.split(asking.column(self.navigation, "seen", told, self.navigation.signals))
        return ca.vertcat(*(getattr(signals, name) for name in self.law.inputs.names))

    def _of_navigation(self, method: str, *arguments: Any) -> Any:
        told = asking.ask(self.navigation, method, *arguments)
        return asking.column(self.navigation, method, told, self.navigation.memory)

    def start(self, t: Any, y: Any) -> Any:
        """Return the memory at the first measurement."""
        known = self._of_navigation("start", t, y)
        return ca.vertcat(known, self.law.start(t, self._seen(t, y, known)))

    def jump(self, t: Any, y: Any, m: Any) -> Any:
        """Return the memory once the navigation knows where it is and the law has switched."""
        old, own = self._parts(m)
        known = self._of_navigation("jump", t, y, old)
        return ca.vertcat(known, self.law.jump(t, self._seen(t, y, known), own))

    def command(self, t: Any, y: Any, m: Any) -> Any:
        """Return the law's command."""
        known, own = self._parts(m)
        return self.law.command(t, self._seen(t, y, known), own)

    def rate(self, t: Any, y: Any, m: Any, wanted: Any, achieved: Any) -> Any:
        """Return d(memory)/dt; the navigation's moves at samples only."""
        known, own = self._parts(m)
        return ca.vertcat(ca.DM.zeros(known.shape[0]), self.law.rate(t, self._seen(t, y, known), own, wanted, achieved))

    def advanced(self, t: Any, y: Any, m: Any, wanted: Any, achieved: Any) -> Any:
        """Return the memory one hold later; the law sees the navigation's signals held, as it would a measurement."""
        known, own = self._parts(m)
        return ca.vertcat(known, advanced(self.law, t, self._seen(t, y, known), own, wanted, achieved))

    def status(self, t: Any, y: Any, m: Any) -> dict[StepStatus, Any]:
        """Return the flags of both."""
        known, own = self._parts(m)
        flags = asking.flags(self.navigation, "status", asking.ask(self.navigation, "status", t, y, known))
        return {**flags, **self.law.status(t, self._seen(t, y, known), own)}

    def show(self, t: Any, y: Any, m: Any) -> dict[str, Any]:
        """Return what both show."""
        known, own = self._parts(m)
        return {**self.navigation.show(t, y, known), **self.law.show(t, self._seen(t, y, known), own)}
