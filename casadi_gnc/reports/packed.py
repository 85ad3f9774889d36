"""Numbers for a page: single precision, compressed, as letters."""

from __future__ import annotations

import base64
import zlib

import numpy as np


class Packed:
    """Gather columns of numbers; each is known to the page by the number that `add` returns.

    A column is stored as four planes, the first bytes of all numbers first: they repeat, so that they compress.
    """

    def __init__(self) -> None:
        self.counts: list[int] = []
        self._planes: list[bytes] = []

    def add(self, values: np.ndarray) -> int:
        """Keep a column, (K,), and return its number; what single precision cannot hold is infinite there."""
        with np.errstate(over="ignore"):
            column = np.ascontiguousarray(values, dtype="<f4")
        self._planes.append(column.view(np.uint8).reshape(-1, 4).T.tobytes())
        self.counts.append(len(column))
        return len(self.counts) - 1

    def letters(self) -> str:
        """Return all columns, one after the other, deflated (zlib), in base 64."""
        return base64.b64encode(zlib.compress(b"".join(self._planes), 9)).decode("ascii")
