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
    at_most_instructions: int | None = None,
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
    at_most_instructions : as for `casadi_gnc.delivery.generating.generate`.
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
    boards = found_boards(target, at_most_instructions)
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

    pack(
        folder,
        PackableController(controller),
        options,
        about,
        flown,
        readme,
        sources,
        boards,
        at_most_instructions,
        force=force,
    )
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


def found_boards(target: Sequence[Any], at_most: int | None) -> list[known_boards.Target]:
    """Return targets, each once.

    Raises
    ------
    PackageError
        For a limit of instructions that is none, or that no target is named for.
    TargetError
        For unknown targets, and for tools that are missing.
    """
    if at_most is not None and at_most < 1:
        raise PackageError(f"at_most_instructions is {at_most}, expected 1 or more")
    if at_most is not None and not target:
        raise PackageError("at_most_instructions is counted on a target; name one, as cortex-m7")
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
    at_most: int | None,
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
    at_most : instructions that a step may take there by its bound.
    force : overwrite files that were edited.

    Raises
    ------
    PackageError
        Where a step may take more instructions than `at_most` by its bound, or has none. Nothing is written.
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
        if at_most is not None:
            _hold(measured, at_most)
        files["README.md"] = readme(measured, (host.state_size, host.params_size)) + frames.note(options)
        files |= sources
        files[package.MANIFEST] = package.manifest(files, {**about, "coverage": taken.summary})
        return files

    package.write(folder, files_of, force=force)


def _hold(measured: Sequence[dict[str, Any]], at_most: int) -> None:
    """Raise `PackageError` where a step may take more instructions than a limit, by its bound, or has no bound."""
    above = {row["target"]: row["instructions_bound"] for row in measured if (row["instructions_bound"] or 0) > at_most}
    if above:
        needed = ", ".join(f"{bound} on {target}" for target, bound in above.items())
        raise PackageError(f"a step may take {needed}, at_most_instructions is {at_most}; allow {max(above.values())}")
    for row in measured:
        if row["instructions_bound"] is None:
            why = row["instructions_bound_missing"]
            raise PackageError(
                f"at_most_instructions is {at_most}, but a step has no proved bound on {row['target']}: {why}; "
                "leave at_most_instructions or the target out"
            )


def warnings(mission: Mission | None, scheme: str, real: str) -> list[str]:
    """Return what the check of single precision has to say about a scheme; nothing in double precision."""
    found = numbers.checks(mission, mission.scheme(scheme)) if real == "float32" and mission is not None else ()
    return [
        f"{one.name} is {one.value:.2g}, limit {one.limit:.2g}: {one.consequence} {one.remedy}"
        for one in found
        if not one.holds
    ]
