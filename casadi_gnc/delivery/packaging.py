"""Generate the flight package of a problem file, and verify one on this machine and on targets."""

from __future__ import annotations

import re
from collections.abc import Sequence
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

from casadi_gnc.checking import numbers
from casadi_gnc.delivery.describing import describe
from casadi_gnc.delivery.vectors import fly_package, sampled
from casadi_gnc.embedded import compare, package, targets
from casadi_gnc.embedded.controller import Controller, Options
from casadi_gnc.embedded.host import HostPackage
from casadi_gnc.embedded.machine import Machine
from casadi_gnc.embedded.readme import render_readme
from casadi_gnc.errors import PackageError
from casadi_gnc.missions.mission import Mission
from casadi_gnc.problem_files.loading import load, read
from casadi_gnc.system import compilers

#: Samples of a shipped flight, and how many of them have bad measurements at the end.
STEPS, SPOILED = 1024, 24
#: Most samples of one; more would make files of hundreds of megabytes.
MOST_STEPS = 100_000
_REALS = {"float64": "double", "float32": "float"}
#: What a manifest must say for a package to be verified.
_ABOUT = {"name": str, "title": str, "scheme": str, "real": str, "tunable": list}


def generate(
    problem: str | Path,
    out: Path,
    *,
    scheme: str | None = None,
    name: str | None = None,
    real: str = "float64",
    tunable: Sequence[str] = (),
    target: Sequence[str] = (),
    steps: int = STEPS,
    force: bool = False,
) -> dict[str, Any]:
    """Write the package of one scheme of a mission; return what was made of what.

    Parameters
    ----------
    problem : a mission file, or the name of a shipped one.
    out : folder of the package.
    scheme : the first one by default.
    name : prefix of every symbol; the file's name by default.
    real : "float64" or "float32".
    tunable : gains that stay variables.
    target : targets to measure for the README.
    steps : samples of the shipped flight.
    force : overwrite a package that was edited.

    Raises
    ------
    GncError
        Where something given is not right; the folder is left as it was.
    """
    path, text, _ = read(problem)
    mission = sampled(load(problem))
    if real not in _REALS:
        raise PackageError(f"real is {real!r}, expected float64 or float32")
    if steps <= SPOILED:
        raise PackageError(f"steps is {steps}, expected more than {SPOILED}")
    if steps > MOST_STEPS:
        raise PackageError(f"steps is {steps}, expected at most {MOST_STEPS}: vectors are text in the package")
    options = Options(path.stem if name is None else name, _REALS[real])  # type: ignore[arg-type]
    boards = [targets.find(one) for one in dict.fromkeys(target)]
    for board in boards:
        board.need()
    package.check_room(out, force)
    controller = describe(mission, scheme, tunable)
    about = {
        "name": options.name,
        "title": controller.title,
        "scheme": controller.scheme,
        "real": real,
        "tunable": [one.name for one in controller.tunables],
        "targets": [board.name for board in boards],
        "steps": steps,
        "spoiled": SPOILED,
        "problem": {"file": path.name, "sha256": mission.digest},
        "made_by": {"casadi_gnc": metadata.version("casadi-gnc"), "casadi": metadata.version("casadi")},
    }

    def build(workshop: Path) -> dict[str, str]:
        files = package.flight_files(controller, options)
        package.put(workshop, {**files, "test/replay.h": package.replay_header(controller, options, steps)})
        host = HostPackage(workshop, options.name)
        flown = fly_package(
            mission, mission.scheme(controller.scheme), host, controller.outputs.size + 1, steps, SPOILED
        )
        files |= package.replay_files(controller, options, *flown, SPOILED)
        package.put(workshop, files)
        measured = [
            {
                "target": board.name,
                **targets.measure(workshop, options.name, board, float_only=real == "float32").summary(),
            }
            for board in boards
        ]
        files["README.md"] = render_readme(controller, options, about, measured, (host.state_size, host.params_size))
        files["problem.toml"] = text
        files[package.MANIFEST] = package.manifest(files, about)
        return files

    package.write(out, build, force=force)
    return {**about, "warnings": _warnings(mission, controller.scheme, real)}


def verify(folder: Path, target: Sequence[str] = ("host",)) -> dict[str, Any]:
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
    about = package.read_manifest(folder)
    if lacking := [key for key, kind in _ABOUT.items() if not isinstance(about.get(key), kind)]:
        raise PackageError(f"{folder} is no package: its {package.MANIFEST} does not say {', '.join(lacking)}")
    if about["real"] not in _REALS:
        raise PackageError(f"{folder} is no package of this version: its numbers are {about['real']!r}")
    boards = [targets.find(one) for one in dict.fromkeys(target) if one != "host"]
    for board in boards:
        board.need()
    inputs, outputs = read_vectors(folder, about["real"])
    mission = sampled(load(folder / "problem.toml"))
    controller = describe(mission, about["scheme"], about["tunable"])
    options = Options(about["name"], _REALS[about["real"]])  # type: ignore[arg-type]
    report: dict[str, Any] = {"package": about["name"], "title": about["title"], "scheme": about["scheme"]}
    report |= {"real": about["real"], "steps": len(inputs), "edited": package.edited(folder)}
    report["warnings"] = _warnings(mission, controller.scheme, about["real"])
    report["not_regenerated"] = _changed(folder, package.flight_files(controller, options))
    report["comparisons"], report["targets"] = [], []
    every = [targets.find(one) for one in targets.names()]
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


def _warnings(mission: Mission, scheme: str, real: str) -> list[str]:
    """Return what the check of single precision has to say about a scheme; nothing in double precision."""
    found = numbers.checks(mission, mission.scheme(scheme)) if real == "float32" else ()
    return [
        f"{one.name} is {one.value:.2g}, limit {one.limit:.2g}: {one.consequence} {one.remedy}"
        for one in found
        if not one.holds
    ]


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
