"""A law as it flies with something around it, which is a law itself: nothing that flies laws need know of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from casadi_gnc.laws import Law, advance


@dataclass(frozen=True, eq=False, kw_only=True)
class Wrapped(Law):
    """Base of what flies around a law.

    Parameters
    ----------
    law : what commands.
    """

    law: Law

    @property
    def belief(self) -> Any:
        """What the law believes of the craft."""
        return self.law.belief

    def believed_inertia(self) -> Any:
        """Return the inertia that the law works with."""
        return self.law.believed_inertia()

    def check_hold(self) -> None:
        """Raise `LawError` if the law cannot work at its sample period."""
        self.law.check_hold()

    def keeps(self, signal: str) -> bool:
        """Return whether the law means to keep a signal inside its funnel."""
        return self.law.keeps(signal)

    def checks(self) -> Any:
        """Return what can be said of the law's gains alone."""
        return self.law.checks()

    def read(self, t: Any, y: Any, m: Any) -> Any:
        """Return what the innermost law reads, in its order, at a measurement and the memory of all."""
        return self.law.read(t, y, m) if isinstance(self.law, Wrapped) else y

    def advanced(self, t: Any, y: Any, m: Any, wanted: Any, achieved: Any) -> Any:
        """Return the memory one hold later."""
        raise TypeError(f"{type(self).__name__} defines no advanced")


def advanced(law: Law, t: Any, y: Any, m: Any, wanted: Any, achieved: Any) -> Any:
    """Return the memory of a law one hold later, whatever is around it."""
    if isinstance(law, Wrapped):
        return law.advanced(t, y, m, wanted, achieved)
    return advance(law, t, y, m, wanted, achieved)
