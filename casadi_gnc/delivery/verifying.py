"""Verify a flight package: its words on this machine, against CasADi's machine, and on targets."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from casadi_gnc.delivery import making
from casadi_gnc.delivery.packaging import REALS, warnings
from casadi_gnc.embedded import boards as known_boards
from casadi_gnc.embedded import compare, package, targets
from casadi_gnc.embedded.controller import Controller, Options
from casadi_gnc.embedded.host import HostPackage
from casadi_gnc.embedded.machine import Machine
from casadi_gnc.errors import PackageError
from casadi_gnc.system import compilers

#: What a manifest must say for a package to be verified.
_ABOUT = {"name": str, "title": str, "scheme": str, "real": str, "tunable": list}


def verify(folder: str | Path, target: Sequence[Any] = ("host",)) -> dict[str, Any]:
    """Compare a package with CasADi's virtual machine, other compilers and targets, word by word.

    Parameters
    ----------
    folder : of the package.
    target : "host" and names of targets.

    Returns
    -------
    dict
        Plain data: for each comparison the differences signal by signal, for each target its measures;
        `words` is the number of words that differ where none may.

    Raises
    ------
    PackageError, TargetError, CompilerError
        For a folder that is no package, and tools that are missing or refuse.
    """
    folder = Path(folder)
    about = package.read_manifest(folder)
    if lacking := [key for key, kind in _ABOUT.items() if not isinstance(about.get(key), kind)]:
        raise PackageError(f"{folder} is no package: its {package.MANIFEST} does not say {', '.join(lacking)}")
    if about["real"] not in REALS:
        raise PackageError(f"{folder} is no package of this version: its numbers are {about['real']!r}")
    boards = [known_boards.find(one) for one in dict.fromkeys(target) if one != "host"]
    for board in boards:
        board.need()
    inputs, outputs = read_vectors(folder, about["real"])
    mission, controller = making.rebuilt(folder, about, about["tunable"])
    options = Options(about["name"], REALS[about["real"]])  # type: ignore[arg-type]
    report: dict[str, Any] = {"package": about["name"], "title": about["title"], "scheme": about["scheme"]}
    report |= {"real": about["real"], "steps": len(inputs), "edited": package.edited(folder)}
    report["warnings"] = warnings(mission, controller.scheme, about["real"])
    report["not_regenerated"] = _changed(folder, package.flight_files(controller, options))
    report["comparisons"], report["targets"] = [], []
    every = [known_boards.find(one) for one in known_boards.names()]
    report["not_installed"] = {one.name: one.missing() for one in every if one.missing()}
    if "host" in target:
        report["comparisons"] += _on_host(folder, controller, options, inputs, outputs)
    for board in boards:
        measured = targets.measure(folder, options.name, board, float_only=options.real == "float")
        lines = compare.differences(measured.outputs, outputs, controller.outputs)
        report["comparisons"].append(_comparison(f"{board.name} against the shipped flight", lines, exact=True))
        report["targets"].append({"target": board.name, "title": board.title, **measured.summary()})
    report["words"] = sum(one["words"] for one in report["comparisons"] if one["exact"])
    return report


def read_vectors(folder: Path, real: str) -> tuple[np.ndarray, np.ndarray]:
    """Return the words in and out of a package's vectors, one row a sample."""
    path = folder / "test" / "vectors.c"
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise PackageError(f"{path} cannot be read: {error.strerror or error}") from error
    word = np.uint64 if real == "float64" else np.uint32
    tables = []
    for table in re.findall(r"\] = \{\n(.*?)\n\};", text, re.DOTALL):
        rows = [[int(entry, 16) for entry in re.findall(r"0x([0-9a-f]+)", row)] for row in table.splitlines()]
        tables.append(np.array(rows, dtype=word))
    if len(tables) != 2 or len(tables[0]) != len(tables[1]):
        raise PackageError(f"{path} does not hold the vectors of a flight; generate the package again")
    return tables[0], tables[1]


def _changed(folder: Path, files: dict[str, str]) -> list[str]:
    """Return the files that this version would write otherwise."""
    return [
        path
        for path, text in files.items()
        if not (folder / path).is_file() or (folder / path).read_text(encoding="utf-8") != text
    ]


def _comparison(what: str, lines: list[compare.Difference], *, exact: bool) -> dict[str, Any]:
    """Return one comparison as data; `exact` where no word may differ."""
    return {
        "what": what,
        "exact": exact,
        "words": compare.words_that_differ(lines),
        "of": sum(line.count for line in lines),
        "signals": compare.as_data(lines),
    }


def _on_host(
    folder: Path, controller: Controller, options: Options, inputs: np.ndarray, outputs: np.ndarray
) -> list[dict[str, Any]]:
    found = []
    for compiler in compilers.different(compilers.available() or [compilers.find()]):
        replayed = HostPackage(folder, options.name, compiler=compiler).replay(inputs, outputs.shape[1])
        lines = compare.differences(replayed, outputs, controller.outputs)
        found.append(_comparison(f"host, {compiler.version}, against the shipped flight", lines, exact=True))
    if options.real == "double":
        replayed = _rebuilt(controller, Options(options.name, maths="libm"), inputs, ("-O2", "-fno-builtin"))
        machine = Machine(controller).replay(compare.as_numbers(inputs))
        expected = compare.as_words(machine, inputs.dtype)
        expected[:, -1] = machine[:, -1].astype(int)
        lines = compare.differences(replayed, expected, controller.outputs)
        found.append(_comparison("host with the C library's functions against CasADi's machine", lines, exact=True))
    else:
        wide = compare.as_words(compare.as_numbers(inputs).astype(float), np.dtype(np.uint64))
        replayed = _rebuilt(controller, Options(options.name), wide, ("-O2",))
        reals = compare.as_numbers(np.ascontiguousarray(replayed[:, :-1]))
        expected = np.column_stack([compare.as_words(reals, outputs.dtype), replayed[:, -1].astype(np.uint32)])
        lines = compare.differences(outputs, expected.astype(np.uint32), controller.outputs)
        found.append(_comparison("float32 against float64, from the same measurements", lines, exact=False))
    return found


def _rebuilt(controller: Controller, options: Options, inputs: np.ndarray, flags: tuple[str, ...]) -> np.ndarray:
    """Return the output words of the controller made anew with other options."""
    with compilers.workshop() as folder:
        files = package.flight_files(controller, options)
        files["test/replay.h"] = package.replay_header(controller, options, len(inputs))
        package.put(folder, files)
        return HostPackage(folder, options.name, flags=flags).replay(inputs, controller.outputs.size + 1)
