"""Generate the flight package of a mission's controller: C, its tests, and what it was made of."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

from casadi_gnc.checking import numbers
from casadi_gnc.delivery import making
from casadi_gnc.delivery.vectors import fly_package
from casadi_gnc.embedded import boards as known_boards
from casadi_gnc.embedded import frames, package, targets
from casadi_gnc.embedded.controller import Controller, Options
from casadi_gnc.embedded.coverage import COVERAGE, coverage
from casadi_gnc.embedded.frames import package_files
from casadi_gnc.embedded.host import HostPackage
from casadi_gnc.embedded.manifest import MOST_STEPS
from casadi_gnc.embedded.packable import Packable, PackableController
from casadi_gnc.embedded.readme import render_readme
from casadi_gnc.errors import PackageError
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.onboard import describe, sampled
from casadi_gnc.problem_files.by_name import mission_of

#: Samples of a shipped flight, and how many of them have bad measurements at the end.
STEPS, SPOILED = 1024, 24
REALS = {"float64": "double", "float32": "float"}


def generate(
    problem: str | Path | Mission,
    out: str | Path,
    *,
    scheme: str | None = None,
    name: str | None = None,
    real: str = "float64",
    tunable: Sequence[str] = (),
    target: Sequence[Any] = (),
    steps: int = STEPS,
    force: bool = False,
    frame: str = "",
) -> dict[str, Any]:
    """Write the package of one scheme of a mission; return what was made of what.

    Parameters
    ----------
    problem : a mission, a mission file, or the name of a shipped one.
    out : folder of the package.
    scheme : the first one by default.
    name : prefix of every symbol; the mission's name by default.
    real : "float64" or "float32".
    tunable : gains that stay variables.
    target : targets to measure for the README.
    steps : samples of the shipped flight.
    force : overwrite a package that was edited.
    frame : of `casadi_gnc.embedded.frames.FRAMES`, what the package is put into besides.

    Raises
    ------
    GncError
        Where something given is not right; the folder is left as it was.
    """
    mission, folder = sampled(mission_of(problem)), Path(out)
    if real not in REALS:
        raise PackageError(f"real is {real!r}, expected float64 or float32")
    if steps <= SPOILED:
        raise PackageError(f"steps is {steps}, expected more than {SPOILED}")
    if steps > MOST_STEPS:
        raise PackageError(f"steps is {steps}, expected at most {MOST_STEPS}: vectors are text in the package")
    options = Options(mission.name if name is None else name, REALS[real], frame=frame)  # type: ignore[arg-type]
    boards = found_boards(target)
    package.check_room(folder, force)
    controller = packed(mission, scheme, tunable, monitored=True)
    sources, made_of = making.kept(mission, controller, options, fresh=not isinstance(problem, Mission))
    about = {
        "name": options.name,
        "title": controller.title,
        "scheme": controller.scheme,
        "real": real,
        "frame": frame,
        "tunable": [one.name for one in controller.tunables],
        "targets": [board.name for board in boards],
        "steps": steps,
        "spoiled": SPOILED,
        "problem": made_of,
        "made_by": made_by(),
    }

    def flown(host: HostPackage) -> tuple[np.ndarray, np.ndarray]:
        outputs = controller.replayed.size + 1
        return fly_package(mission, mission.scheme(controller.scheme), host, outputs, steps, SPOILED)

    def readme(measured: list[dict[str, Any]], sizes: tuple[int, int]) -> str:
        return render_readme(controller, options, about, measured, sizes)

    pack(folder, PackableController(controller), options, about, flown, readme, sources, boards, force=force)
    return {**about, "warnings": warnings(mission, controller.scheme, real)}


def packed(mission: Mission, scheme: str | None, tunable: Sequence[str], *, monitored: bool) -> Controller:
    """Return the controller that is packed; raise `PackageError` where new gains shall fade in and none can change."""
    if mission.fault_handling is not None and mission.fault_handling.gain_change_s and not tunable:
        raise PackageError(
            "gain_change_s needs gains that can change; name them by --tunable, or leave it out of [fault_handling]"
        )
    return describe(mission, scheme, tunable, monitored=monitored)


def made_by() -> dict[str, str]:
    """Return the versions that write a package."""
    return {"casadi_gnc": metadata.version("casadi-gnc"), "casadi": metadata.version("casadi")}


def found_boards(target: Sequence[Any]) -> list[known_boards.Target]:
    """Return targets, each once; raise `TargetError` for unknown ones and for tools that are missing."""
    boards = [known_boards.find(one) for one in dict.fromkeys(target)]
    for board in boards:
        board.need()
    return boards


def pack(
    folder: Path,
    thing: Packable,
    options: Options,
    about: dict[str, Any],
    flown: Callable[[HostPackage], tuple[np.ndarray, np.ndarray]],
    readme: Callable[[list[dict[str, Any]], tuple[int, int]], str],
    sources: dict[str, str],
    boards: Sequence[known_boards.Target],
    *,
    force: bool,
) -> None:
    """Write a package: its C, vectors that the C itself answers on this machine, README, manifest.

    Parameters
    ----------
    thing : what is packed.
    about : of the manifest, with "steps", "spoiled" and "real".
    flown : gives the words in and out of the vectors from the compiled package.
    readme : its text, from the rows of the targets and the bytes of state and parameters.
    sources : files of what it was made of.
    boards : targets to measure.
    force : overwrite files that were edited.
    """

    def files_of(workshop: Path) -> dict[str, str]:
        files = package_files(thing, options)
        package.put(workshop, {**files, "test/replay.h": thing.replay_header(options, about["steps"])})
        host = HostPackage(workshop, options.name)
        inputs, outputs = flown(host)
        files |= thing.replay_files(options, inputs, outputs, about["spoiled"])
        taken = coverage(files, options.name, inputs, outputs.shape[1])
        files[COVERAGE] = taken.to_text()
        package.put(workshop, files)
        measured = [
            {
                "target": board.name,
                **targets.measure(
                    workshop, options.name, board, float_only=about["real"] == "float32", prove=True
                ).summary(),
            }
            for board in boards
        ]
        files["README.md"] = readme(measured, (host.state_size, host.params_size)) + frames.note(options)
        files |= sources
        files[package.MANIFEST] = package.manifest(files, {**about, "coverage": taken.summary})
        return files

    package.write(folder, files_of, force=force)


def warnings(mission: Mission | None, scheme: str, real: str) -> list[str]:
    """Return what the check of single precision has to say about a scheme; nothing in double precision."""
    found = numbers.checks(mission, mission.scheme(scheme)) if real == "float32" and mission is not None else ()
    return [
        f"{one.name} is {one.value:.2g}, limit {one.limit:.2g}: {one.consequence} {one.remedy}"
        for one in found
        if not one.holds
    ]
