"""Write files so that nobody ever sees half of one."""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from casadi_gnc.errors import OutputError
from casadi_gnc.system import temporary


def write_beside(target: Path, write: Callable[[Path], Any]) -> None:
    """Call `write` on a file beside `target`, then rename it: readers never see half a file, not even after a crash."""
    with temporary.file(target.parent, target.stem, target.suffix) as place:
        write(place)
        os.chmod(place, 0o644)
        put_in_place(place, target)


def put_in_place(ready: Path, target: Path) -> None:
    """Rename a file that is complete to where it belongs; its content is on the disk before its name is."""
    flush(ready)
    os.replace(ready, target)
    with contextlib.suppress(OSError):  # not every file system can, and the file is whole without
        flush(target.parent)


def flush(path: Path) -> None:
    """Wait until a file or folder is on the disk; raise `OSError` where it cannot be written there."""
    if os.name == "nt":  # which lets nobody flush what was opened to be read
        return
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def prepare_folder(folder: Path) -> Path:
    """Return a folder that exists and can be written; raise `OutputError` before any work is done."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        reason = error.strerror or str(error)
        raise OutputError(
            f"cannot write to the output folder {str(folder)!r}: {reason}; choose another --out"
        ) from error
    return folder
