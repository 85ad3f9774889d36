"""Patterns of a gain: which of its entries are free, zero, or the same number."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from casadi_gnc.errors import SynthesisError


@dataclass(frozen=True, eq=False)
class Pattern:
    """Hold how the entries of a gain follow from its free numbers.

    Parameters
    ----------
    entries : (m r, k), of zeros, ones and minus ones; the entries, row by row, are entries @ numbers.
    names : of the k numbers; empty where the gain is told as a matrix.
    """

    entries: np.ndarray
    names: tuple[str, ...] = ()


def pattern_of(structure: Sequence[Sequence[Any]] | None, rows: int, columns: int) -> Pattern:
    """Return the pattern of a gain, (rows, columns).

    Parameters
    ----------
    structure : rows of entries: 0, a whole number, or a name; equal ones stand for the same number of the gain, with a
        minus for its negative. By default every entry is free.

    Raises
    ------
    SynthesisError
        For another shape, another kind of entry, numbers beside names, and a gain without a free entry.
    """
    if structure is None:
        return Pattern(np.eye(rows * columns))
    table = [list(row) for row in structure]
    if len(table) != rows or any(len(row) != columns for row in table):
        widths = " and ".join(str(width) for width in sorted({len(row) for row in table}))
        raise SynthesisError(
            f"structure has {len(table)} rows of {widths} entries, expected {rows} of {columns}: a row a command, a "
            "column a measurement"
        )
    flat = [entry for row in table for entry in row]
    signed = [_signed(entry) for entry in flat]
    labels = list(dict.fromkeys(label for _, label in signed if label))
    if not labels:
        raise SynthesisError("structure holds zeros only; name at least one free entry")
    named = [isinstance(label, str) for label in labels]
    if any(named) and not all(named):
        raise SynthesisError("structure names entries by words and by numbers; take one of them")
    entries = np.zeros((rows * columns, len(labels)))
    for place, (sign, label) in enumerate(signed):
        if label:
            entries[place, labels.index(label)] = sign
    return Pattern(entries, tuple(str(label) for label in labels) if all(named) else ())


def _signed(entry: Any) -> tuple[float, int | str]:
    """Return sign and label of an entry, the label 0 for none."""
    if isinstance(entry, str) and entry.removeprefix("-").isidentifier():
        return (-1.0 if entry.startswith("-") else 1.0), entry.removeprefix("-")
    if isinstance(entry, (int, np.integer)) and not isinstance(entry, bool):
        return (-1.0 if entry < 0 else 1.0), abs(int(entry))
    raise SynthesisError(f"structure holds {entry!r}, expected 0, a whole number or a name")
