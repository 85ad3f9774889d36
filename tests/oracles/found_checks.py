"""One check among those that were found."""

from collections.abc import Iterable

from casadi_gnc.checks import Check


def only(found: Iterable[Check], name: str) -> Check:
    """Return the first check of a name."""
    return next(each for each in found if each.name == name)
