"""A case that breaks a requirement, as a problem file, and the flight of that file.

What is told of a break is what the file's own flight comes to: the file is written, read and flown like any other, and
what does not break then is not told as a break.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from casadi_gnc.campaigns.identity import texts_of
from casadi_gnc.errors import CampaignError
from casadi_gnc.missions.flight import Flight
from casadi_gnc.missions.flying import fly
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.requirements import Requirement, Verdict
from casadi_gnc.problem_files.document import Document, of_text
from casadi_gnc.problem_files.loading import load_document
from casadi_gnc.problem_files.rewriting import rewritten
from casadi_gnc.system.files import write_beside
from casadi_gnc.tuning.flights import Flights, Trial
from casadi_gnc.tuning.space import Space


@dataclass(frozen=True, eq=False)
class Moved:
    """Name what a case has otherwise than the file.

    Parameters
    ----------
    key : of a number, or of what `over` gives.
    value, nominal : in the case and in the file.
    deviations : by how many standard deviations of its own law a single number is moved; None for what has none.
    """

    key: str
    value: Any
    nominal: Any
    deviations: float | None = None


@dataclass(frozen=True, eq=False)
class Break:
    """Hold a case that breaks a requirement.

    Parameters
    ----------
    moved : what differs from the file.
    distance : from the nominal, in standard deviations; choices do not count.
    verdict : of the case's own flight.
    flight : of its file, or of the mission that it stands for.
    text : of the problem file; "" for a mission that was made from objects.
    file : where it was written.
    """

    moved: tuple[Moved, ...]
    distance: float
    verdict: Verdict
    flight: Flight = field(repr=False)
    text: str = field(repr=False)
    file: Path | None = None

    def as_data(self) -> dict[str, Any]:
        """Return the break as data that JSON can hold."""
        return {
            "robustness": self.verdict.as_data()["robustness"],
            "distance": self.distance,
            "moved": [
                {"key": each.key, "value": each.value, "nominal": each.nominal, "deviations": each.deviations}
                for each in self.moved
            ],
            "file": None if self.file is None else str(self.file),
        }


def document_of(mission: Mission) -> Document | None:
    """Return the file that a mission was read from, None where it was made from objects."""
    origin = mission.origin
    return None if origin is None else of_text(origin.folder / origin.name, origin.text)


def moved_of(space: Space, at: Trial, changes: dict[str, Any], nominal: dict[str, Any]) -> tuple[Moved, ...]:
    """Return what a flight has otherwise than the file, what moved farthest first after the choices.

    Parameters
    ----------
    space, at : of the flight.
    changes, nominal : what its build has otherwise, by key, and what the file has there.
    """
    found = [Moved(key, value, nominal.get(key)) for key, value in changes.items()]
    row = space.rows(at.point[None, :])[0]
    away = (at.point - space.start) * space.units
    numbers = []
    for group in space.groups:
        if np.isnan(at.point[group.dimensions]).any():
            continue
        for i in range(group.values.start, group.values.stop):
            if row[i] == space.nominal[i]:
                continue
            alone = not group.discrete and group.values.stop - group.values.start == 1
            deviations = float(away[group.dimensions][0]) if alone else None
            numbers.append(Moved(space.keys[i], float(row[i]), float(space.nominal[i]), deviations))
    return (*found, *sorted(numbers, key=lambda each: -abs(each.deviations or np.inf)))


def break_of(
    mission: Mission,
    scheme: str,
    requirement: Requirement,
    flights: Flights,
    at: Trial,
    file: Path | None,
    said: Sequence[str],
) -> Break | None:
    """Return the break that a flight of a search stands for; None where its own file meets the requirement.

    Parameters
    ----------
    mission : as it was given.
    scheme, requirement : what is flown and asked.
    flights, at : of the search.
    file : where it is written; None for nowhere. Nothing is written where the requirement is met.
    said : lines at the top of the file, after what is broken and by how much.

    Raises
    ------
    GncError
        Where the file cannot be written, or what it says cannot fly.
    """
    space, changes = flights.space, flights.builds[at.of].changes
    moved = moved_of(space, at, changes, {key: _at(mission, key) for key in changes})
    put = {each.key: each.value for each in moved}
    distance = float(space.distance(at.point)[0])
    document, text = document_of(mission), ""
    if document is None or mission.origin is None:
        made = flights.builds[at.of].objective.cases.varied.at(space.rows(at.point[None, :])[0])
    else:
        one = load_document(document)
        text = rewritten(document, {**mission.origin.changes, **put}, type(one.craft), leave_out=("sweep",))
        made = load_document(of_text(document.folder / (file or document.path).name, text))
    flight = fly(made, scheme)
    verdict = flight.verdicts[requirement.id]
    if verdict.met:
        return None
    head = [f"{requirement.id} ({requirement.asked}) is not met by {scheme}: {verdict.margin}", *said]
    head += [f"{distance:.4g} standard deviations from {mission.name}:"]
    head += [f"  {each.key} = {each.value!r}, there {each.nominal!r}" for each in moved]
    text = "".join(f"# {line}\n" for line in head) + "\n" + text if text else ""
    if file is not None and text:
        _write(mission, file, text)
    return Break(moved, distance, verdict, flight, text, file if text else None)


def _write(mission: Mission, file: Path, text: str) -> None:
    """Write a problem file, and beside it what it names beside itself."""
    assert mission.origin is not None
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        for name, content in texts_of(mission.origin, mission.dispersions).items():
            beside = file.parent / name
            if name == "problem.toml" or (beside.exists() and beside.read_text(encoding="utf-8") == content):
                continue
            if beside.exists():
                raise CampaignError(f"{beside} is another file than the one that the mission names; give another --out")
            beside.parent.mkdir(parents=True, exist_ok=True)
            write_beside(beside, lambda path, content=content: path.write_text(content, encoding="utf-8"))
        write_beside(file, lambda path: path.write_text(text, encoding="utf-8"))
    except OSError as error:
        raise CampaignError(f"cannot write to {str(file)!r}: {error.strerror or error}") from error


def _at(mission: Mission, key: str) -> Any:
    """Return what the file has at a key, None where it is silent."""
    document = document_of(mission)
    at: Any = {} if document is None else document.data
    for part in key.split("."):
        if isinstance(at, list):
            names = [item.get("name", item.get("id")) if isinstance(item, dict) else None for item in at]
            number = names.index(part) if part in names else int(part) - 1 if part.isdecimal() else -1
            at = at[number] if 0 <= number < len(at) else None
        else:
            at = at.get(part) if isinstance(at, dict) else None
    return at
