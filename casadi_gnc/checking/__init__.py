"""Tell from a mission, before it flies, what would go wrong.

Each module is a family: `checks(mission, scheme)` yields `Check`s. A law adds its own by
`Law.checks`, a craft by `Craft.checks`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from casadi_gnc.checking import allocation, authority, funnels, gains, geometry, noise, numbers, sampling
from casadi_gnc.checks import Check
from casadi_gnc.errors import ProblemError
from casadi_gnc.missions.mission import Mission, Scheme
from casadi_gnc.problem_files import synthesis_checks as synthesis
from casadi_gnc.problem_files.loading import load, read
from casadi_gnc.problem_files.toml_place import describe

#: Families in the order in which they are told.
FAMILIES: tuple[Callable[[Mission, Scheme], Iterable[Check]], ...] = (
    geometry.checks,
    authority.checks,
    funnels.checks,
    gains.checks,
    sampling.checks,
    noise.checks,
    allocation.checks,
    numbers.checks,
)


def check(mission: Mission, scheme: str | None = None) -> list[Check]:
    """Return all checks of a mission's schemes, or of one of them.

    Parameters
    ----------
    mission : from `casadi_gnc.load`.
    scheme : its name; all by default.

    Examples
    --------
    >>> import casadi_gnc
    >>> from casadi_gnc.checking import check
    >>> found = check(casadi_gnc.load("huang2020/slew_as_printed"), "funnel_pinv")
    >>> [each.name for each in found if each.verdict == "fail"]
    ['funnel.floor.mrp', 'gains.anti_windup', 'sampling.closed_loop']
    """
    chosen = mission.schemes if scheme is None else (mission.scheme(scheme),)
    return [
        each.of(one.name) for one in chosen for family in (*FAMILIES, mission.checks) for each in family(mission, one)
    ]


def check_file(problem: str | Path, schemes: list[str] | None = None) -> tuple[str, list[Check]]:
    """Return a title and all checks of a problem file, of a mission or of a synthesis.

    Raises
    ------
    ProblemError
        For a file that cannot be read or is of another kind.
    """
    path, text, data = read(problem)
    if data.get("kind") == "synthesis":
        return synthesis.check(problem)
    if data.get("kind") != "mission":
        message = f'kind is {data.get("kind")!r}; check takes a file of kind "mission" or "synthesis"'
        raise ProblemError(message, describe(path, text, ("kind",)))
    mission = load(problem, strict=False)
    names = schemes or [scheme.name for scheme in mission.schemes]
    return mission.title or mission.name, [each for name in names for each in check(mission, name)]


def as_data(checks: list[Check]) -> list[dict[str, Any]]:
    """Return checks as plain data; numbers that are not finite become words."""
    return [
        {
            "name": each.name,
            "scheme": each.scheme,
            "value": _plain(each.value),
            "limit": _plain(each.limit),
            "sense": "at least" if each.at_least else "at most",
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
