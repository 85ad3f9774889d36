"""Look for the smallest dispersion that breaks a requirement, or tell how hard was looked for it.

What is found is a break: its file flies, and its flight does not meet the requirement. What is not found proves
nothing, but where every dispersion is a choice and all combinations were flown.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

from casadi_gnc.errors import CampaignError, ProblemError
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.requirements import Requirement
from casadi_gnc.problem_files.by_name import mission_of
from casadi_gnc.tuning.broken_case import Break, break_of, moved_of
from casadi_gnc.tuning.builds import builds_of
from casadi_gnc.tuning.certificate import Certificate, certificate
from casadi_gnc.tuning.claims import Claimant, claimed
from casadi_gnc.tuning.descending import Effort
from casadi_gnc.tuning.falsified import Falsified
from casadi_gnc.tuning.flights import Flights, Told, Trial
from casadi_gnc.tuning.journal import Journal
from casadi_gnc.tuning.reach import Kind, Reach
from casadi_gnc.tuning.searching import branches, search
from casadi_gnc.tuning.shrinking import fewest, smallest, way_to

#: By how much a break whose own file does not break is moved away from the nominal.
_FARTHER = (1.0, 1.002, 1.01, 1.05)


def falsify(
    problem: str | Path | Mission,
    requirement: str,
    *,
    scheme: str | None = None,
    over: Mapping[str, Sequence[Any]] | None = None,
    claims: Sequence[Claimant] = (),
    within: Kind = "contour",
    radius: float = 4.0,
    flights: int = 1000,
    seed: int = 0,
    out: str | Path | None = None,
    threads: int | None = None,
    told: Told | None = None,
) -> Falsified:
    """Look for the smallest dispersion of a mission that breaks a requirement.

    Parameters
    ----------
    problem : a mission with dispersions, a problem file, or the name of a shipped one.
    requirement : its id.
    scheme : which one flies; the first by default.
    over : values of further keys of the file, a build each, such as {"timing.sample_period_s": [0.1, 0.2]}: sizes,
        sample periods and what else cannot be dispersed. All combinations are flown.
    claims : "allocation" and "theorem": search also all of what the scheme's allocation is set up against, or what the
        theorem of its law covers (`casadi_gnc.tuning.claims`).
    within : "contour", "box" or "ellipsoid" (`casadi_gnc.tuning.reach`).
    radius : of that set, in standard deviations of what is normal.
    flights : at most.
    seed : of the plan. Each flight has the noise of the mission's own seed.
    out : problem file of the smallest break; the one with the fewest dispersions is beside it, with `.minimal` in its
        name, and the journal from which a killed search goes on, with `.journal` at its end.
    threads : all cores by default.
    told : called with the number of flights done, and at most.

    Raises
    ------
    GncError
        For a requirement that is not there or not met by the mission as it is, a mission without dispersion, a claim
        of nothing, an `over` of a mission that was made from objects, a journal of another search.
    """
    mission = mission_of(problem)
    chosen = mission.scheme(scheme).name
    asked = next((one for one in mission.requirements if one.id == requirement), None)
    if asked is None:
        known = ", ".join(one.id for one in mission.requirements) or "none: add a [[requirement]]"
        raise CampaignError(f"the mission has no requirement {requirement!r}; there is {known}")
    mission, notes = claimed(mission, chosen, claims)
    if not mission.dispersions and not over:
        raise CampaignError(
            f"nothing varies in {mission.name}: it has no [[dispersion]], so there is nothing to search; add one for "
            "each number that is not known"
        )
    if flights < 1:
        raise CampaignError(f"{flights} flights are allowed; expected 1 or more")
    builds = builds_of(mission, chosen, requirement, dict(over or {}), claims, threads)
    space = builds[0].objective.space
    reach = Reach(space, within, radius)
    place = None if out is None else Path(out)
    journal = Journal(_identity(mission, chosen, asked, over), None if place is None else Path(f"{place}.journal"))
    searched, effort = Flights(builds, space, journal, flights, told), Effort()
    nominal = _nominal(searched, asked)
    trial = search(searched, reach, seed, effort)
    first = None if trial is None else searched.count
    notes += [
        f"{', '.join(f'{key} = {value!r}' for key, value in one.changes.items())} cannot fly: {one.why}"
        for one in builds
        if one.why
    ]
    notes += _complete(searched)
    broken = minimal = None
    way = ()
    if trial is not None:
        near = smallest(searched, reach, trial, seed, effort)
        few, way = fewest(searched, reach, near), way_to(searched, near)
        said = [f"found by casadi-gnc falsify after {first} flights"]
        for at in (near, trial):
            try:
                broken = broken or _verified(mission, chosen, asked, searched, reach, at, place, said)
            except ProblemError as error:
                notes.append(f"a case that broke among many flights is refused as a file: {error}")
        beside = None if place is None else place.with_suffix(f".minimal{place.suffix}")
        if broken is not None:
            minimal = _verified(mission, chosen, asked, searched, reach, few, beside, said) or broken
        else:
            notes.append("what broke among many flights did not break as a file of its own, and is no break")
            first = None
    proved = None
    if broken is None:
        cases = builds[0].objective.cases
        proved = certificate(cases.varied, space, reach, asked)
        if len(builds) > 1:
            proved = Certificate(asked.id, why="`over` asks for other files, and what is proved is of one")
    least = searched.lowest
    assert least is not None
    changes = builds[least.of].changes
    return Falsified(
        mission=mission.name,
        scheme=chosen,
        requirement=asked,
        unit="" if broken is None else broken.verdict.unit,
        nominal=nominal,
        reach=reach,
        broken=broken,
        minimal=minimal,
        proved=proved,
        path=tuple(searched.path),
        way=way if broken is not None else (),
        first=first,
        left=least.value,
        left_at=moved_of(space, least, changes, {}),
        left_distance=float(space.distance(least.point)[0]),
        flights=searched.count,
        known=searched.count - searched.flown,
        effort=effort,
        notes=tuple(notes),
    )


def _identity(
    mission: Mission, scheme: str, requirement: Requirement, over: Mapping[str, Sequence[Any]] | None
) -> dict[str, Any]:
    """Return what the numbers of flights follow from."""
    return {
        "problem_sha256": mission.digest,
        "dispersions": [repr(each) for each in mission.dispersions],
        "scheme": scheme,
        "requirement": repr(requirement),
        "over": {key: list(values) for key, values in (over or {}).items()},
        "noise_seed": mission.noise.seed,
        "casadi_gnc": metadata.version("casadi-gnc"),
    }


def _nominal(flights: Flights, requirement: Requirement) -> float:
    """Return the robustness of the mission as it is; raise `CampaignError` where there is nothing to look for."""
    value = float(flights.fly(0, np.full((1, flights.space.size), np.nan))[0])
    if value < 0:
        raise CampaignError(
            f"{requirement.id} is not met by the mission as it is: {value:+.4g}; there is no dispersion to look for. "
            "Fly it, and mend that first"
        )
    if math.isinf(value):
        raise CampaignError(
            f"{requirement.id} has no finite robustness in the mission as it is: nothing bounds it, or it cannot fly "
            "among dispersed cases; there is nothing to go down from"
        )
    return value


def _complete(flights: Flights) -> list[str]:
    """Return a sentence where every dispersion is a choice."""
    space = flights.space
    if not space.discrete.all():
        return []
    choices = sum(1 for each in space.groups if each.discrete) + (len(flights.builds) > 1)
    number = 1 + sum(sum(1 for _ in branches(flights, changes)) for changes in range(1, choices + 1))
    told = f"every dispersion is a choice, so there is nothing to go down: {number} combinations"
    return [f"{told}, all flown" if flights.count >= number else f"{told}, {flights.count} flown"]


def _verified(
    mission: Mission,
    scheme: str,
    requirement: Requirement,
    flights: Flights,
    reach: Reach,
    at: Trial,
    file: Path | None,
    said: Sequence[str],
) -> Break | None:
    """Return the break at a flight or just beyond it, whose own file breaks; None where none does."""
    space = flights.space
    for farther in _FARTHER:
        moved = reach.nearest((space.start + farther * (at.point - space.start))[None, :])[0]
        point = np.where(space.discrete, at.point, moved)
        found = break_of(mission, scheme, requirement, flights, Trial(at.of, point, at.value), file, said)
        if found is not None:
            return found
    return None
