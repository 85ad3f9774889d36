"""Folders to build in: the user's cache, or a temporary one, whichever can be written and lets libraries run.

A container may have no home and a user without a name, a home that is read-only or full, or a folder from which nothing
may be run (`noexec`). Whatever is left is used; where nothing is, one sentence names each folder, its trouble, and the
variable that chooses another. What others may write is not run: a cache that is not the user's own is left alone.
"""

from __future__ import annotations

import atexit
import errno
import logging
import os
import stat
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from functools import lru_cache
from pathlib import Path

import platformdirs

from casadi_gnc.errors import CompilerError
from casadi_gnc.system import temporary

LOG = logging.getLogger("casadi_gnc")
#: Overrides the cache folder.
CACHE_VARIABLE = "CASADI_GNC_CACHE"
#: Bytes that must be free.
_LEAST_ROOM = 2**21
_NO_ROOM = ("No space left on device", "Disk quota exceeded", "File too large")


def cache_folder() -> Path:
    """Return the folder of compiled libraries; it may not exist yet.

    Of a folder that everybody shares as /tmp is shared it is a private one inside. Without a home, and where the
    folder belongs to somebody else or can be written by others (which is told), it is a private temporary one that
    lasts as long as the process: what others can write is not run.
    """
    chosen = os.environ.get(CACHE_VARIABLE, "").strip()
    try:
        folder = Path(chosen).resolve() if chosen else Path(platformdirs.user_cache_dir("casadi-gnc")).absolute()
    except (RuntimeError, OSError):  # no home, and a user whom the system does not know
        return private_folder()
    if _is_shared(folder):
        folder /= f"casadi-gnc-{os.geteuid()}"
    whose = not_ours(folder)
    if whose is None:
        return folder
    _tell(
        f"the cache {folder} {whose}: nothing in it is used, and libraries are built in a private folder each time; "
        f"set {CACHE_VARIABLE} to a folder that only you can write (chmod 700)"
    )
    return private_folder()


def _is_shared(folder: Path) -> bool:
    """Tell whether all may write in a folder, but each only touch what is their own (the sticky bit)."""
    try:
        return os.name != "nt" and folder.stat().st_mode & 0o1002 == 0o1002
    except OSError:
        return False


@lru_cache
def _tell(sentence: str) -> None:
    """Say a sentence once."""
    LOG.warning("%s", sentence)


def not_ours(path: Path) -> str | None:
    """Return why what a file or folder holds must not be run; None if only this user, or root, can have written it."""
    if os.name == "nt":
        return None
    try:
        found = path.stat()
    except OSError:
        return None
    if found.st_uid not in (os.geteuid(), 0):
        return "belongs to another user"
    if found.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
        return f"can be written by others (its mode is {stat.S_IMODE(found.st_mode):o})"
    return None


@lru_cache
def private_folder() -> Path:
    """Return a temporary folder that lasts as long as the process; raise `CompilerError` if none can be made."""
    held = ExitStack()
    try:
        folder = held.enter_context(temporary.folder(Path(tempfile.gettempdir())))
    except OSError as error:
        raise CompilerError(f"no temporary folder can be written ({reason(error)}); {remedy(None)}") from None
    atexit.register(held.close)
    return folder


def trouble(folder: Path) -> str | None:
    """Return why nothing can be built in a folder, which is made if need be; None if nothing is wrong."""
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
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
    troubles, held = [], ExitStack()
    with held:
        for parent in (None, cache_folder()):
            try:
                place = Path(tempfile.gettempdir()) if parent is None else parent
                found = trouble(place)
                if found is None:
                    made = held.enter_context(temporary.folder(place))
                    break
                troubles.append(f"{place} {found}")
            except OSError as error:
                troubles.append(f"no temporary folder can be written ({reason(error)})")
        else:
            raise CompilerError(f"there is no folder to build in: {'; '.join(dict.fromkeys(troubles))}; {remedy(None)}")
        yield made


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
