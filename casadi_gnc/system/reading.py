"""Read a text that somebody gave: a regular file of bounded size in UTF-8, or one sentence on why it cannot be used."""

from __future__ import annotations

import os
import stat
from pathlib import Path

from casadi_gnc.errors import ProblemError

#: Largest text that is read [bytes], unless a reader allows another.
LARGEST = 1_000_000


def text_of(path: Path, *, largest: int = LARGEST) -> str:
    """Return the text of a file without a byte order mark, lines ending as they do in the file.

    Parameters
    ----------
    path : of a regular file, or of a pipe that a shell made (`/dev/stdin`, `/dev/fd/63`).
    largest : number of bytes beyond which the file is refused before it is read.

    Raises
    ------
    ProblemError
        For a file that is not there, cannot be opened, is no file, is too large, or is no UTF-8; with the line.
    """
    content = bytes_of(path, largest=largest)
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise ProblemError(
            f"cannot be read as UTF-8 text: byte {content[error.start]:#04x} stands where no character begins or ends; "
            "save the file as UTF-8",
            f"{path.name}, line {line}",
        ) from None


def bytes_of(path: Path, *, largest: int) -> bytes:
    """Return the content of a file; arguments and errors as for `text_of`, but for the characters."""
    try:
        content = _bytes(path, largest)
    except OSError as error:
        raise ProblemError(f"cannot be read: {error.strerror or 'the system refuses'}", _short(path)) from None
    except ValueError:  # a zero byte in the name
        raise ProblemError("is no name of a file", _short(path)) from None
    if len(content) > largest:
        raise ProblemError(f"is larger than {largest / 1e6:g} MB; split it, or leave out what is not needed", path.name)
    return content


def _bytes(path: Path, largest: int) -> bytes:
    """Return a file's content, or one byte too much of it; raise `ProblemError` for what may never end."""
    mode = path.stat().st_mode
    pipe = stat.S_ISFIFO(mode) and path.is_relative_to("/dev")
    if not (stat.S_ISREG(mode) or pipe):
        what = "a folder" if stat.S_ISDIR(mode) else "a pipe" if stat.S_ISFIFO(mode) else "a device or socket"
        raise ProblemError(f"is {what}, expected a file", _short(path))
    # Without O_NONBLOCK a pipe that takes the place of the file meanwhile would hang the open.
    handle = os.open(path, os.O_RDONLY | (0 if pipe else getattr(os, "O_NONBLOCK", 0)))
    with os.fdopen(handle, "rb") as file:
        return file.read(largest + 1)


def _short(path: Path) -> str:
    """Return a path for a message; of one that is very long the end."""
    text = str(path)
    return text if len(text) <= 120 else f"...{text[-120:]}"
