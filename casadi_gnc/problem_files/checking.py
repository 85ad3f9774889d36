"""Check a problem file, of a mission or of a synthesis."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from casadi_gnc.checking import check
from casadi_gnc.checks import Check
from casadi_gnc.errors import ProblemError
from casadi_gnc.missions.mission import Mission
from casadi_gnc.problem_files.boundary import about
from casadi_gnc.problem_files.document import read
from casadi_gnc.problem_files.loading import load_document
from casadi_gnc.tables.wording import shown


@dataclass(frozen=True)
class Checked:
    """Hold what was found in a problem file; `mission` is None for a synthesis."""

    title: str
    checks: list[Check]
    mission: Mission | None = None


def check_file(problem: str | Path, schemes: list[str] | None = None) -> tuple[str, list[Check]]:
    """Return a title and all checks of a problem file, of a mission or of a synthesis; see `checked_file`."""
    found = checked_file(problem, schemes)
    return found.title, found.checks


def checked_file(problem: str | Path, schemes: list[str] | None = None) -> Checked:
    """Return all checks of a problem file, of a mission or of a synthesis, and the mission.

    Raises
    ------
    ProblemError
        For a file that cannot be read or is of another kind.
    """
    document = read(problem)
    kind = document.data.get("kind")
    with about(document):
        if kind == "synthesis":
            from casadi_gnc.problem_files import synthesis_checks  # solvers that a mission does without

            return Checked(*synthesis_checks.check(problem))
        if kind != "mission":
            message = f'kind is {shown(kind)}; check takes a file of kind "mission" or "synthesis"'
            raise ProblemError(message, document.place(("kind",)))
        mission = load_document(document, strict=False)
        return Checked(mission.title or mission.name, check(mission, schemes or None), mission)
