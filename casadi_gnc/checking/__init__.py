"""Tell from a mission, before it flies, what would go wrong.

A family of checks is a function (mission, scheme) that yields `Check`s. Shipped families are modules here; a law
adds its own by `Law.checks`, a craft by `Craft.checks`, an installed package by the entry point
`casadi_gnc.checks`, a mission by `Mission.checks` (in a file: `checks = ["./mine.py:pointing"]`).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

from casadi_gnc import guests
from casadi_gnc.checks import Check
from casadi_gnc.errors import CheckError, GncError
from casadi_gnc.missions import rehearsing
from casadi_gnc.missions.checks import REGISTRY
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.scheme import Scheme

__all__ = ["REGISTRY", "Check", "as_data", "check"]


def check(mission: Mission, scheme: str | Sequence[str] | None = None) -> list[Check]:
    """Return all checks of a mission's schemes, or of one of them.

    Parameters
    ----------
    mission : from `casadi_gnc.load`, or made from objects.
    scheme : its name, or the names of several; all by default.

    Raises
    ------
    CheckError
        Where a family that is not ours fails; with its own lines.

    Examples
    --------
    >>> import casadi_gnc
    >>> found = casadi_gnc.check(casadi_gnc.load("huang2020/slew_as_printed"), "funnel_pinv")
    >>> [each.name for each in found if each.verdict == "fail"]
    ['funnel.floor.mrp', 'settling.settling_time', 'gains.anti_windup', 'sampling.closed_loop']
    """
    names = [scheme] if isinstance(scheme, str) else scheme
    chosen = mission.schemes if names is None else tuple(mission.scheme(name) for name in names)
    everywhere = [*map(REGISTRY.find, REGISTRY.names())]
    own = [family for family in mission.checks if not any(family is other for other in everywhere)]
    for one in chosen:
        if mission.craft.rehearses(mission, one):
            rehearsing.rehearsal(mission, one)
    families = [*everywhere, mission.craft.checks, *own]
    return [each.of(one.name) for one in chosen for family in families for each in _found(family, mission, one)]


def _found(family: Any, mission: Mission, scheme: Scheme) -> list[Check]:
    """Return what a family finds; an error of one that is not ours is told with its own lines."""
    try:
        found = list(family(mission, scheme))
    except GncError:
        raise
    except Exception as error:
        if _is_ours(family):
            raise
        raise CheckError(f"the check {_name(family)} failed: {guests.told(error)}") from error
    strange = [each for each in found if not isinstance(each, Check)]
    if strange:
        raise CheckError(f"the check {_name(family)} yielded a {type(strange[0]).__name__}, expected casadi_gnc.Check")
    return found


def _is_ours(family: Any) -> bool:
    return str(getattr(family, "__module__", "")).startswith("casadi_gnc.")


def _name(family: Any) -> str:
    return str(getattr(family, "__qualname__", type(family).__name__))


def as_data(checks: Iterable[Check]) -> list[dict[str, Any]]:
    """Return checks as plain data; numbers that are not finite become words."""
    return [
        {
            "name": each.name,
            "scheme": each.scheme,
            "value": _plain(each.value),
            "limit": _plain(each.limit),
            "sense": ("more than" if each.strict else "at least") if each.at_least else "at most",
            "margin": _plain(each.margin),
            "unit": each.unit,
            "verdict": each.verdict,
            "consequence": each.consequence,
            "remedy": each.remedy,
            "source": each.source,
        }
        for each in checks
    ]


def _plain(value: float) -> float | str:
    return value if math.isfinite(value) else str(value)
