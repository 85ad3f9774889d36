"""Fly a problem file once for each value of a key, as its [[sweep]] tables say.

A sweep is nothing but changed copies of the file's content, each checked like the file itself. Where the key's numbers
can be columns of the flight, one build serves all values; where a size, a limit or a choice follows from them, each
value has its own.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from casadi_gnc.errors import FlightError, ProblemError
from casadi_gnc.missions.flight import Flight
from casadi_gnc.missions.flying import fly
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.one_build import OneBuild
from casadi_gnc.missions.parameters import vary
from casadi_gnc.missions.timing import Mode
from casadi_gnc.problem_files.document import read_kind
from casadi_gnc.problem_files.loading import check_tables, load_document
from casadi_gnc.status import StepStatus
from casadi_gnc.system.files import write_beside


@dataclass(frozen=True, eq=False)
class Sweep:
    """Hold one sweep: a mission for each value.

    Parameters
    ----------
    name, key : of the sweep, and path of the key in the file.
    show : name of a metric, or of a status of which the first time is shown.
    values : what the key is set to.
    missions : one a value.
    """

    name: str
    key: str
    show: str
    values: tuple[Any, ...]
    missions: tuple[Mission, ...]

    def shown(self, flight: Flight) -> float | None:
        """Return the result of a flight that the table shows; None is never."""
        if self.show in StepStatus.__members__:
            return flight.statuses.get(StepStatus[self.show], (0, None))[1]
        return flight.metrics[self.show]


def load_sweeps(problem: str | Path) -> tuple[Sweep, ...]:
    """Return the sweeps of a problem file, none if it has no [[sweep]].

    Raises
    ------
    ProblemError
        For a bad file, a key that leads nowhere, a value that the file cannot have, a result that no flight has.
    """
    document = read_kind(problem, "mission")
    sweeps = []
    for i, table in enumerate(check_tables(document, {}).common.sweep):
        place = document.place(("sweep", i))
        missions = []
        for number, value in enumerate(table.values, 1):
            try:
                mission = load_document(document, {table.key: value})
            except ProblemError as error:
                raise ProblemError.several(
                    [(f"with {table.key} = {value!r}: {where}: {message}", place) for message, where in error.told]
                ) from None
            missions.append(replace(mission, name=f"{mission.name}_{table.name}_{number}"))
        known = [metric.name for metric in missions[0].metrics] + list(StepStatus.__members__)
        if table.show not in known:
            raise ProblemError(f"show is {table.show!r}, expected one of {', '.join(known)}", place)
        sweeps.append(Sweep(table.name, table.key, table.show, tuple(table.values), tuple(missions)))
    return tuple(sweeps)


def fly_sweep(
    sweep: Sweep, schemes: Sequence[str] = (), *, told: Callable[[int, int], None] | None = None, **options: Any
) -> list[dict[str, Flight]]:
    """Return flights by scheme for each value of a sweep; only metrics and statuses are kept of them.

    Parameters
    ----------
    sweep : from `load_sweeps`.
    schemes : names; all by default.
    told : called as told(flights flown, flights in all).
    options : as for `fly`.
    """
    names = list(schemes) or [scheme.name for scheme in sweep.missions[0].schemes]
    rows: list[dict[str, Flight]] = []
    builds = {name: _one_build(sweep, name, **options) for name in names}
    for mission, value in zip(sweep.missions, sweep.values, strict=True):
        row = {}
        for name in names:
            build, few = builds[name], mission.timing.samples
            if build is None:
                row[name] = fly(mission, name, **{**options, "decimation": few})
            else:
                values = np.full(len(build.keys), float(value))
                row[name] = build.fly_row(values, mission.noise.seed, decimation=few, told_of=mission)
            if told:
                told(len(rows) * len(names) + len(row), len(sweep.missions) * len(names))
        rows.append(row)
    return rows


def _one_build(sweep: Sweep, scheme: str, mode: Mode | None = None, **options: Any) -> OneBuild | None:
    """Return the one build that flies a scheme with any value of a sweep; None where each value needs its own."""
    if len(sweep.values) < 2 or not all(type(value) in (int, float) for value in sweep.values):
        return None
    mission = sweep.missions[0]
    try:
        return OneBuild(
            vary(mission if mode is None else mission.with_timing(mode=mode), [sweep.key], scheme), **options
        )
    except FlightError:
        return None


def save_sweeps(folder: Path, flown: Sequence[tuple[Sweep, list[dict[str, Flight]]]]) -> Path:
    """Write `summary.json` with every flight's summary; return its path."""
    content = [
        {
            "sweep": sweep.name,
            "key": sweep.key,
            "show": sweep.show,
            "values": [
                {"value": value, "schemes": [{**f.summary(), "shown": sweep.shown(f)} for f in row.values()]}
                for value, row in zip(sweep.values, rows, strict=True)
            ],
        }
        for sweep, rows in flown
    ]
    target = folder / "summary.json"
    text = json.dumps(content, indent=2, allow_nan=False) + "\n"
    write_beside(target, lambda path: path.write_text(text, encoding="utf-8"))
    return target
