"""What takes a mission takes the name of its file too."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from casadi_gnc import checking
from casadi_gnc.checks import Check
from casadi_gnc.errors import ProblemError
from casadi_gnc.missions import flying
from casadi_gnc.missions.flight import Flight
from casadi_gnc.missions.mission import Mission
from casadi_gnc.problem_files.loading import load


def mission_of(problem: Any, *, strict: bool = True) -> Mission:
    """Return a mission as it is, or that of a file given by path or shipped name.

    Raises
    ------
    ProblemError
        For what is neither.
    """
    if isinstance(problem, Mission):
        return problem
    if isinstance(problem, (str, Path)):
        return load(problem, strict=strict)
    raise ProblemError(
        f"an object of type {type(problem).__name__} is no mission; expected a casadi_gnc.Mission, the path of a "
        "problem file, or the name of a shipped one"
    )


def fly(problem: str | Path | Mission, scheme: str | None = None, **options: Any) -> Flight:
    """Fly one scheme of a mission, which may be given by the name of its file.

    Parameters
    ----------
    problem : a mission, a problem file, or the name of a shipped one.
    scheme : its name; the first one of the mission by default.
    options : as for `casadi_gnc.missions.flying.fly`: engine, maths, mode, decimation, progress.

    Examples
    --------
    >>> fly("huang2020/detumble", "damping_pinv")["rate"].shape
    (15001, 3)
    """
    return flying.fly(mission_of(problem), scheme, **options)


def fly_all(problem: str | Path | Mission, **options: Any) -> list[Flight]:
    """Return flights of all schemes of a mission, in order; options as for `fly`."""
    return flying.fly_all(mission_of(problem), **options)


def check(problem: str | Path | Mission, scheme: str | None = None) -> list[Check]:
    """Return all checks of a mission's schemes, or of one of them, without flying it.

    Examples
    --------
    >>> sorted({each.verdict for each in check("huang2020/detumble", "observer_pinv")})
    ['note', 'ok']
    """
    return checking.check(mission_of(problem, strict=False), scheme)
