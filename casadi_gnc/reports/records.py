"""Flights as a page takes them: from the flights themselves, or from what a folder keeps of them."""

from __future__ import annotations

import json
import zipfile
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from pydantic import BaseModel, ValidationError

from casadi_gnc.errors import ReportError
from casadi_gnc.missions.flight import Flight
from casadi_gnc.reports.describing import FILE
from casadi_gnc.reports.loops import FILE as LOOPS
from casadi_gnc.reports.told import ShownLoops, ShownMission, ShownScheme, Summary
from casadi_gnc.tables.wording import cut

T = TypeVar("T", bound=BaseModel)
_WITHOUT = "limits, funnels and the view in space are not drawn"


@dataclass(frozen=True, eq=False)
class Record:
    """Hold one flown scheme.

    Parameters
    ----------
    scheme : its name.
    summary : what the flight came to; None where it is lost.
    signals : (K, n) by name, `time` among them; none where the record is lost.
    units : by name of a signal.
    """

    scheme: str
    summary: Summary | None
    signals: dict[str, np.ndarray]
    units: dict[str, str]

    @property
    def time(self) -> np.ndarray:
        """Sample times, (K,), [s]."""
        return self.signals["time"][:, 0]

    @property
    def title(self) -> str:
        """What the reader is told of the scheme."""
        return self.summary.title if self.summary is not None and self.summary.title else self.scheme


@dataclass(frozen=True)
class Flown:
    """Hold what is known of the flights of a mission.

    Parameters
    ----------
    records : at least one.
    mission : what they flew; None where it is lost.
    lacking : what the reader must know to be missing, a sentence each.
    loops : what was kept of its loops and of what its actuators can make; empty where nothing was.
    """

    records: Sequence[Record]
    mission: ShownMission | None
    lacking: list[str] = field(default_factory=list)
    loops: ShownLoops = field(default_factory=ShownLoops)

    def scheme(self, name: str) -> ShownScheme | None:
        """Return what is known of a scheme beside its record."""
        return None if self.mission is None else self.mission.schemes.get(name)


def of_flights(flights: Sequence[Flight], mission: ShownMission, loops: ShownLoops) -> Flown:
    """Return flights as a page takes them."""
    records = [
        Record(
            one.scheme,
            Summary.model_validate(one.summary()),
            {name: one.block(name) for name in one},
            {name: one.unit(name) for name in one},
        )
        for one in flights
    ]
    return Flown(records, mission, loops=loops)


def is_flight_folder(folder: Path) -> bool:
    """Return whether a folder looks as if flights were kept in it."""
    return (folder / "summary.json").exists() or (folder / FILE).exists() or any(folder.glob("*.npz"))


def of_folder(folder: Path) -> Flown:
    """Return what a folder keeps of flights, and what it lacks.

    Raises
    ------
    ReportError
        Where not one record can be read.
    """
    lacking: list[str] = []
    kept = _json(folder / "summary.json", lacking, "metrics, verdicts, statuses and provenance are not known")
    told = [] if kept is None else kept.get("schemes", [])
    found = [_checked(Summary, one, "summary.json", lacking) for one in (told if isinstance(told, list) else [])]
    summaries = {one.scheme: one for one in found if one is not None}
    if kept is not None and not summaries:
        lacking.append("summary.json tells of no flight")
    content = _json(folder / FILE, lacking, _WITHOUT)
    mission = _checked(ShownMission, content, FILE, lacking) if content is not None else None
    paths = {path.stem: path for path in sorted(folder.glob("*.npz"))}
    records = []
    for name in dict.fromkeys([*summaries, *paths]):
        if name not in summaries and summaries:
            lacking.append(f"summary.json says nothing of {name}, of which there is a record")
        records.append(_record(name, paths.get(name), summaries.get(name), lacking))
    if not any(one.signals or one.summary for one in records):
        raise ReportError(
            f"{str(folder)!r} holds no flight that can be read: {'; '.join(lacking) or 'it is empty'}. Fly into it "
            "first: casadi-gnc fly PROBLEM --out FOLDER"
        )
    return Flown(records, mission, lacking, _loops(folder, lacking))


def _loops(folder: Path, lacking: list[str]) -> ShownLoops:
    """Return the loops that a folder keeps; a flight without a page keeps none."""
    if not (folder / LOOPS).exists():
        return ShownLoops()
    content = _json(folder / LOOPS, lacking, "poles, margins and attainable sets are not drawn")
    found = None if content is None else _checked(ShownLoops, content, LOOPS, lacking)
    return ShownLoops() if found is None else found


def _checked(kind: type[T], content: Any, name: str, lacking: list[str]) -> T | None:
    """Return what a file holds, of the kind that is expected; None, and a sentence more, where it is of another."""
    try:
        return kind.model_validate(content)
    except ValidationError as error:
        wrong = error.errors()[0]
        where = ".".join(map(str, wrong["loc"])) or "it"
        lacking.append(f"{name}: {cut(where, 80)}: {cut(wrong['msg'], 120)}. Another version wrote it; fly again")
        return None


def _json(path: Path, lacking: list[str], cost: str) -> dict[str, Any] | None:
    """Return an object kept in a file; None, and a sentence more, where there is none."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        lacking.append(f"{path.name} is not there: {cost}")
        return None
    except (OSError, ValueError) as error:
        lacking.append(f"{path.name} cannot be read ({cut(str(error), 120)}): {cost}")
        return None
    if not isinstance(content, dict):
        lacking.append(f"{path.name} is no object of JSON: {cost}")
        return None
    return content


def _record(name: str, path: Path | None, summary: Summary | None, lacking: list[str]) -> Record:
    """Return the record in a file; one without signals, and a sentence more, where it cannot be read."""
    if path is None:
        lacking.append(f"{name}.npz is not there: the flight of {name} is told by its numbers only")
        return Record(name, summary, {}, {})
    try:
        signals, units = _read(path)
    except (OSError, ValueError, EOFError, zipfile.BadZipFile, zlib.error) as error:
        lacking.append(f"{path.name} cannot be read ({cut(str(error), 120)}); fly again")
        return Record(name, summary, {}, {})
    return Record(name, summary, signals, units)


def _read(path: Path) -> tuple[dict[str, np.ndarray], dict[str, str]]:
    signals, units = {}, {}
    with path.open("rb") as file, np.load(file, allow_pickle=False) as kept:
        for key in kept.files:
            if key.startswith("unit_"):
                units[key.removeprefix("unit_")] = str(kept[key])
                continue
            block = np.asarray(kept[key], dtype=float)
            signals[key] = block[:, None] if block.ndim == 1 else block
    time = signals.get("time", np.empty(0))
    if time.ndim != 2 or not len(time):
        raise ValueError("it has no times")
    uneven = [key for key, block in signals.items() if block.ndim != 2 or len(block) != len(time)]
    if uneven:
        raise ValueError(f"{', '.join(uneven)} and the times differ in length")
    return signals, {key: units.get(key, "") for key in signals}
