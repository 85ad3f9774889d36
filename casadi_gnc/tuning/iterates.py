"""The journal of a tuning: a line for each iterate, so that a run that was killed goes on from its last one."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

from casadi_gnc.errors import OutputError, TuningError


class Iterates:
    """Keep lines of plain data in a file, the first of which says what is tuned; without a path nothing is kept.

    Raises
    ------
    TuningError
        For a file that is the journal of another tuning, or none.
    """

    def __init__(self, path: Path | None, identity: dict[str, Any]) -> None:
        self._path = path
        #: What was kept by an earlier run of the same tuning, in order.
        self.kept: list[dict[str, Any]] = []
        if path is None:
            return
        if path.exists():
            self.kept = self._read(path, identity)
        else:
            self._append(identity)

    def add(self, **line: Any) -> None:
        """Keep one more line; it is on the disk when this returns."""
        self._append(line)

    def close(self) -> None:
        """Forget the journal: the tuning is done and its result is written."""
        if self._path is not None:
            self._path.unlink(missing_ok=True)

    def _append(self, line: dict[str, Any]) -> None:
        if self._path is None:
            return
        try:
            with self._path.open("a", encoding="utf-8") as file:
                file.write(json.dumps(line) + "\n")
                file.flush()
                os.fsync(file.fileno())
        except OSError as error:
            raise OutputError(f"cannot write {str(self._path)!r}: {error.strerror or error}") from error

    @staticmethod
    def _read(path: Path, identity: dict[str, Any]) -> list[dict[str, Any]]:
        try:
            text = path.read_bytes().decode(errors="replace")
        except OSError as error:
            raise OutputError(f"cannot read {str(path)!r}: {error.strerror or error}") from error
        whole = text[: text.rfind("\n") + 1]  # the last line of a run that was killed may be half written
        lines: list[Any]
        try:
            lines = [json.loads(line) for line in whole.splitlines()]
        except ValueError:
            lines = [None]
        if whole != text:
            path.write_text(whole, encoding="utf-8")
        if not lines:
            path.write_text(json.dumps(identity) + "\n", encoding="utf-8")
            return []
        # Numbers come back as the same words, so that what was read equals what is asked for.
        if lines[0] != json.loads(json.dumps(identity)):
            raise TuningError(
                f"{path} is the journal of another tuning; move it away to begin anew, or repeat the command that "
                "began it to go on from there"
            )
        return lines[1:]
