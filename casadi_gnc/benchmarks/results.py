"""Results as lines of JSON: each cell is written when it is measured, and never written again.

The first line says what was run, by which version, on which machine; every other one is a cell. A file
may be cut anywhere: what is readable is kept, what is not is named by its line number.
"""

from __future__ import annotations

import json
import math
import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from casadi_gnc.errors import BenchmarkError, OutputError

#: Of the lines; another one is refused.
FORMAT = 1
FILE = "results.jsonl"
_KEYS = {"contestant", "family", "mode", "number", "samples", "seconds", "own", "claimed", "good"}


@dataclass(frozen=True, eq=False)
class Cell:
    """Hold one pass of a contestant through the samples of a family.

    Parameters
    ----------
    mode, number : "warm" or "cold", and which pass of those, from 0.
    samples : numbers of the samples, K of them; the lists below have as many entries.
    seconds : wall time of each solve; NaN where there was no answer.
    own : time that the contestant reports; NaN where it reports none.
    claimed, good : what it says, and what we say.
    violation, gap : our residuals; infinite where there was no answer.
    setup, first : [s]; NaN if there were none. `load` is the set-up in a new process, else NaN.
    started : seconds since the run began, when the cell was measured.
    memory_MB : largest size of the contestant's process until then.
    failures : by sample number, how it failed to answer.
    missed : of each sample, the measure that decides nothing; empty where the contest has none.
    """

    contestant: str
    family: str
    mode: str
    number: int
    samples: list[int]
    seconds: list[float]
    own: list[float]
    claimed: list[bool]
    good: list[bool]
    violation: list[float]
    gap: list[float]
    iterations: list[int]
    setup: float = math.nan
    load: float = math.nan
    first: float = math.nan
    started: float = 0.0
    memory_MB: float = math.nan
    failures: dict[str, str] = field(default_factory=dict)
    missed: list[float] = field(default_factory=list)

    @property
    def key(self) -> tuple[str, str, str, int]:
        """What a cell is known by."""
        return self.contestant, self.family, self.mode, self.number


@dataclass(frozen=True, eq=False)
class Results:
    """Hold a run.

    Parameters
    ----------
    header : contest, versions, machine, settings, families: plain data.
    cells : by key; of two with one key the later.
    corrupt : line number and what is wrong with it, of each line that was left out.
    """

    folder: Path
    header: dict[str, Any]
    cells: dict[tuple[str, str, str, int], Cell]
    corrupt: list[tuple[int, str]]

    @property
    def contestants(self) -> list[str]:
        """Names, in order of appearance."""
        return list(dict.fromkeys(cell.contestant for cell in self.cells.values()))

    def of(self, contestant: str, family: str, mode: str) -> list[Cell]:
        """Return the passes of a contestant through a family."""
        wanted = (contestant, family, mode)
        return [cell for key, cell in sorted(self.cells.items()) if key[:3] == wanted]


def encode(content: dict[str, Any]) -> str:
    """Return one line of JSON; numbers to six digits, those that are not finite as words."""
    return json.dumps(_plain(content), separators=(",", ":"), allow_nan=False) + "\n"


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _plain(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(entry) for entry in value]
    if isinstance(value, float):
        return float(f"{value:.6g}") if math.isfinite(value) else None if math.isnan(value) else "infinite"
    return value


def _numbers(values: list[Any]) -> list[float]:
    return [_number(value) for value in values]


def _number(value: Any) -> float:
    if value is None:
        return math.nan
    return math.inf if value == "infinite" else float(value)


def decode(line: str) -> Cell:
    """Return the cell of a line; raise `ValueError` with what is wrong with it."""
    try:
        data = json.loads(line)
    except json.JSONDecodeError as error:
        raise ValueError(f"is not JSON ({error.msg} at column {error.colno})") from None
    if not isinstance(data, dict) or not set(data) >= _KEYS:
        raise ValueError("is not a measurement")
    try:
        cell = Cell(**{name: _decoded(name, value) for name, value in data.items()})
        lengths = {len(getattr(cell, name)) for name in ("samples", "seconds", "own", "claimed", "good", "violation")}
    except (TypeError, ValueError) as error:
        raise ValueError(f"is not a measurement ({error})") from None
    if len(lengths) != 1:
        raise ValueError("is not a measurement (its lists differ in length)")
    return cell


def _decoded(name: str, value: Any) -> Any:
    if name in ("seconds", "own", "violation", "gap", "missed"):
        return _numbers(value)
    if name in ("setup", "load", "first", "started", "memory_MB"):
        return _number(value)
    return value


def read_results(folder: Path) -> Results:
    """Return the results in a folder.

    Raises
    ------
    BenchmarkError
        Where there are none, or they are of another format. Corrupt lines are not an error.
    """
    path = folder / FILE if folder.is_dir() else folder
    try:
        lines = path.read_bytes().split(b"\n")
    except OSError as error:
        raise BenchmarkError(
            f"no results in {str(folder)!r}: {error.strerror or error}; give a folder of a run"
        ) from None
    header = _header(lines[0], path)
    cells: dict[tuple[str, str, str, int], Cell] = {}
    corrupt = []
    for number, raw in enumerate(lines[1:], 2):
        if not raw.strip():
            continue
        try:
            cell = decode(raw.decode("utf-8"))
        except (ValueError, UnicodeDecodeError) as error:
            corrupt.append((number, str(error)))
        else:
            cells[cell.key] = cell
    return Results(path.parent, header, cells, corrupt)


def _header(raw: bytes, path: Path) -> dict[str, Any]:
    try:
        header = json.loads(raw.decode("utf-8"))
    except (ValueError, UnicodeDecodeError):
        header = None
    if not isinstance(header, dict) or "format" not in header:
        raise BenchmarkError(f"{path}, line 1: is not the header of benchmark results; choose another folder")
    if header["format"] != FORMAT:
        raise BenchmarkError(
            f"{path} has results of format {header['format']}, written by casadi-gnc {header.get('casadi_gnc', '?')}; "
            f"this version reads format {FORMAT}: use that version, or run again into another --out"
        )
    missing = {"contest", "settings", "families", "casadi_gnc", "machine"} - set(header)
    if missing:
        raise BenchmarkError(f"{path}, line 1: the header lacks {', '.join(sorted(missing))}; choose another folder")
    return header


class Writer:
    """Append lines to a results file, each on the disk before the next is measured."""

    def __init__(self, path: Path, header: dict[str, Any]) -> None:
        try:
            is_new = not path.exists() or not path.stat().st_size
            self._file = path.open("ab")
            if is_new:
                self._append(encode(header))
            elif path.read_bytes()[-1:] != b"\n":
                self._append("\n")  # a line cut short by a kill stays, and stays one line
        except OSError as error:
            raise OutputError(f"cannot write {path}: {error.strerror or error}; choose another --out") from None

    def add(self, cell: Cell) -> None:
        """Append a cell."""
        self._append(encode(vars(cell)))

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def _append(self, text: str) -> None:
        self._file.write(text.encode("utf-8"))
        self._file.flush()
        os.fsync(self._file.fileno())
