"""What was flown, kept line by line, so that a search that was killed goes on where it was.

The search is a function of what its flights come to. Run again, it asks for the same flights, and those that the
journal has are not flown. A line is whole or is not read: whoever is killed while writing loses one batch.
"""

from __future__ import annotations

import json
import math
import os
from pathlib import Path
from typing import Any

import numpy as np

from casadi_gnc.errors import CampaignError
from casadi_gnc.system.files import prepare_folder


class Journal:
    """Keep the numbers that flights came to, in a file or in memory alone.

    Parameters
    ----------
    identity : of the search, data that JSON can hold.
    place : of the file; None for none.

    Raises
    ------
    CampaignError
        Where the file is of another search, or cannot be written.
    """

    def __init__(self, identity: dict[str, Any], place: Path | None = None) -> None:
        self._known: dict[tuple[int, bytes], float] = {}
        self._gradients: dict[tuple[int, bytes], np.ndarray] = {}
        self._place = place
        if place is None:
            return
        prepare_folder(place.parent)
        first = json.dumps({"search": identity}, sort_keys=True)
        try:
            told = place.read_bytes() if place.exists() else b""
            whole = told[: told.rfind(b"\n") + 1]
            if whole:
                self._take(whole.decode(errors="replace").splitlines(), first)
                if len(whole) < len(told):  # the last line of whoever was killed
                    os.truncate(place, len(whole))
            else:
                place.write_text(first + "\n", encoding="utf-8")
        except OSError as error:
            raise CampaignError(f"cannot write to {str(place)!r}: {error.strerror or error}") from error

    def _take(self, lines: list[str], first: str) -> None:
        if lines[0] != first:
            raise CampaignError(
                f"{self._place} is the journal of another search: another mission, requirement, set, seed or version; "
                "remove it, or give another --out"
            )
        try:
            for line in lines[1:]:
                told = json.loads(line)
                if "gradient" in told:
                    self._gradients[told["of"], _words(told["row"])] = np.array(told["gradient"], dtype=float)
                    continue
                for row, value in zip(told["rows"], told["values"], strict=True):
                    self._known[told["of"], _words(row)] = float(value)
        except (ValueError, KeyError, TypeError) as error:
            raise CampaignError(f"{self._place} cannot be read: {error}; remove it") from error

    def known(self, of: int, rows: np.ndarray) -> np.ndarray:
        """Return which rows have a number, (n,), of a build by its place among several."""
        return np.array([(of, _words(row)) in self._known for row in rows], dtype=bool)

    def numbers(self, of: int, rows: np.ndarray) -> np.ndarray:
        """Return the numbers of rows that have one, (n,)."""
        return np.array([self._known[of, _words(row)] for row in rows])

    def note(self, of: int, rows: np.ndarray, values: np.ndarray) -> None:
        """Keep the numbers of rows."""
        for row, value in zip(rows, values, strict=True):
            self._known[of, _words(row)] = float(value)
        if len(rows):
            self._write({"of": of, "rows": rows.tolist(), "values": _told(values)})

    def gradient(self, of: int, row: np.ndarray) -> np.ndarray | None:
        """Return the derivatives of a row's number by its numbers, (P,), None where they are not known."""
        return self._gradients.get((of, _words(row)))

    def note_gradient(self, of: int, row: np.ndarray, gradient: np.ndarray) -> None:
        """Keep the derivatives of a row's number."""
        self._gradients[of, _words(row)] = gradient
        self._write({"of": of, "row": row.tolist(), "gradient": _told(gradient)})

    def _write(self, told: dict[str, Any]) -> None:
        if self._place is None:
            return
        try:
            with self._place.open("a", encoding="utf-8") as file:
                file.write(json.dumps(told, allow_nan=False) + "\n")
                file.flush()
                os.fsync(file.fileno())
        except OSError as error:
            raise CampaignError(
                f"cannot write to {str(self._place)!r}: {error.strerror or error}; what was flown is kept, and the "
                "same command goes on from there"
            ) from error


def _words(row: Any) -> bytes:
    return np.ascontiguousarray(row, dtype=float).tobytes()


def _told(values: np.ndarray) -> list[float | str]:
    return [value if math.isfinite(value) else str(value) for value in map(float, values)]
