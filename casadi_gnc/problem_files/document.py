"""A problem file as it was read, and what is wrong with it, each with its line."""

from __future__ import annotations

import difflib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel, ValidationError

from casadi_gnc.errors import GncError, ProblemError
from casadi_gnc.problem_files import toml_place, toml_text
from casadi_gnc.system import assets
from casadi_gnc.system.reading import text_of
from casadi_gnc.system.text import refused
from casadi_gnc.tables.complaints import sentences
from casadi_gnc.tables.part import MisfitError, misfits_of
from casadi_gnc.tables.wording import LONGEST, SHOWN, cut, shown

Key = tuple[str | int, ...]
#: Most complaints about one file that are told.
_MOST = 20


@dataclass(frozen=True)
class Document:
    """Hold a problem file: path, text and parsed content."""

    path: Path
    text: str
    data: dict[str, Any]

    @property
    def folder(self) -> Path:
        """The folder beside which the user's own code is looked for."""
        return self.path.parent

    def at(self, *key: str) -> Any:
        """Return what stands at a key below tables; None where there is none, or no table on the way."""
        found: Any = self.data
        for name in key:
            found = found.get(name) if isinstance(found, dict) else None
        return found

    def place(self, key: Key) -> str:
        """Return "file, line n, table.key" for messages."""
        return toml_place.describe(self.path, self.text, key)

    def validated(self, model: Any) -> Any:
        """Return the content checked by a pydantic model; raise `ProblemError` with every key that is wrong."""
        complaints = Complaints(self)
        found = complaints.checked(model, self.data)
        complaints.settle()
        return found

    def with_data(self, data: dict[str, Any]) -> Document:
        """Return the document with other content, told of at the places of this text."""
        return replace(self, data=data)


class Complaints:
    """Gather what is wrong with a document, to tell all of it at once, in the order of the lines."""

    def __init__(self, document: Document) -> None:
        self._document = document
        self._found: list[tuple[Key, str]] = []

    @property
    def folder(self) -> Path:
        """The folder of the document."""
        return self._document.folder

    def add(self, key: Key, message: str) -> None:
        """Note what is wrong with a key; one sentence a key and message."""
        if (key, message) not in self._found:
            self._found.append((key, message))

    def checked(self, model: type[BaseModel], data: Any, key: Key = ()) -> Any:
        """Return data checked by a model, None where it does not fit; `key` is where the data stand."""
        try:
            with np.errstate(all="ignore"):  # what is too large is told as a complaint
                return model.model_validate(data, context={"folder": self._document.folder})
        except ValidationError as error:
            for path, message in sentences(error, model, data):
                self.add((*key, *path), message)
        return None

    def apart(self) -> Complaints:
        """Return an empty list of complaints about the same document."""
        return Complaints(self._document)

    def join(self, others: Complaints) -> None:
        """Note what others noted."""
        for key, message in others._found:
            self.add(key, message)

    @contextmanager
    def about(self, *key: str | int) -> Iterator[None]:
        """Note what is raised inside as being about a key; a `MisfitError` says which one below it."""
        try:
            yield
        except MisfitError as error:
            for misfit in misfits_of(error):
                self.add((*key, *misfit.path), str(misfit))
        except GncError as error:
            self.add(key, str(error))

    def settle(self) -> None:
        """Raise one `ProblemError` with all that was noted, if anything was; the first `_MOST` of very many."""
        if not self._found:
            return
        text = self._document.text
        last = len(text) + 1
        ordered = sorted(self._found, key=lambda each: toml_place.find(text, each[0]) or last)
        told = []
        for key, message in ordered[:_MOST]:
            place = self._document.place(key)
            # Code of the user's own that failed is told with its lines.
            told.append(("\n".join(cut(line, LONGEST - len(place) - 2) for line in message.split("\n")), place))
        if len(ordered) > _MOST:
            told.append((f"{len(ordered) - _MOST} more are wrong", self._document.path.name))
        raise ProblemError.several(told)


def shipped() -> list[str]:
    """Return the names of the problems that come with the installation, e.g. "huang2020/detumble"."""
    return assets.problems()


def locate(problem: str | Path) -> Path:
    """Return the path of a problem given by a path or by the name of a shipped one."""
    path = Path(problem)
    try:
        if path.is_file():
            return path
        there = path.exists()
        name = path.with_suffix("").as_posix()
    except (OSError, ValueError):
        raise ProblemError(f"{cut(str(problem), SHOWN)!r} names no file") from None
    known = shipped()
    if name.removeprefix("problems/") in known:
        return assets.folder("problems") / f"{name.removeprefix('problems/')}.toml"
    if there:
        raise ProblemError("is a folder or a pipe, expected a problem file", cut(str(problem), LONGEST // 2))
    near = difflib.get_close_matches(name[:SHOWN], known, 1)
    hint = f'; did you mean "{near[0]}"?' if near else "; `casadi-gnc problems` lists those that are shipped"
    raise ProblemError(f"no problem file {cut(str(problem), LONGEST // 2)!r}{hint}")


def read(problem: str | Path) -> Document:
    """Return a problem file as it stands; raise `ProblemError` on bad TOML."""
    path = locate(problem)
    text = text_of(path)
    character = refused(text)  # in a comment too: the file travels with the packages that are made of it
    if character:
        number = next(k for k, line in enumerate(text.split("\n"), 1) if refused(line))
        raise ProblemError(
            f"holds the character {character}, which is invisible and can change what a reader takes the rest for; "
            "leave it out",
            f"{path.name}, line {number}",
        )
    return of_text(path, text)


def of_text(path: Path, text: str) -> Document:
    """Return the document of a text; raise `ProblemError` where it is no TOML, or has what no file can have."""
    try:
        document = Document(path, text, toml_text.parsed(text))
    except toml_text.TextError as error:
        raise ProblemError(f"is not valid TOML: this line {error}", f"{path.name}, line {error.line}") from None
    complaints = Complaints(document)
    for key, message in toml_text.misfits(document.data):
        complaints.add(key, message)
    complaints.settle()
    return document


def read_kind(problem: str | Path, kind: str) -> Document:
    """Return a problem file; raise `ProblemError` if it is of another kind."""
    document = read(problem)
    if document.data.get("kind") != kind:
        given = document.data.get("kind")
        what = "is missing" if given is None else f"is {shown(given)}"
        message = f'kind {what}; this takes a file of kind "{kind}"'
        raise ProblemError(message, document.place(("kind",)))
    return document
