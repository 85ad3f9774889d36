"""What a package was made of: the problem file with the user's own code, or the controller itself.

A mission that was read from a file is kept as that file, with every file of the user's own code that it names;
`verify` builds it again from there. A mission that was made from objects is kept as its controller,
`controller.json`: whatever the objects were, what flies is in it. A function is kept as `function.json`.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from casadi_gnc import guests
from casadi_gnc.embedded import flight_function, package, saving
from casadi_gnc.embedded.controller import Controller, Options
from casadi_gnc.embedded.flight_allocator import FlightAllocator
from casadi_gnc.embedded.packable import Packable, PackableController, PackableFunction
from casadi_gnc.errors import GncError, PackageError
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.onboard import describe, sampled
from casadi_gnc.missions.origin import Origin
from casadi_gnc.problem_files.allocation_file import AllocationCase, load_allocation
from casadi_gnc.problem_files.document import of_text
from casadi_gnc.problem_files.loading import load, load_document

PROBLEM, CONTROLLER, FUNCTION = "problem.toml", "controller.json", "function.json"
#: The file that a package keeps, by what it was made of.
KEPT = {"": PROBLEM, "objects": CONTROLLER, "function": FUNCTION, "allocation": PROBLEM}


def kept(
    mission: Mission, controller: Controller, options: Options, *, fresh: bool
) -> tuple[dict[str, str], dict[str, Any]]:
    """Return the files that a package keeps of what it was made of, and what its manifest says of them.

    Parameters
    ----------
    fresh : whether the mission was read just now; else its file is read again, to see that it still says the same.
    """
    origin = mission.origin
    if origin is None or not (fresh or _is_still(origin, controller, options)):
        about = {"made_of": "objects", "sha256": mission.digest}
        return {CONTROLLER: saving.to_text(controller)}, about
    taken = {file.path: file.text for file in origin.guests}
    about: dict[str, Any] = {"file": origin.name, "sha256": origin.digest}
    if origin.changes:
        about["changes"] = dict(origin.changes)
    if origin.guests:
        about["code"] = {file.path: file.sha256 for file in origin.guests}
    return {PROBLEM: origin.text, **taken}, about


def _is_still(origin: Origin, controller: Controller, options: Options) -> bool:
    """Return whether the file still says what is packed: an object may have been changed since it was read."""
    try:
        again = sampled(load_again(origin))
        other = describe(again, controller.scheme, [one.name for one in controller.tunables], monitored=True)
        return package.flight_files(other, options) == package.flight_files(controller, options)
    except GncError:
        return False


def load_again(origin: Origin) -> Mission:
    """Return the mission of a file once more, from the text that was read."""
    path = origin.folder / origin.name
    return load_document(of_text(path, origin.text), origin.changes, strict=False)


def flight_allocator(case: AllocationCase) -> FlightAllocator:
    """Return what is packed of an allocation file; raise `PackageError` for what does not fly."""
    for given, what in (
        (case.keep_direction, "keep_direction is solved by linear programs"),
        (case.least_force is not None, "least_force_N is solved by a search"),
        (case.least_propellant is not None, 'objective = "propellant" is solved by linear programs'),
    ):
        if given:
            raise PackageError(f"{case.name}: {what}, which has no bounded time on board; leave the option out")
    return FlightAllocator(case.title, case.problem, case.row_scale, case.units)


def rebuilt(folder: Path, about: dict[str, Any], tunable: Sequence[str]) -> tuple[Mission | None, Packable]:
    """Return the mission, where a file is kept, and what a package was made of.

    Raises
    ------
    PackageError
        Where what was kept is gone or was changed.
    """
    problem = about.get("problem", {})
    if problem.get("made_of") == "function":
        return None, PackableFunction(flight_function.from_text(_kept(folder, FUNCTION, problem["sha256"])))
    if problem.get("made_of") == "allocation":
        _kept(folder, PROBLEM, problem["sha256"])
        return None, flight_allocator(load_allocation(folder / PROBLEM))
    if problem.get("made_of") == "objects":
        return None, PackableController(saving.from_text(_read(folder / CONTROLLER)))
    for path, sha256 in problem.get("code", {}).items():
        _kept(folder, path, sha256)
    mission = sampled(load(folder / PROBLEM, problem.get("changes")))
    return mission, PackableController(describe(mission, about["scheme"], tunable, monitored=True))


def _kept(folder: Path, path: str, sha256: str) -> str:
    """Return the text of a file that must be the one of the manifest."""
    found = guests.GuestFile(path, _read(folder / path))
    if found.sha256 != sha256:
        raise PackageError(
            f"{folder / path} was changed since the package was generated (sha256 {found.sha256[:12]}, expected "
            f"{sha256[:12]}); generate the package again"
        )
    return found.text


def _read(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise PackageError(f"{path} cannot be read: {error}; generate the package again") from error
