"""Code that a user keeps beside a problem file: "./sail.py:SailCraft" names a class of a file of their own.

A guest's file lies in the folder of the problem file or below it. It is run once for each of its texts,
under a module name made of its hash, so that a class has one identity however often it is named and a
pickle finds it again. Before it runs the logger `casadi_gnc` says so (the command line prints it). A guest
is one file: what several share goes into an installed package.
"""

from __future__ import annotations

import hashlib
import importlib.abc
import importlib.util
import logging
import sys
import traceback
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from types import ModuleType
from typing import Any

from casadi_gnc.errors import GuestError

LOG = logging.getLogger("casadi_gnc")
_PREFIX = "casadi_gnc_guest_"


@dataclass(frozen=True)
class GuestFile:
    """Hold a file of a user's code, or of numbers that a problem file names.

    Parameters
    ----------
    path : below the folder of the problem file, with slashes: "sail.py", "parts/sail.py".
    text : its content.
    """

    path: str
    text: str

    @property
    def sha256(self) -> str:
        """Hash of the content."""
        return hashlib.sha256(self.text.encode()).hexdigest()

    @property
    def module(self) -> str:
        """Name of the module that it becomes: the same for the same text, wherever it lies."""
        return f"{_PREFIX}{PurePosixPath(self.path).stem}_{self.sha256[:16]}"


#: Guests by the name of their module.
_KNOWN: dict[str, GuestFile] = {}


#: Files that were used since `recorded` began, innermost last.
_RECORDS: list[list[GuestFile]] = []


#: Folders in which files of numbers are looked for, innermost last.
_FOLDERS: list[Path] = []


@contextmanager
def looking_in(folder: Path) -> Iterator[None]:
    """Look for files of numbers in a folder, as long as it lasts; otherwise in the current one."""
    _FOLDERS.append(folder)
    try:
        yield
    finally:
        _FOLDERS.pop()


@contextmanager
def recorded() -> Iterator[list[GuestFile]]:
    """Give the list to which every guest's file is added that is named inside."""
    found: list[GuestFile] = []
    _RECORDS.append(found)
    try:
        yield found
    finally:
        _RECORDS.pop()


def is_guest(reference: Any) -> bool:
    """Return whether a name is meant for a file of the user's own: "./file.py:Class"."""
    return isinstance(reference, str) and (reference.startswith(("./", "../", "/", "~")) or ".py:" in reference)


def load(reference: str, folder: Path) -> Any:
    """Return what "./file.py:Name" names; `folder` is that of the problem file.

    Raises
    ------
    GuestError
        For a name of another form, a file that is not there or leads out of the folder, an error in it, or a
        name that it does not define.
    """
    file = read(reference, folder)
    for record in _RECORDS:
        if file not in record:
            record.append(file)
    name = reference.rpartition(":")[2]
    found = getattr(run(file, folder / file.path), name, None)
    if found is None:
        defined = [key for key, value in vars(sys.modules[file.module]).items() if _is_own(value, file.module)]
        told = f"it defines {', '.join(defined)}" if defined else "it defines no class"
        raise GuestError(f"{reference!r}: {file.path} has no {name!r}; {told}")
    return found


def _is_own(value: Any, module: str) -> bool:
    return isinstance(value, type) and value.__module__ == module


def read(reference: str, folder: Path) -> GuestFile:
    """Return the file that a reference names; raise `GuestError` where it names none below `folder`."""
    path, colon, name = reference.rpartition(":")
    inside = PurePosixPath(path)
    if not colon or not path.startswith("./") or inside.suffix != ".py" or not name.isidentifier():
        raise GuestError(f'{reference!r} names no code of your own; write "./file.py:Class", beside the problem file')
    return _file(reference, inside, folder)


def data(reference: str) -> Path:
    """Return where a file of numbers lies that a problem file names; it is then part of the mission, like code.

    It lies in the folder of `looking_in` or below it.

    Raises
    ------
    GuestError
        For a file that is not there, or leads out of the folder.
    """
    inside, folder = PurePosixPath(reference), _FOLDERS[-1] if _FOLDERS else Path()
    file = _file(reference, inside, folder)
    for record in _RECORDS:
        if file not in record:
            record.append(file)
    return folder / inside


def _file(reference: str, inside: PurePosixPath, folder: Path) -> GuestFile:
    """Return a file that lies in a folder or below it; raise `GuestError` where there is none."""
    if inside.is_absolute() or ".." in inside.parts:
        raise GuestError(f"{reference!r} leads out of the problem file's folder; put the file there or below it")
    target = folder / inside
    if not target.is_file():
        raise GuestError(
            f"{reference!r}: there is no file {inside} in {folder.resolve().name}/; what a problem file names lies "
            "beside it or below, what an option of a command names in the current folder"
        )
    if not target.resolve().is_relative_to(folder.resolve()):
        raise GuestError(f"{reference!r} is a link that leads out of the problem file's folder; copy the file there")
    try:
        return GuestFile(inside.as_posix(), target.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise GuestError(f"{reference!r}: {inside} cannot be read as UTF-8 text: {error}") from error


def run(file: GuestFile, place: Path | None = None) -> ModuleType:
    """Return the module of a guest's file, run if it has not been; raise `GuestError` with its own lines."""
    if file.module in sys.modules:
        return sys.modules[file.module]
    shown = str(place) if place is not None and place.is_file() else file.path
    LOG.info("running the code of %s (sha256 %s)", shown, file.sha256[:12])
    module = ModuleType(file.module)
    module.__file__ = shown
    module.__loader__ = _Text(file)  # so that its lines are shown by tracebacks and `inspect`
    module.__spec__ = importlib.util.spec_from_loader(file.module, module.__loader__, origin=shown)
    sys.modules[file.module] = module
    _KNOWN[file.module] = file
    try:
        exec(compile(file.text, shown, "exec"), vars(module))
    except (Exception, SystemExit) as error:
        del sys.modules[file.module]
        raise GuestError(f"{file.path} cannot be run: {told(error, shown)}{_hint(error, place)}") from error
    return module


class _Text(importlib.abc.InspectLoader):
    """Give the text of a guest's module, which may be on no disk."""

    def __init__(self, file: GuestFile) -> None:
        self._file = file

    def get_source(self, fullname: str) -> str:
        """Return the text."""
        return self._file.text


def _hint(error: BaseException, place: Path | None) -> str:
    missing = error.name if isinstance(error, ModuleNotFoundError) and place is not None else None
    if missing and place is not None and (place.parent / f"{missing}.py").is_file():
        return f"\n  {missing}.py lies beside it, but a guest is one file: move what it needs in there, or install it"
    return ""


def told(error: BaseException, file: str = "") -> str:
    """Return an exception of foreign code as one sentence, then its own lines; of no other file where one is given.

    Examples
    --------
    >>> told(ValueError("too small"))
    'ValueError: too small'
    """
    sentence = f"{type(error).__name__}: {error}".rstrip(": ")
    return sentence + own_lines(error, file)


def own_lines(error: BaseException, file: str = "") -> str:
    """Return where in foreign code an exception came from: a line each, with what stands there."""
    if isinstance(error, SyntaxError):
        return f"\n  {file or error.filename}, line {error.lineno}: {(error.text or '').strip()}"
    frames = [frame for frame in traceback.extract_tb(error.__traceback__) if _theirs(frame.filename, file)]
    return "".join(f"\n  {frame.filename}, line {frame.lineno}, in {frame.name}: {frame.line}" for frame in frames)


def _theirs(filename: str, file: str) -> bool:
    own = {guest.path for guest in _KNOWN.values()} | {getattr(sys.modules.get(m), "__file__", "") for m in _KNOWN}
    return filename == file if file else filename in own


def files_of(*objects: Any) -> tuple[GuestFile, ...]:
    """Return the guests' files from which the classes of some objects come, sorted by path."""
    found = {}
    for each in objects:
        for kind in (each if isinstance(each, type) else type(each)).__mro__:
            if kind.__module__ in _KNOWN:
                found[kind.__module__] = _KNOWN[kind.__module__]
    return tuple(sorted(found.values(), key=lambda file: (file.path, file.sha256)))


def run_all(files: Iterable[GuestFile]) -> None:
    """Run guests' files that are not: what a pickle needs before its objects can be made."""
    for file in files:
        if file.path.endswith(".py"):  # others are numbers
            run(file)
