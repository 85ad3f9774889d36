"""Generate the package of a CasADi function: C, vectors that it answers, README, and the function itself."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np

from casadi_gnc.delivery import making
from casadi_gnc.delivery.packaging import REALS, STEPS, found_boards, made_by, pack
from casadi_gnc.delivery.vectors import BAD
from casadi_gnc.embedded import flight_function, package
from casadi_gnc.embedded.compare import as_words
from casadi_gnc.embedded.controller import Options
from casadi_gnc.embedded.flight_function import FlightFunction
from casadi_gnc.embedded.function_source import common, function_files
from casadi_gnc.embedded.host import HostPackage
from casadi_gnc.embedded.manifest import MOST_STEPS, digest
from casadi_gnc.embedded.members import access
from casadi_gnc.embedded.packable import PackableFunction
from casadi_gnc.errors import PackageError, ProblemError
from casadi_gnc.mathematics.noise import uniforms
from casadi_gnc.missions.fault_handling import FaultHandling
from casadi_gnc.system.csv_file import read_table
from casadi_gnc.system.templates import template

#: Steps with bad inputs, at the end of those that are made here.
SPOILED = 24
#: Seed of inputs that nobody gave.
_SEED = 20261127


def generate_function(
    function: ca.Function | str | Path,
    out: str | Path,
    *,
    name: str | None = None,
    real: str = "float64",
    state: Mapping[str, str] | None = None,
    ports: Mapping[str, Any] | None = None,
    rate: float | None = None,
    fault_handling: FaultHandling | None = None,
    vectors: str | Path | np.ndarray | None = None,
    target: Sequence[Any] = (),
    at_most_instructions: int | None = None,
    steps: int | None = None,
    force: bool = False,
    frame: str = "",
) -> dict[str, Any]:
    """Write the package of a function; return what was made of what.

    Parameters
    ----------
    function : SX or MX, or the path of a .casadi file.
    out : folder of the package.
    name : prefix of every symbol; the function's own by default.
    real : "float64" or "float32".
    state : input -> output that is its next value.
    ports : port -> table of "unit", "note", and of a state's "initial" value.
    rate : steps a second.
    fault_handling : what the package does with faults beside telling them.
    vectors : what the shipped steps are given, (K, columns), or a CSV with columns that are called as members of the
        input, `x[0]`, matrices column by column. Without them numbers between -1 and 1, the last ones with bad numbers.
    target : targets to measure for the README.
    at_most_instructions : as for `casadi_gnc.delivery.generating.generate`.
    steps : how many, without `vectors`; 1024 by default.
    force : overwrite a package that was edited.
    frame : as for `casadi_gnc.delivery.packaging.generate`.

    Raises
    ------
    GncError
        Where something given is not right; the folder is left as it was.
    """
    if real not in REALS:
        raise PackageError(f"real is {real!r}, expected float64 or float32")
    title = ""
    if not isinstance(function, ca.Function):
        title, function = f"The function of {Path(function).name}", load_function(Path(function))
    own = flight_function.flight_function(function, state=state, ports=ports, rate=rate, title=title)
    if fault_handling is not None:
        own = replace(own, faults=fault_handling.of_function(own))
    thing, folder = PackableFunction(own), Path(out)
    options = Options(function.name().lower() if name is None else name, REALS[real], frame=frame)  # type: ignore[arg-type]
    boards = found_boards(target, at_most_instructions)
    package.check_room(folder, force)
    thing.files(options)  # what has no C form is refused before inputs of steps are made; printed once
    rows, spoiled = _given(own, vectors, steps)
    kept = flight_function.to_text(own)
    about = {
        "name": options.name,
        "title": own.title,
        "scheme": "",
        "real": real,
        "frame": frame,
        "tunable": [],
        "targets": [board.name for board in boards],
        "steps": len(rows),
        "spoiled": spoiled,
        "problem": {"made_of": "function", "sha256": digest(kept)},
        "made_by": made_by(),
    }
    refused: list[int] = []

    def flown(host: HostPackage) -> tuple[np.ndarray, np.ndarray]:
        words = as_words(rows, host.word)
        found = host.replay(words, own.replayed.size + 1)
        refused.append(int(np.count_nonzero(found[: len(rows) - spoiled, -1])))
        return words, found

    def readme(measured: list[dict[str, Any]], sizes: tuple[int, int]) -> str:
        return _readme(own, options, about, measured, sizes[0])

    pack(
        folder, thing, options, about, flown, readme, {making.FUNCTION: kept}, boards, at_most_instructions, force=force
    )
    warnings = [
        f"{count} of {len(rows) - spoiled} steps were refused: their inputs or results are not finite; give inputs "
        "that the function takes with --vectors"
        for count in refused
        if count
    ]
    return {**about, "warnings": warnings}


def load_function(path: Path) -> ca.Function:
    """Return the function of a .casadi file.

    Raises
    ------
    PackageError
        For a file that cannot be read, or is none that CasADi's `Function.save` wrote.
    """
    if not path.is_file():
        raise PackageError(f"{path} is no file; expected one that CasADi's Function.save wrote")
    try:
        return ca.Function.load(str(path))
    except (RuntimeError, MemoryError, ValueError, OverflowError) as error:
        said = str(error).strip().splitlines()[-1][:120] if str(error).strip() else type(error).__name__
        raise PackageError(
            f"{path.name} is no CasADi function ({said}); expected a file that Function.save of CasADi "
            f"{made_by()['casadi']} or older wrote"
        ) from None


def _given(own: FlightFunction, vectors: str | Path | np.ndarray | None, steps: int | None) -> tuple[np.ndarray, int]:
    """Return the inputs of the shipped steps (K, inputs), and how many at the end are bad."""
    count, names = own.inputs.size, access(own.inputs, "")
    if vectors is None:
        wanted = STEPS if steps is None else steps
        if not SPOILED < wanted <= MOST_STEPS:
            raise PackageError(f"steps is {wanted}, expected more than {SPOILED} and at most {MOST_STEPS}")
        rows = np.array([2.0 * uniforms(_SEED, k, count)[:count] - 1.0 for k in range(wanted)])
        for k in range(SPOILED):
            if k % 3 != 2:
                rows[wanted - SPOILED + k, (k * 5) % count] = BAD[k % len(BAD)]
        return rows, SPOILED
    if steps is not None:
        raise PackageError("steps are counted from the vectors; leave one of the two out")
    if isinstance(vectors, np.ndarray):
        rows = np.array(vectors, dtype=float)
        if rows.ndim != 2 or rows.shape[1] != count:
            raise PackageError(f"the vectors have the shape {rows.shape}, expected rows of {count} numbers")
    else:
        rows = _read(Path(vectors), names)
    if not 0 < len(rows) <= MOST_STEPS:
        raise PackageError(f"the vectors have {len(rows)} rows, expected 1 to {MOST_STEPS}")
    return rows, 0


def _read(path: Path, names: list[str]) -> np.ndarray:
    table = read_table(path)
    for name in names:
        if name not in table.names:
            raise ProblemError(
                f"the column {name!r} is missing; expected a column for each number of the input: "
                f"{', '.join(names[:6])}{', ...' if len(names) > 6 else ''}",
                f"{path.name}, line {table.line}",
            )
    for name in table.names:
        if name not in names:
            raise ProblemError(
                f"the column {name[:40]!r} is no input of the function", f"{path.name}, line {table.line}"
            )
    return np.array(table.column_numbers(names), dtype=float).reshape(-1, len(names))


def _readme(
    own: FlightFunction, options: Options, about: dict[str, Any], measured: list[dict[str, Any]], size: int
) -> str:
    initial = dict(zip(access(own.state, ""), own.initial, strict=True))
    return template("function_readme.md.j2").render(
        **common(own, options),
        version=about["made_by"]["casadi_gnc"],
        steps=about["steps"],
        spoiled=about["spoiled"],
        rate=f"{own.period:g}" if own.period else "",
        ports={"inputs": list(own.inputs.signals), "outputs": list(own.outputs.signals)},
        solvers=any("_allocate" in path for path in function_files(own, options)),
        initial=[{"name": name, "value": f"{value:.9g}"} for name, value in initial.items()],
        measured=measured,
        size=size,
    )
