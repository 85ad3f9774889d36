"""Put a whole folder in the place of another at one moment: whoever looks sees the old one or the new one."""

from __future__ import annotations

import ctypes
import errno
import os
import shutil
import sys
from collections.abc import Iterable
from pathlib import Path

from casadi_gnc.system.files import flush

_AT_FDCWD, _RENAME_EXCHANGE, _RENAME_SWAP = -100, 2, 2
#: What a system says that cannot exchange names, or not on this disk, or not a folder of a container's image (EXDEV).
_CANNOT = (errno.ENOSYS, errno.EINVAL, errno.ENOTSUP, errno.EOPNOTSUPP, errno.EXDEV)


def replace_folder(fresh: Path, folder: Path, ours: Iterable[str], last: str) -> None:
    """Put `fresh` in the place of `folder`; files in it that are not ours stay, linked, never moved.

    Parameters
    ----------
    fresh : beside `folder`, on the same disk; what is replaced is left in its place.
    ours : paths inside `folder`, with slashes, that need not be kept.
    last : of our files, the one that is replaced last where the system cannot exchange two names at one moment.

    Raises
    ------
    OSError
        Where the disk cannot be written; `folder` is as it was.
    """
    for path in fresh.rglob("*"):
        if path.is_file():
            flush(path)
    if not folder.exists() or not any(folder.iterdir()):
        os.replace(fresh, folder)
        return
    known = {*ours, last}
    _keep_others(folder, fresh, known)
    if _exchange(fresh, folder):
        _keep_others(fresh, folder, known)  # what somebody saved at that moment
        return
    wanted = sorted(path.relative_to(fresh).as_posix() for path in fresh.rglob("*") if path.is_file())
    for inside in sorted(wanted, key=lambda path: path == last):
        if inside in known or not (folder / inside).exists():
            (folder / inside).parent.mkdir(parents=True, exist_ok=True)
            os.replace(fresh / inside, folder / inside)
    for inside in known - set(wanted):
        (folder / inside).unlink(missing_ok=True)


def _keep_others(folder: Path, fresh: Path, known: set[str]) -> None:
    """Give the files, links and folders of others a second name in the new folder."""
    for path in sorted(folder.rglob("*")):
        inside = path.relative_to(folder)
        target = fresh / inside
        if inside.as_posix() in known or target.exists() or target.is_symlink():
            continue
        target.parent.mkdir(parents=True, exist_ok=True)
        if path.is_symlink():
            target.symlink_to(os.readlink(path))
        elif path.is_dir():
            target.mkdir(exist_ok=True)
        elif path.is_file():
            try:
                os.link(path, target)
            except OSError:  # a disk without links
                shutil.copy2(path, target)


def _exchange(one: Path, other: Path) -> bool:
    """Exchange two names at one moment; False where the system cannot."""
    library = ctypes.CDLL(None, use_errno=True) if os.name != "nt" else None
    a, b = os.fsencode(one), os.fsencode(other)
    if sys.platform == "linux" and hasattr(library, "renameat2"):
        failed = library.renameat2(_AT_FDCWD, a, _AT_FDCWD, b, _RENAME_EXCHANGE)
    elif sys.platform == "darwin" and hasattr(library, "renamex_np"):
        failed = library.renamex_np(a, b, _RENAME_SWAP)
    else:
        return False
    if not failed:
        return True
    code = ctypes.get_errno()
    if code in _CANNOT:
        return False
    raise OSError(code, os.strerror(code), str(other))
