"""Generate the package of an allocation file: the on-board allocator alone, for its matrix, bounds and uncertainty."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from casadi_gnc.delivery import making
from casadi_gnc.delivery.packaging import REALS, found_boards, made_by, pack
from casadi_gnc.delivery.vectors import BAD
from casadi_gnc.embedded import package
from casadi_gnc.embedded.compare import as_words
from casadi_gnc.embedded.controller import Options
from casadi_gnc.embedded.flight_allocator import DEAD, STUCK, FlightAllocator
from casadi_gnc.embedded.host import HostPackage
from casadi_gnc.embedded.manifest import MOST_STEPS, digest
from casadi_gnc.errors import PackageError
from casadi_gnc.mathematics.noise import uniforms
from casadi_gnc.problem_files.allocating import read_commands
from casadi_gnc.problem_files.allocation_file import load_allocation
from casadi_gnc.problem_files.document import read
from casadi_gnc.system.templates import template

#: Commands that are made where none are given; commands with a fault that follow, and bad ones at the end.
COMMANDS, FAULTY, SPOILED = 256, 64, 12
_SEED = 20200111


def generate_allocator(
    problem: str | Path,
    out: str | Path,
    *,
    name: str | None = None,
    real: str = "float64",
    commands: str | Path | None = None,
    target: Sequence[Any] = (),
    at_most_instructions: int | None = None,
    force: bool = False,
    frame: str = "",
) -> dict[str, Any]:
    """Write the package of the on-board allocator for an allocation file; return what was made of what.

    Parameters
    ----------
    problem : an allocation file, or the name of a shipped one.
    out : folder of the package.
    name : prefix of every symbol; the file's name by default.
    real : "float64" or "float32".
    commands : CSV of the shipped commands, columns u1, u2, ...; by default efforts of forces inside the bounds. Some
        are shipped again, each with an actuator dead or stuck, and a few bad ones at the end.
    target : targets to measure for the README.
    at_most_instructions : as for `casadi_gnc.delivery.generating.generate`.
    force : overwrite a package that was edited.
    frame : as for `casadi_gnc.delivery.packaging.generate`.

    Raises
    ------
    GncError
        Where something given is not right, and for what does not fly: directions kept by a linear program, minimum
        impulse. The folder is left as it was.
    """
    if real not in REALS:
        raise PackageError(f"real is {real!r}, expected float64 or float32")
    case, document = load_allocation(problem), read(problem)
    thing, folder = making.flight_allocator(case), Path(out)
    options = Options(case.name.lower() if name is None else name, REALS[real], frame=frame)  # type: ignore[arg-type]
    boards = found_boards(target, at_most_instructions)
    package.check_room(folder, force)
    rows = _samples(thing, None if commands is None else read_commands(Path(commands), len(case.row_scale)))
    about = {
        "name": options.name,
        "title": thing.title,
        "scheme": "",
        "real": real,
        "frame": frame,
        "tunable": [],
        "targets": [board.name for board in boards],
        "steps": len(rows),
        "spoiled": SPOILED,
        "problem": {"made_of": "allocation", "file": document.path.name, "sha256": digest(document.text)},
        "made_by": made_by(),
    }

    def flown(host: HostPackage) -> tuple[np.ndarray, np.ndarray]:
        words = as_words(rows, host.word)
        return words, host.replay(words, thing.replayed.size + 1)

    def readme(measured: list[dict[str, Any]], sizes: tuple[int, int]) -> str:
        about_all = {**thing.about(options), "version": about["made_by"]["casadi_gnc"], "steps": len(rows)}
        return template("allocator_readme.md.j2").render(**about_all, measured=measured, sizes=sizes, spoiled=SPOILED)

    pack(
        folder,
        thing,
        options,
        about,
        flown,
        readme,
        {making.PROBLEM: document.text},
        boards,
        at_most_instructions,
        force=force,
    )
    return {**about, "warnings": case.warnings}


def _samples(thing: FlightAllocator, commands: np.ndarray | None) -> np.ndarray:
    """Return the shipped samples: commands, commands with a dead or a stuck actuator, bad commands."""
    problem, count = thing.problem, thing.problem.count
    if commands is None:
        commands = np.array([_effort(thing, k) for k in range(COMMANDS)])
    faulty = commands[:FAULTY]
    if not 0 < len(commands) <= MOST_STEPS - FAULTY - SPOILED:
        raise PackageError(f"{len(commands)} commands were given, expected 1 to {MOST_STEPS - FAULTY - SPOILED}")
    rows = np.zeros((len(commands) + len(faulty) + SPOILED, thing.given))
    size = len(thing.row_scale)
    rows[: len(commands), :size] = commands
    rows[len(commands) : -SPOILED, :size] = faulty
    for k in range(len(faulty)):
        i = (k // 8) % count  # a fault lasts for eight commands
        rows[len(commands) + k, size + i] = STUCK if (k // 8) % 2 else DEAD
        rows[len(commands) + k, size + count + i] = 0.5 * (problem.lower[i] + problem.upper[i])
    rows[-SPOILED:, :size] = np.resize(commands, (SPOILED, size))
    for k in range(0, SPOILED, 2):
        rows[k - SPOILED, k % size] = BAD[k // 2 % 4]
    return rows


def _effort(thing: FlightAllocator, k: int) -> list[float]:
    """Return an effort that forces inside the bounds make, by plain sums: the same on every machine."""
    problem = thing.problem
    shares = uniforms(_SEED, k, problem.count)
    forces = [
        low + share * (high - low) for low, high, share in zip(problem.lower, problem.upper, shares, strict=False)
    ]
    rows = zip(problem.effectiveness, thing.row_scale, strict=True)
    return [sum(float(a) * float(f) for a, f in zip(row, forces, strict=True)) / float(scale) for row, scale in rows]
