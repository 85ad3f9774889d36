"""Temporary files and folders, swept later where whoever made them was killed.

Each is locked as long as its maker lives: the operating system gives a lock back however a process ends. What has a
name of ours and no lock is left over, and the next who makes one beside it removes it. Where locks are not known
(Windows, some network file systems) nothing is swept.
"""

from __future__ import annotations

import contextlib
import os
import re
import secrets
import shutil
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None

#: Part of every name; nobody else's files are called so.
_MARK = "casadi-gnc-temporary-"
_NAME = re.compile(rf"(\..{{0,40}}\.)?{_MARK}[0-9a-f]{{16}}(\.[^/]*)?")
_swept: set[str] = set()


@contextmanager
def folder(parent: Path, stem: str = "") -> Iterator[Path]:
    """Give an empty folder that nobody else may read, gone afterwards; hidden, beside `stem`, where one is given.

    Raises
    ------
    OSError
        Where none can be made.
    """
    sweep(parent)
    while True:
        made = parent / _name(stem)
        made.mkdir(mode=0o700)
        held = os.open(made, os.O_RDONLY) if fcntl else None
        if _is_held(held, made):
            break
    try:
        yield made
    finally:
        shutil.rmtree(made, ignore_errors=True)
        _close(held)


@contextmanager
def file(parent: Path, stem: str = "", suffix: str = "") -> Iterator[Path]:
    """Give an empty file, gone afterwards unless it was renamed; arguments and errors as for `folder`."""
    sweep(parent)
    while True:
        made = parent / f"{_name(stem)}{suffix}"
        held = os.open(made, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o600)
        if not fcntl:  # an open file could not be renamed
            _close(held)
            held = None
        if _is_held(held, made):
            break
    try:
        yield made
    finally:
        with contextlib.suppress(OSError):
            made.unlink()
        _close(held)


def sweep(parent: Path) -> list[Path]:
    """Remove what killed processes of this user left in a folder, once in each process; return what was removed."""
    place, removed = os.path.abspath(parent), []
    if fcntl is None or place in _swept:
        return removed
    _swept.add(place)
    try:
        entries = [entry for entry in os.scandir(place) if _NAME.fullmatch(entry.name)]
    except OSError:
        return removed
    for entry in entries:
        with contextlib.suppress(OSError):
            if _remove(Path(entry.path)):
                removed.append(Path(entry.path))
    return removed


def _remove(path: Path) -> bool:
    """Remove a file or folder that nobody holds; tell whether it is gone."""
    found = path.lstat()
    if found.st_uid != os.geteuid() or not (stat.S_ISDIR(found.st_mode) or stat.S_ISREG(found.st_mode)):
        return False
    held = os.open(path, os.O_RDONLY | os.O_NOFOLLOW)
    try:
        fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)  # type: ignore[union-attr]
        if stat.S_ISDIR(found.st_mode):
            shutil.rmtree(path, ignore_errors=True)
        else:
            path.unlink()
        return not path.exists()
    finally:
        os.close(held)


def _name(stem: str) -> str:
    return f"{f'.{stem[:30]}.' if stem else ''}{_MARK}{secrets.token_hex(8)}"


def _is_held(held: int | None, made: Path) -> bool:
    """Lock what was made; False where somebody swept it in between."""
    if held is None:
        return True
    with contextlib.suppress(OSError):  # a file system without locks sweeps nothing
        fcntl.flock(held, fcntl.LOCK_EX)  # type: ignore[union-attr]
    if made.exists():
        return True
    os.close(held)
    return False


def _close(held: int | None) -> None:
    if held is not None:
        os.close(held)
