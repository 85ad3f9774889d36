"""Write the gains of a synthesis into a mission file, by the symbols that recipe and law share."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from casadi_gnc.errors import ProblemError
from casadi_gnc.laws import gains_of
from casadi_gnc.missions.mission import Mission
from casadi_gnc.problem_files.document import Document, of_text, read_kind
from casadi_gnc.problem_files.loading import load_document
from casadi_gnc.problem_files.rewriting import rewritten
from casadi_gnc.problem_files.synthesis_file import SynthesisCase
from casadi_gnc.system.files import write_beside


@dataclass(frozen=True, eq=False)
class Target:
    """Hold the scheme of a mission file into which gains are to be written, read before anything is sought."""

    document: Document
    mission: Mission
    scheme: str

    def changes(self, case: SynthesisCase, gains: dict[str, Any]) -> dict[str, Any]:
        """Return what is written, by path.

        A gain goes to that of the law which has its symbol, `K` to `controller_gain`; so does a number that the recipe
        was given and the law needs too, such as `varpi`.

        Raises
        ------
        ProblemError
            For a gain whose symbol the law does not have.
        """
        law = type(self.mission.scheme(self.scheme).law)
        by_symbol = {field.metadata.get("symbol"): name for name, field in gains_of(law).items()}
        lacking = [symbol for symbol in gains if symbol not in by_symbol]
        if lacking:
            known = ", ".join(f"{name} ({symbol})" for symbol, name in by_symbol.items() if symbol) or "none"
            raise ProblemError(
                f"scheme {self.scheme!r} flies by {law.__name__}, which has no gain {', '.join(lacking)}; its symbols "
                f"are {known}",
                self.document.path.name,
            )
        given = {
            key: value
            for key, value in case.recipe
            if key in by_symbol and isinstance(value, (int, float)) and not isinstance(value, bool)
        }
        return {f"scheme.{self.scheme}.law.{by_symbol[key]}": value for key, value in {**given, **gains}.items()}

    def write(self, case: SynthesisCase, gains: dict[str, Any]) -> tuple[Mission, list[str]]:
        """Write gains, all their digits; return the mission that the file is now, and the paths that were written.

        Raises
        ------
        ProblemError
            For gains that the law cannot have; the file is then as it was.
        """
        changes = self.changes(case, gains)
        path = self.document.path
        text = rewritten(self.document, changes, type(self.mission.craft))
        made = load_document(of_text(path, text), strict=False)
        write_beside(path, lambda place: place.write_text(text, encoding="utf-8"))
        return made, list(changes)


def target_of(mission: str | Path, scheme: str | None) -> Target:
    """Return where gains are to be written.

    Parameters
    ----------
    mission : path of a mission file; shipped ones are not written into.
    scheme : its name; the only one by default.

    Raises
    ------
    ProblemError
        For what is no file of one's own, and several schemes of which none is named.
    """
    if not Path(mission).is_file():
        raise ProblemError(
            f"--into is {str(mission)!r}, which is no file; `casadi-gnc problems copy` makes one of a shipped problem"
        )
    document = read_kind(mission, "mission")
    read = load_document(document, strict=False)
    names = [one.name for one in read.schemes]
    if scheme is None and len(names) > 1:
        raise ProblemError(f"has the schemes {', '.join(names)}; name one by --scheme", document.path.name)
    if scheme is not None and scheme not in names:
        raise ProblemError(f"has no scheme {scheme!r}; there is {', '.join(names)}", document.path.name)
    return Target(document, read, scheme or names[0])
