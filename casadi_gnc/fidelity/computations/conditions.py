"""A law's condition by its name."""

from __future__ import annotations

from casadi_gnc.checks import Check
from casadi_gnc.errors import FlightError, offer
from casadi_gnc.laws import Law


def condition_of(law: Law, name: str) -> Check:
    """Return a check of a law; raise `FlightError` where it has none of this name."""
    found = {check.name: check for check in law.checks()}
    if name not in found:
        raise FlightError(f"{type(law).__name__} has no condition {name!r}; {offer(name, found)}")
    return found[name]
