"""What takes a mission takes the name of its file too."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from casadi_gnc import checking
from casadi_gnc.checks import Check
from casadi_gnc.errors import CampaignError, ProblemError
from casadi_gnc.missions import flying
from casadi_gnc.missions import parameters as columns
from casadi_gnc.missions.flight import Flight
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.one_build import OneBuild
from casadi_gnc.problem_files.boundary import about
from casadi_gnc.problem_files.loading import load

if TYPE_CHECKING:
    from casadi_gnc.campaigns.result import Campaign
    from casadi_gnc.checking.broken_loops import SchemeMargins
    from casadi_gnc.missions.requirements import Requirement
    from casadi_gnc.missions.sensitivities import Sensitivities


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
    with _about(problem):
        return flying.fly(mission_of(problem), scheme, **options)


def fly_all(problem: str | Path | Mission, **options: Any) -> list[Flight]:
    """Return flights of all schemes of a mission, in order.

    Parameters
    ----------
    problem : a mission, a problem file, or the name of a shipped one.
    options : as for `fly`.
    """
    with _about(problem):
        return flying.fly_all(mission_of(problem), **options)


def check(problem: str | Path | Mission, scheme: str | None = None) -> list[Check]:
    """Return all checks of a mission's schemes, or of one of them, without flying it.

    Parameters
    ----------
    problem : a mission, a problem file, or the name of a shipped one.
    scheme : its name; all of them by default.

    Examples
    --------
    >>> sorted({each.verdict for each in check("huang2020/detumble", "observer_pinv")})
    ['note', 'ok']
    """
    with _about(problem):
        return checking.check(mission_of(problem, strict=False), scheme)


def margins(problem: str | Path | Mission, scheme: str | None = None) -> list[SchemeMargins]:
    """Return the stability margins of a mission's schemes, or of one of them, linearised at its target.

    With them go the bounds of the mass centre (`SchemeMargins.mass_centre`).

    Parameters
    ----------
    problem : a mission, a problem file, or the name of a shipped one.
    scheme : its name; all of them by default.

    Raises
    ------
    FlightError
        Where a scheme has none: no target, no slope there, or a loop that is not stable.

    Examples
    --------
    >>> (found,) = margins("huang2020/slew", "pd_pinv")
    >>> found.channels["torque 1"].gain_high > 20
    True
    """
    from casadi_gnc.checking.broken_loops import scheme_margins

    with _about(problem):
        mission = mission_of(problem)
        chosen = mission.schemes if scheme is None else (mission.scheme(scheme),)
        return [scheme_margins(mission, one, mass_centre=True) for one in chosen]


def vary(
    problem: str | Path | Mission, keys: str | Sequence[str], scheme: str | None = None, **options: Any
) -> OneBuild:
    """Return one build of a scheme, which may be given by its file, that flies with any values of some numbers.

    Parameters
    ----------
    problem : a mission, a problem file, or the name of a shipped one.
    keys : paths, as of a `[[dispersion]]`; one that leads to a list stands for all numbers there.
    scheme : its name; the first one of the mission by default.
    options : engine and maths, as for `fly`.

    Examples
    --------
    >>> build = vary("huang2020/detumble", ["scheme.observer_pinv.law.rate_gain"], "observer_pinv")
    >>> [build.fly({"scheme.observer_pinv.law.rate_gain": gain}).metrics["settling_time"] for gain in (0.5, 0.6)]
    [968.7, 967.8000000000001]
    """
    with _about(problem):
        return OneBuild(columns.vary(mission_of(problem), [keys] if isinstance(keys, str) else keys, scheme), **options)


def sensitivities(
    problem: str | Path | Mission, keys: str | Sequence[str], of: str | Requirement, scheme: str | None = None
) -> Sensitivities:
    """Return what flies a scheme with derivatives of one number by some of its own; the mission may be a file's name.

    Parameters
    ----------
    problem : a mission, a problem file, or the name of a shipped one.
    keys : paths, as of a `[[dispersion]]`; one that leads to a list stands for all numbers there.
    of : the name of a metric; or a requirement or its id, whose robustness is meant.
    scheme : its name; the first one of the mission by default.

    Examples
    --------
    >>> gain = "scheme.observer_pinv.law.rate_gain"
    >>> slopes = sensitivities("huang2020/detumble", gain, "settling_time", "observer_pinv")
    >>> found = slopes.at(temperature=0.01)  # of the time at which the straight line between samples crosses
    >>> f"{found.exact:.1f} s, {found[gain]:.1f} s for each unit of the gain"
    '967.2 s, 12.2 s for each unit of the gain'
    """
    from casadi_gnc.missions.sensitivities import sensitivities as made

    with _about(problem):
        return made(mission_of(problem), keys, of, scheme)


def _about(problem: Any) -> AbstractContextManager[None]:
    """Name the file in what is wrong, where there is one."""
    return about(problem) if isinstance(problem, (str, Path)) else nullcontext()


def campaign(problem: str | Path | Mission, flights: int, **options: Any) -> Campaign:
    """Fly many cases of a mission, which may be given by the name of its file, and keep a row of each.

    Parameters
    ----------
    problem : a mission, a problem file, or the name of a shipped one.
    flights : number of cases.
    options : as for `casadi_gnc.campaigns.campaign.campaign`: scheme, dispersions, plan, seed, out, shard, audit.

    Examples
    --------
    >>> from casadi_gnc.campaigns import DispersionTable
    >>> inertia = DispersionTable(key="truth.inertia_factor", normal={"mean": 1.0, "deviation": 0.03, "truncate": 3.0})
    >>> found = campaign("huang2020/detumble", 32, scheme="observer_pinv", dispersions=[inertia])
    >>> len(found), found.worst("settling_time").fly()["rate"].shape
    (32, (15001, 3))
    """
    from casadi_gnc.campaigns.campaign import campaign as flown

    with _about(problem):
        return flown(mission_of(problem), flights, **options)


def open_campaign(folder: str | Path) -> Campaign:
    """Return a campaign that is kept in a folder, finished or not.

    Raises
    ------
    CampaignError
        For a folder without campaign, or one of a mission that was made from objects, whose code is not in the folder.
    """
    from casadi_gnc.campaigns.identity import opened
    from casadi_gnc.campaigns.ledger import read_identity

    place = Path(folder)
    identity = read_identity(place)
    if not (place / "problem.toml").exists():
        raise CampaignError(
            f"{place} is a campaign of a mission that was made from objects; run it again in Python, with "
            f"out={str(folder)!r}"
        )
    read = load(place / "problem.toml", identity["changes"], strict=False)
    return opened(replace(read, name=identity["mission"]).read_from(read.origin), place)
