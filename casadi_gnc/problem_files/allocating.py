"""Allocate rows of commands, from a table or from a stream, and lay out the answers."""

from __future__ import annotations

import math
import re
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from casadi_gnc.allocation import AllocationStatus, Allocator, Answer
from casadi_gnc.allocation.allocator import Accuracy
from casadi_gnc.allocation.direction import along_direction
from casadi_gnc.allocation.impulse import with_minimum_impulse
from casadi_gnc.errors import AllocationError, ProblemError
from casadi_gnc.mathematics.arrays import real_array
from casadi_gnc.problem_files.allocation_file import AllocationCase
from casadi_gnc.system import csv_file

#: A column of commands.
_COMMAND = re.compile(r"[uU] *[0-9]+")
_SHOWN = 80


class CaseAllocator:
    """Allocate command after command with the options of an allocation file."""

    def __init__(self, case: AllocationCase, backend: str, accuracy: Accuracy = "mid") -> None:
        self.case = case
        self._accuracy: Accuracy = accuracy
        self._linear = None if case.least_propellant is None else case.least_propellant.asking(accuracy)
        if self._linear is not None and backend != "online":
            raise AllocationError(
                f'objective = "propellant" is solved by linear programs, and the back end {backend!r} is named; '
                "leave --backend out"
            )
        if self._linear is None:
            self._allocator = Allocator(case.problem, backend, accuracy=accuracy)

    def load_all(self) -> None:
        """Import what is imported when it is first needed, so that no command of a stream waits for it."""
        import_module("scipy.optimize")  # certificates of answers that are no solver's

    def solve(self, command: np.ndarray) -> Answer:
        """Return the answer to a command (R,) in its own unit; unallocated effort is in that unit too."""
        case, scaled = self.case, real_array("command", command, ProblemError) * self.case.row_scale
        started = time.perf_counter()
        if self._linear is not None:
            answer = self._linear.solve(scaled)
        elif case.least_force is not None:
            answer = with_minimum_impulse(
                case.problem,
                scaled,
                case.least_force,
                self._allocator.previous,
                backend=self._allocator.backend,
                accuracy=self._accuracy,
            )
            self._allocator.previous = answer.forces.copy()
        elif case.keep_direction:
            answer, _ = along_direction(self._allocator, scaled)
        else:
            answer = self._allocator.solve(scaled)
        seconds = time.perf_counter() - started  # all of it, certificate and linear programs included
        return replace(answer, unallocated=answer.unallocated / case.row_scale, seconds=seconds)


def read_commands(path: Path, rows: int) -> np.ndarray:
    """Return the commands of a CSV file with the columns u1 ... uR, (K, R); columns of other names may stand beside.

    Raises
    ------
    ProblemError
        For a file that cannot be read, a column that is missing, named twice or of a larger problem, a row of another
        length than the line of names, or an entry that is no number, by line and column. Entries like nan are numbers
        here; their answers say BAD_COMMAND.
    """
    names = [f"u{i}" for i in range(1, rows + 1)]
    table = csv_file.read_table(path)
    place = f"{path.name}, line {table.line}"
    lacking = [name for name in names if name not in table.names]
    if lacking:
        found = _cut(", ".join(table.names))
        raise ProblemError(
            f"column {lacking[0]} is missing in the line of names; expected {_listed(names)}, found {found}", place
        )
    further = [name for name in table.names if _COMMAND.fullmatch(name) and name not in names]
    if further:
        raise ProblemError(f"there is a column {_cut(further[0])}, and the problem takes {_listed(names)}", place)
    if not table.rows:
        raise ProblemError("has a line of names and no rows of commands", path.name)
    return np.array(table.column_numbers(names))


def _listed(names: list[str]) -> str:
    return ", ".join(names) if len(names) <= 6 else f"{names[0]} to {names[-1]}"


def _cut(text: str) -> str:
    return text if len(text) <= _SHOWN else f"{text[:_SHOWN]}..."


def parse_line(text: str, rows: int) -> np.ndarray:
    """Return the command on one line, numbers apart by commas or blanks; raise `ValueError` saying why."""
    parts = text.replace(",", " ").split()
    if len(parts) != rows:
        raise ValueError(f"expected {rows} numbers, got {len(parts)}")
    return np.array([csv_file.number(part) for part in parts])


def header(count: int, rows: int, levels: int = 0) -> list[str]:
    """Return the names of the columns of `row_of`, where answers have so many exact priorities."""
    forces = [f"F{i}" for i in range(1, count + 1)]
    missing = [f"unallocated{i}" for i in range(1, rows + 1)]
    codes = [f"saturation{i}" for i in range(1, count + 1)]
    exact = [f"level{i}_{what}" for i in range(1, levels + 1) for what in ("error", "gap")]
    return [*forces, "status", "objective", "duality_gap", "worst_vertex", "iterations", *missing, *codes, *exact]


def row_of(answer: Answer) -> list[Any]:
    """Return an answer as the entries of one row, full precision."""
    numbers = [repr(float(value)) for value in answer.forces]
    missing = [repr(float(value)) for value in answer.unallocated]
    certificate = [
        repr(float(answer.objective)),
        repr(float(answer.duality_gap)),
        answer.worst_vertex,
        answer.iterations,
    ]
    levels = [repr(float(value)) for level in answer.levels for value in (level.error, level.gap)]
    return [*numbers, answer.status.name, *certificate, *missing, *(int(code) for code in answer.saturation), *levels]


def as_data(answer: Answer) -> dict[str, Any]:
    """Return an answer as plain data for JSON; numbers that are not finite become null."""
    levels = [
        {"rows": list(level.rows), "error": _finite(level.error), "gap": _finite(level.gap)} for level in answer.levels
    ]
    return {
        "forces": [float(value) for value in answer.forces],
        "status": answer.status.name,
        "objective": _finite(answer.objective),
        "duality_gap": _finite(answer.duality_gap),
        "vertex_weights": [float(value) for value in answer.vertex_weights],
        "worst_vertex": answer.worst_vertex,
        "unallocated": [_finite(value) for value in answer.unallocated],
        "saturation": [int(code) for code in answer.saturation],
        "iterations": answer.iterations,
        **({"levels": levels} if levels else {}),
    }


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


@dataclass
class Tally:
    """Count answers, and keep how long each took and how good it was."""

    seconds: list[float] = field(default_factory=list)
    statuses: dict[str, int] = field(default_factory=dict)
    worst_gap: float | None = None
    malformed: int = 0

    def add(self, answer: Answer) -> None:
        """Count one answer."""
        self.seconds.append(answer.seconds)
        self.statuses[answer.status.name] = self.statuses.get(answer.status.name, 0) + 1
        if answer.status is not AllocationStatus.BAD_COMMAND:
            self.worst_gap = max(self.worst_gap or 0.0, answer.relative_gap)

    def summary(self) -> dict[str, Any]:
        """Return counts, the largest relative gap of all answers, and latency percentiles."""
        latency = {}
        if self.seconds:
            points = np.percentile(np.array(self.seconds) * 1e6, [50, 95, 99, 100])
            latency = {
                f"{name}_us": round(float(v), 2) for name, v in zip(("p50", "p95", "p99", "max"), points, strict=True)
            }
        return {
            "answers": len(self.seconds),
            "malformed": self.malformed,
            "statuses": self.statuses,
            "largest_relative_gap": self.worst_gap,
            "latency": latency,
        }


def allocate_all(allocator: CaseAllocator, commands: Iterable[np.ndarray], tally: Tally) -> Iterator[Answer]:
    """Yield the answer to each command in order, counted in `tally`."""
    for command in commands:
        answer = allocator.solve(command)
        tally.add(answer)
        yield answer
