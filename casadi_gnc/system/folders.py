"""Folders to build in: the user's cache, or a temporary one, whichever can be written and lets libraries run.

A container may have no home and a user without a name, a home that is read-only or full, or a folder from which nothing
may be run (`noexec`). Whatever is left is used; where nothing is, one sentence names each folder, its trouble, and the
variable that chooses another.
"""

from __future__ import annotations

import atexit
import errno
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path

import platformdirs

from casadi_gnc.errors import CompilerError

#: Overrides the cache folder.
CACHE_VARIABLE = "CASADI_GNC_CACHE"
#: Bytes that must be free.
_LEAST_ROOM = 2**21
_NO_ROOM = ("No space left on device", "Disk quota exceeded", "File too large")


def cache_folder() -> Path:
    """Return the folder of compiled libraries; it may not exist yet.

    Without a home it is a private temporary one that lasts as long as the process: what others can write is not run.
    """
    chosen = os.environ.get(CACHE_VARIABLE, "").strip()
    if chosen:
        return Path(chosen).resolve()
    try:
        return Path(platformdirs.user_cache_dir("casadi-gnc")).absolute()
    except (RuntimeError, OSError):  # no home, and a user whom the system does not know
        return private_folder()


@lru_cache
def private_folder() -> Path:
    """Return a temporary folder that lasts as long as the process; raise `CompilerError` if none can be made."""
    try:
        folder = tempfile.TemporaryDirectory(prefix="casadi-gnc-", ignore_cleanup_errors=True)
    except OSError as error:
        raise CompilerError(f"no temporary folder can be written ({reason(error)}); {remedy(None)}") from None
    atexit.register(folder.cleanup)
    return Path(folder.name)


def trouble(folder: Path) -> str | None:
    """Return why nothing can be built in a folder, which is made if need be; None if nothing is wrong."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder) as probe:
            probe.write(b"\0" * 4096)
            probe.flush()
    except OSError as error:
        return f"cannot be written ({reason(error)})"
    if _is_full(folder):
        return "has no space left"
    if forbids_running(folder):
        return "does not let libraries run (it is mounted noexec)"
    return None


def _is_full(folder: Path) -> bool:
    """Tell whether less is free than a small library with its sources takes; file systems that do not say are not."""
    try:
        found = os.statvfs(folder)
    except (OSError, AttributeError):
        return False
    return found.f_blocks > 0 and found.f_bavail * found.f_frsize < _LEAST_ROOM


def forbids_running(folder: Path) -> bool:
    """Tell whether the folder is mounted so that no library in it can be run."""
    flag = getattr(os, "ST_NOEXEC", 0)
    try:
        return bool(flag and os.statvfs(folder).f_flag & flag)
    except (OSError, AttributeError):
        return False


@contextmanager
def workshop() -> Iterator[Path]:
    """Give an empty folder to build and run in, which is gone afterwards; a temporary one, or else one in the cache.

    Raises
    ------
    CompilerError
        If there is none.
    """
    troubles, made = [], None
    for parent in (None, cache_folder()):
        try:
            place = Path(tempfile.gettempdir()) if parent is None else parent
            found = trouble(place)
            if found is None:
                made = tempfile.TemporaryDirectory(dir=place, prefix="casadi-gnc-", ignore_cleanup_errors=True)
                break
            troubles.append(f"{place} {found}")
        except OSError as error:
            troubles.append(f"no temporary folder can be written ({reason(error)})")
    if made is None:
        raise CompilerError(f"there is no folder to build in: {'; '.join(dict.fromkeys(troubles))}; {remedy(None)}")
    with made as name:
        yield Path(name)


def reason(error: OSError) -> str:
    """Return what the system says of an error, in few words."""
    if error.errno == errno.ENOENT and "usable temporary" in str(error):
        return "none of $TMPDIR, /tmp, /var/tmp and the current folder can be written"
    return error.strerror or str(error)


def remedy(folder: Path | None) -> str:
    """Return what to do about a folder: which variable chooses another."""
    if folder is None:
        return f"set {CACHE_VARIABLE} or TMPDIR to a folder that can be written, has room and allows libraries to run"
    inside = folder.resolve().is_relative_to(cache_folder().resolve())
    variable = CACHE_VARIABLE if inside else "TMPDIR"
    return f"free some, or set {variable} to another folder"


def out_of_room(said: str, folder: Path) -> str | None:
    """Return a sentence if a compiler's complaint, or the folder itself, says that the disk is full."""
    if any(words in said for words in _NO_ROOM):
        return f"{folder} has no space left; {remedy(folder)}"
    return None
