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
rlim, T                   lower and upper rate [1/s], (N, 2), and sample period [s]; or neither
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
from casadi_gnc.errors import AllocationError, BenchmarkError

_NAMES = ("B", "v", "plim", "rlim", "T", "u", "wu", "gamma")


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
    try:
        problem = AllocationProblem(
            matrix,
            limits[:, 0],
            limits[:, 1],
            effort_weight=np.ravel(given.get("wu", np.ones(1))) * np.ones(count),
            change_weight=0.0,
            accuracy_weight=float(np.ravel(given.get("gamma", np.array([1e6])))[0]),
        )
    except (AllocationError, ValueError) as error:
        raise BenchmarkError(f"{path}: {error}") from None
    previous = _columns(path, "u", given["u"], count) if "u" in given else _before(problem, commands)
    if len(previous) != len(commands):
        raise BenchmarkError(f"{path}: u has {len(previous)} samples, v {len(commands)}")
    samples = boxed(problem, commands, previous)
    if ("rlim" in given) != ("T" in given):
        raise BenchmarkError(f"{path}: rlim and T belong together; give both or neither")
    if "rlim" not in given:
        return samples
    rates = _shaped(path, "rlim", given["rlim"], count, 2) * float(np.ravel(given["T"])[0])
    inside = np.clip(previous, limits[:, 0], limits[:, 1])
    lower, upper = np.maximum(inside + rates[:, 0], limits[:, 0]), np.minimum(inside + rates[:, 1], limits[:, 1])
    if np.any(lower > upper):
        raise BenchmarkError(f"{path}: rlim has a lower rate above its upper one")
    return Samples(problem, commands, previous, lower, upper)


def _before(problem: AllocationProblem, commands: np.ndarray) -> np.ndarray:
    forces = np.clip(commands @ np.linalg.pinv(problem.effectiveness).T, problem.lower, problem.upper)
    start = np.clip(np.zeros(problem.count), problem.lower, problem.upper)
    return np.vstack([start, forces[:-1]])


def _table(path: Path) -> tuple[list[str], np.ndarray]:
    """Return the header's names and the numbers, (K, columns)."""
    lines = _lines(path)
    if not lines:
        raise BenchmarkError(f"{path} is empty; expected a line of column names and rows of numbers")
    names = [name.strip() for name in lines[0][1].split(",")]
    return names, _numbers(path, lines[1:], len(names))


def _numbers(path: Path, lines: list[tuple[int, str]], columns: int | None = None) -> np.ndarray:
    """Return the rows of numbered lines, all of one length."""
    rows = []
    for number, line in lines:
        try:
            row = [float(entry) for entry in line.split(",")]
        except ValueError as error:
            raise BenchmarkError(f"{path}, line {number}: {error}") from None
        columns = columns or len(row)
        if len(row) != columns or not np.all(np.isfinite(row)):
            raise BenchmarkError(f"{path}, line {number}: expected {columns} finite numbers, got {line[:60]!r}")
        rows.append(row)
    return np.array(rows).reshape(len(rows), columns or 0)


def _lines(path: Path) -> list[tuple[int, str]]:
    """Return number and text of the lines that are neither empty nor comments."""
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise BenchmarkError(f"{path} cannot be read as UTF-8 text: {error}") from None
    return [(number, line) for number, line in enumerate(lines, 1) if line.strip() and not line.startswith("#")]


def _folder(path: Path) -> dict[str, np.ndarray]:
    files = {name: path / f"{name}.csv" for name in _NAMES if (path / f"{name}.csv").is_file()}
    return {name: _numbers(file, _lines(file)) for name, file in files.items()}


def _mat(path: Path) -> dict[str, np.ndarray]:
    from scipy.io import loadmat

    try:
        content: dict[str, Any] = loadmat(str(path), variable_names=_NAMES)
    except NotImplementedError:
        raise BenchmarkError(f"{path} is of MATLAB's version 7.3; save it with -v7") from None
    except Exception as error:  # whatever the reader says of a file that is none
        raise BenchmarkError(f"{path} cannot be read as a .mat file: {error}") from None
    try:
        return {name: np.asarray(content[name], dtype=float) for name in _NAMES if name in content}
    except (TypeError, ValueError) as error:
        raise BenchmarkError(f"{path} has a variable that is no matrix of numbers: {error}") from None


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
