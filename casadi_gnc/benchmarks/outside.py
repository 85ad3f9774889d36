"""Tables of commands, and allocation data from outside: `.mat` files and folders of CSV.

**A table of commands** for a problem that is known has the columns `u1` ... `uR`, and `p1` ... `pN` for
the forces before each; without these, they are those of the clipped pseudo-inverse for the command before.

**A .mat file** (version 7 or older) or **a folder of CSV files without headers** brings its own matrices:

========================  ==================================================================
name (`NAME.csv`)         content
========================  ==================================================================
B                         effectiveness, (R, N)
v                         commands, (R, K) or (K, R); where R = K a column is a command
plim                      lower and upper position of each actuator, (N, 2)
rlim, T                   lower and upper rate [1/s], (N, 2), and sample period [s]; or neither. Without T its first
                          period T1 is taken, which the F-18's file has
u                         positions before each sample, (N, K) or (K, N); see above without
wu, gamma                 weights of the positions, (N,), 1, and of the effort error, 1e6
========================  ==================================================================

These are the names of QCAT, so that a file saved from its workspace is read as it is.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from casadi_gnc.allocation import AllocationProblem
from casadi_gnc.errors import AllocationError, BenchmarkError, ProblemError
from casadi_gnc.mathematics.arrays import real_array
from casadi_gnc.system import csv_file

_NAMES = ("B", "v", "plim", "rlim", "T", "T1", "u", "wu", "gamma")


@dataclass(frozen=True, eq=False)
class Samples:
    """Hold K samples of one problem.

    Parameters
    ----------
    commands : (K, R).
    previous, lower, upper : (K, N), forces before each and its box.
    """

    problem: AllocationProblem
    commands: np.ndarray
    previous: np.ndarray
    lower: np.ndarray
    upper: np.ndarray

    def first(self, count: int | None) -> Samples:
        """Return the first so many of them."""
        kept = (array[:count] for array in (self.commands, self.previous, self.lower, self.upper))
        return Samples(self.problem, *kept)


def boxed(problem: AllocationProblem, commands: np.ndarray, previous: np.ndarray) -> Samples:
    """Return samples whose boxes are the problem's own: amplitude, and rate about the forces before."""
    boxes = [problem.box(last) for last in previous]
    return Samples(
        problem, commands, previous, np.array([low for low, _ in boxes]), np.array([high for _, high in boxes])
    )


def read_commands(path: Path, problem: AllocationProblem) -> Samples:
    """Return the samples of a table of commands; raise `BenchmarkError` naming column or line."""
    names, rows = _table(path)
    efforts, count = len(problem.effectiveness), problem.count
    wanted = [f"u{i}" for i in range(1, efforts + 1)]
    before = [f"p{i}" for i in range(1, count + 1)]
    if names not in (wanted, wanted + before):
        raise BenchmarkError(
            f"{path}: columns are {', '.join(names)[:80]}; expected u1 to u{efforts}, and p1 to p{count} or none"
        )
    if not len(rows):
        raise BenchmarkError(f"{path} has no commands; give at least one row of numbers")
    commands = rows[:, :efforts]
    previous = rows[:, efforts:] if len(names) > efforts else _before(problem, commands)
    return boxed(problem, commands, previous)


def read_outside(path: Path) -> Samples:
    """Return the samples of a `.mat` file or a folder of CSV files; raise `BenchmarkError` naming the defect."""
    given = _folder(path) if path.is_dir() else _mat(path)
    first = given.pop("T1", None)
    if first is not None and "rlim" in given:
        given.setdefault("T", first)
    for name in ("B", "v", "plim"):
        if name not in given:
            raise BenchmarkError(f"{path} lacks {name}; it has {', '.join(given) or 'none of the known names'}")
    for name, array in given.items():
        if not np.all(np.isfinite(array)):
            raise BenchmarkError(f"{path}: {name} has entries that are not finite")
    matrix = np.atleast_2d(given["B"])
    efforts, count = matrix.shape
    limits = _shaped(path, "plim", given["plim"], count, 2)
    commands = _columns(path, "v", given["v"], efforts)
    if not len(commands):
        raise BenchmarkError(f"{path}: v has no commands")
    weights = np.ravel(given.get("wu", np.ones(1)))
    if len(weights) not in (1, count):
        raise BenchmarkError(f"{path}: wu has {len(weights)} entries, expected 1 or {count}")
    try:
        problem = AllocationProblem(
            matrix,
            limits[:, 0],
            limits[:, 1],
            effort_weight=weights * np.ones(count),
            change_weight=0.0,
            accuracy_weight=float(np.ravel(given.get("gamma", np.array([1e6])))[0]),
        )
    except AllocationError as error:
        raise BenchmarkError(f"{path}: {error}") from None
    previous = _columns(path, "u", given["u"], count) if "u" in given else _before(problem, commands)
    if len(previous) != len(commands):
        raise BenchmarkError(f"{path}: u has {len(previous)} samples, v {len(commands)}")
    samples = boxed(problem, commands, previous)
    if ("rlim" in given) != ("T" in given):
        raise BenchmarkError(f"{path}: {_without_period(path, given)}")
    if "rlim" not in given:
        return samples
    rates = _shaped(path, "rlim", given["rlim"], count, 2) * float(np.ravel(given["T"])[0])
    inside = np.clip(previous, limits[:, 0], limits[:, 1])
    lower, upper = np.maximum(inside + rates[:, 0], limits[:, 0]), np.minimum(inside + rates[:, 1], limits[:, 1])
    if np.any(lower > upper):
        raise BenchmarkError(f"{path}: rlim has a lower rate above its upper one")
    return Samples(problem, commands, previous, lower, upper)


def _without_period(path: Path, given: dict[str, np.ndarray]) -> str:
    """Return what is wrong where either rlim or T is missing, and what there is in its place."""
    if "T" in given:
        return "rlim is missing: it belongs to T; give both or neither"
    alike = [] if path.is_dir() else [name for name in _variables(path) if name[:1] in "Tt" and name != "T"]
    found = f"; there is {', '.join(alike[:5])}: save one of them as T" if alike else ""
    return f"T, the sample period in seconds, is missing: it belongs to rlim; give both or neither{found}"


def _variables(path: Path) -> list[str]:
    """Return the names of all variables of a .mat file."""
    from scipy.io import whosmat

    return [name for name, _, _ in whosmat(str(path))]


def _before(problem: AllocationProblem, commands: np.ndarray) -> np.ndarray:
    forces = np.clip(commands @ np.linalg.pinv(problem.effectiveness).T, problem.lower, problem.upper)
    start = np.clip(np.zeros(problem.count), problem.lower, problem.upper)
    return np.vstack([start, forces[:-1]])


def _table(path: Path) -> tuple[list[str], np.ndarray]:
    """Return the header's names and the numbers, (K, columns)."""
    table = csv_file.read_table(path)
    return table.names, _finite(path, [line for line, _ in table.rows], table.column_numbers(table.names))


def _matrix(path: Path) -> np.ndarray:
    """Return the numbers of a file without a header, rows of one length."""
    rows = csv_file.read_rows(path)
    wide = len(rows[0][1]) if rows else 0
    names = [str(column) for column in range(1, wide + 1)]
    for line, row in rows:
        if len(row) != wide:
            raise ProblemError(
                f"{csv_file.entries(len(row))}, expected {wide} as in the first row", f"{path.name}, line {line}"
            )
    numbers = csv_file.Table(path, names, 0, rows).column_numbers(names)
    return _finite(path, [line for line, _ in rows], numbers).reshape(len(rows), wide)


def _finite(path: Path, lines: list[int], numbers: list[list[float]]) -> np.ndarray:
    """Return numbers as an array; raise `ProblemError` for the first line with one that is not finite."""
    found = np.array(numbers)
    for line, row in zip(lines, found, strict=True):
        if not np.all(np.isfinite(row)):
            raise ProblemError("has an entry that is not finite", f"{path.name}, line {line}")
    return found


def _folder(path: Path) -> dict[str, np.ndarray]:
    files = {name: path / f"{name}.csv" for name in _NAMES if (path / f"{name}.csv").is_file()}
    return {name: _matrix(file) for name, file in files.items()}


def _mat(path: Path) -> dict[str, np.ndarray]:
    from scipy.io import loadmat

    try:
        content: dict[str, Any] = loadmat(str(path), variable_names=_NAMES)
    except NotImplementedError:
        raise BenchmarkError(f"{path} is of MATLAB's version 7.3; save it with -v7") from None
    except Exception as error:  # whatever the reader says of a file that is none
        raise BenchmarkError(f"{path} cannot be read as a .mat file of version 7 or older") from error
    found = {}
    for name in (name for name in _NAMES if name in content):
        found[name] = real_array(f"{path}: {name}", content[name], BenchmarkError)
    return found


def _shaped(path: Path, name: str, array: np.ndarray, rows: int, columns: int) -> np.ndarray:
    if array.shape != (rows, columns):
        raise BenchmarkError(f"{path}: {name} has shape {array.shape}, expected ({rows}, {columns}) to fit B")
    return array


def _columns(path: Path, name: str, array: np.ndarray, size: int) -> np.ndarray:
    """Return samples as rows, (K, size), of a matrix that has them as columns or as rows."""
    array = np.atleast_2d(array)
    if array.shape[0] == size:
        return array.T
    if array.shape[1] == size:
        return array
    raise BenchmarkError(f"{path}: {name} has shape {array.shape}; neither side is {size}, as B asks for")
