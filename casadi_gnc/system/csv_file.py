"""Tables as text, numbers apart by commas: read so that no entry is ever taken for another.

Blanks around an entry do not count; empty lines, and lines that begin with #, are passed over.
"""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass
from pathlib import Path

from casadi_gnc.errors import ProblemError
from casadi_gnc.system.reading import text_of

#: Largest table that is read [bytes].
LARGEST = 1_000_000_000
_NUMBER = re.compile(r"[-+]?(?:(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?|nan|inf|infinity)", re.IGNORECASE)
_LINE_END = re.compile(r"\r\n|\r|\n")
_SHOWN = 40


@dataclass(frozen=True)
class Table:
    """Hold a table with a line of names.

    Parameters
    ----------
    path : of the file.
    names : of the columns, each once.
    line : the number of the line of names.
    rows : the number of each line, and its entries, as many as there are names.
    """

    path: Path
    names: list[str]
    line: int
    rows: list[tuple[int, list[str]]]

    def column_numbers(self, names: list[str]) -> list[list[float]]:
        """Return the numbers of some columns, row by row; raise `ProblemError` with line and column."""
        at = [self.names.index(name) for name in names]
        found = []
        for line, row in self.rows:
            numbers = []
            for place in at:
                try:
                    numbers.append(number(row[place]))
                except ValueError as error:
                    where = f"{self.path.name}, line {line}, column {self.names[place]}"
                    raise ProblemError(str(error), where) from None
            found.append(numbers)
        return found


def read_table(path: Path) -> Table:
    """Return a table whose first line has the names of its columns.

    Raises
    ------
    ProblemError
        For a file that cannot be read or is empty, a name that stands twice, a row that is not as long as the line
        of names; with the line.
    """
    lines = read_rows(path)
    if not lines:
        raise ProblemError("is empty; expected a line of column names, then rows of numbers", path.name)
    (first, names), *rows = lines
    for name in names:
        if names.count(name) > 1:
            raise ProblemError(f"the column {name[:_SHOWN]!r} is named twice", f"{path.name}, line {first}")
    for line, row in rows:
        if len(row) != len(names):
            hint = "; numbers are written with a decimal point" if len(row) > len(names) else ""
            raise ProblemError(f"{entries(len(row))}, expected {len(names)}{hint}", f"{path.name}, line {line}")
    return Table(path, names, first, rows)


def read_rows(path: Path) -> list[tuple[int, list[str]]]:
    """Return the number of each line that says something, and its entries without the blanks around them.

    Raises
    ------
    ProblemError
        For a file that cannot be read, and for a line that is no row, with its number.
    """
    found = []
    for line, text in enumerate(_LINE_END.split(text_of(path, largest=LARGEST)), 1):
        if not text.strip() or text.lstrip().startswith("#"):
            continue
        try:
            (row,) = csv.reader([text], strict=True)
        except (csv.Error, ValueError):
            what = "no row of a table: a quotation mark is not closed, or an entry is longer than any number"
            raise ProblemError(f"is {what}", f"{path.name}, line {line}") from None
        found.append((line, [entry.strip() for entry in row]))
    return found


def number(text: str) -> float:
    """Return the number that an entry is; raise `ValueError` saying what it is instead.

    Examples
    --------
    >>> number(" 1e-4 ")
    0.0001
    >>> number("0,5")
    Traceback (most recent call last):
    ...
    ValueError: '0,5' is no number
    """
    given = text.strip()
    if not _NUMBER.fullmatch(given):
        shown = given if len(given) <= _SHOWN else f"{given[:_SHOWN]}..."
        raise ValueError(f"{shown!r} is no number" if given else "there is no number")
    return float(given)


def entries(count: int) -> str:
    """Return how many entries there are, in words."""
    return "1 entry" if count == 1 else f"{count} entries"
