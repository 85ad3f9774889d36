"""Look for the smallest dispersion that breaks a requirement, or tell how hard was looked for it.

What is found is a break: its file flies, and its flight does not meet the requirement. What is not found proves
nothing, but where every dispersion is a choice and all combinations were flown.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

from casadi_gnc.errors import CampaignError, ProblemError
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.requirements import Requirement
from casadi_gnc.problem_files.by_name import mission_of
from casadi_gnc.problem_files.loading import load_document
from casadi_gnc.tuning.broken_case import Break, Moved, break_of, document_of, moved_of
from casadi_gnc.tuning.descending import Effort
from casadi_gnc.tuning.flights import Build, Flights, Step, Told, Trial
from casadi_gnc.tuning.journal import Journal
from casadi_gnc.tuning.objective import Objective
from casadi_gnc.tuning.reach import Kind, Reach
from casadi_gnc.tuning.searching import branches, search
from casadi_gnc.tuning.shrinking import fewest, smallest

#: Builds that `over` may ask for.
_MOST_BUILDS = 32
#: By how much a break whose own file does not break is moved away from the nominal.
_FARTHER = (1.0, 1.002, 1.01, 1.05)


@dataclass(frozen=True, eq=False)
class Falsified:
    """Tell what a search for a break came to.

    Parameters
    ----------
    mission, scheme, requirement, unit : what was flown and asked, and the unit of the robustness.
    nominal : robustness of the mission as it is.
    reach : where was searched.
    broken : the smallest break found, None for none.
    minimal : a break with as few dispersions as were found to do.
    path : where the search was, from the nominal to the smallest break.
    first : flights until the first break; None without.
    left, left_at, left_distance : the least robustness of all flights, what differs there, and how far away it is.
    flights, known : in all, and how many of them an earlier run had flown.
    effort : what was tried.
    notes : sentences on what could not be flown, or is special.
    """

    mission: str
    scheme: str
    requirement: Requirement
    unit: str
    nominal: float
    reach: Reach
    broken: Break | None
    minimal: Break | None
    path: tuple[Step, ...]
    first: int | None
    left: float
    left_at: tuple[Moved, ...]
    left_distance: float
    flights: int
    known: int
    effort: Effort
    notes: tuple[str, ...]

    @property
    def sentence(self) -> str:
        """What was found, or how hard was tried."""
        done, one = self.effort, self.requirement.id
        tried = f"{self.flights} flights: a plan of {done.plan}, {done.descents} descents"
        tried += f", {done.sampled} times sampling where no slope led on" if done.sampled else ""
        if self.broken is not None:
            return (
                f"{one} breaks at {self.broken.distance:.3g} standard deviations: {self.broken.verdict.margin}, "
                f"nominal {self.nominal:+.4g}; first found after {self.first} flights, {self.flights} in all"
            )
        where = {"contour": "the density's contour", "box": "the box", "ellipsoid": "the ellipsoid"}[self.reach.kind]
        return (
            f"no break of {one} found within {where} of {self.reach.radius:g} standard deviations; {self.left:+.4g} "
            f"is left, nominal {self.nominal:+.4g}. That is effort, not proof: {tried}"
        )

    def as_data(self) -> dict[str, Any]:
        """Return all of it as data that JSON can hold; what is not finite becomes a word."""
        return {
            "mission": self.mission,
            "scheme": self.scheme,
            "requirement": {
                "id": self.requirement.id,
                "text": self.requirement.text,
                "asked": self.requirement.asked,
                "unit": self.unit,
            },
            "verdict": "no break found" if self.broken is None else "broken",
            "sentence": self.sentence,
            "nominal_robustness": _word(self.nominal),
            "set": {"kind": self.reach.kind, "radius": self.reach.radius},
            "broken": None if self.broken is None else self.broken.as_data(),
            "minimal": None if self.minimal is None else self.minimal.as_data(),
            "least": {
                "robustness": _word(self.left),
                "distance": self.left_distance,
                "moved": [{"key": each.key, "value": each.value, "nominal": each.nominal} for each in self.left_at],
            },
            "effort": {
                "flights": self.flights,
                "flights_at_first_break": self.first,
                "plan": self.effort.plan,
                "descents": self.effort.descents,
                "sampled_without_slope": self.effort.sampled,
            },
            "path": [
                {
                    "did": each.did,
                    "flights": each.flights,
                    "robustness": _word(each.robustness),
                    "distance": each.distance,
                }
                for each in self.path
            ],
            "notes": list(self.notes),
        }


def falsify(
    problem: str | Path | Mission,
    requirement: str,
    *,
    scheme: str | None = None,
    over: Mapping[str, Sequence[Any]] | None = None,
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
        For a requirement that is not there or not met by the mission as it is, a mission without dispersion, an
        `over` of a mission that was made from objects, a journal of another search.
    """
    mission = mission_of(problem)
    chosen = mission.scheme(scheme).name
    asked = next((one for one in mission.requirements if one.id == requirement), None)
    if asked is None:
        known = ", ".join(one.id for one in mission.requirements) or "none: add a [[requirement]]"
        raise CampaignError(f"the mission has no requirement {requirement!r}; there is {known}")
    if not mission.dispersions and not over:
        raise CampaignError(
            f"nothing varies in {mission.name}: it has no [[dispersion]], so there is nothing to search; add one for "
            "each number that is not known"
        )
    if flights < 1:
        raise CampaignError(f"{flights} flights are allowed; expected 1 or more")
    builds = _builds(mission, chosen, requirement, dict(over or {}), threads)
    space = builds[0].objective.space
    reach = Reach(space, within, radius)
    place = None if out is None else Path(out)
    journal = Journal(_identity(mission, chosen, asked, over), None if place is None else Path(f"{place}.journal"))
    searched, effort = Flights(builds, space, journal, flights, told), Effort()
    nominal = _nominal(searched, asked)
    trial = search(searched, reach, seed, effort)
    first = None if trial is None else searched.count
    notes = [
        f"{', '.join(f'{key} = {value!r}' for key, value in one.changes.items())} cannot fly: {one.why}"
        for one in builds
        if one.why
    ]
    notes += _complete(searched)
    broken = minimal = None
    if trial is not None:
        near = smallest(searched, reach, trial, seed, effort)
        few = fewest(searched, reach, near)
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
        path=tuple(searched.path),
        first=first,
        left=least.value,
        left_at=moved_of(space, least, changes, {}),
        left_distance=float(space.distance(least.point)[0]),
        flights=searched.count,
        known=searched.count - searched.flown,
        effort=effort,
        notes=tuple(notes),
    )


def _builds(
    mission: Mission, scheme: str, requirement: str, over: dict[str, Sequence[Any]], threads: int | None
) -> list[Build]:
    """Return the mission and, for each combination of what `over` says, another."""
    builds = [Build(lambda: Objective(mission, scheme, what=requirement, threads=threads))]
    if not over:
        return builds
    document = document_of(mission)
    if document is None or mission.origin is None:
        raise CampaignError(f"{mission.name} was made from objects, and `over` changes a file; load one")
    before = mission.origin.changes
    count = math.prod(len(values) for values in over.values())
    if count > _MOST_BUILDS:
        raise CampaignError(f"`over` asks for {count} builds, expected at most {_MOST_BUILDS}; give fewer values")
    for values in itertools.product(*over.values()):
        changes = dict(zip(over, values, strict=True))

        def make(changes: dict[str, Any] = changes) -> Objective:
            other = load_document(document, {**before, **changes})
            return Objective(other, scheme, what=requirement, threads=threads)

        builds.append(Build(make, changes))
    return builds


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


def _word(value: float) -> float | str:
    return value if math.isfinite(value) else str(value)
