"""Say on which line of a TOML text a key stands, so that an error can point there."""

from __future__ import annotations

import re
from functools import lru_cache
from pathlib import Path as FilePath

from casadi_gnc.tables.wording import LONGEST, SHOWN, cut

_NAME = r"(?:[A-Za-z0-9_-]+|\"[^\"]*\"|'[^']*')"
_DOTTED = rf"{_NAME}(?:\s*\.\s*{_NAME})*"
_TABLE = re.compile(rf"^\s*(\[\[?)\s*({_DOTTED})\s*\]\]?\s*(#.*)?$")
_KEY = re.compile(rf"^\s*({_DOTTED})\s*=")
#: What may hold brackets that are none: strings of one line, and comments.
_QUIET = re.compile(r"\"(?:[^\"\\]|\\.)*\"|'[^']*'|#.*")

Path = tuple[str | int, ...]


@lru_cache(maxsize=4)
def lines_of(text: str) -> dict[Path, int]:
    """Return the line number (from 1) of every table header and key, by its path.

    Paths are as pydantic gives them: names, and indices for arrays of tables. Keys inside inline
    tables are found on the line of the key that holds them.
    """
    places: dict[Path, int] = {}
    counts: dict[Path, int] = {}
    table: Path = ()
    depth, fence = 0, ""
    for number, line in enumerate(text.splitlines(), 1):
        if fence:  # inside a string of several lines
            if fence not in line:
                continue
            line, fence = line.split(fence, 1)[1], ""
        elif depth == 0 and (header := _TABLE.match(line)):
            table = _table_path(header[2], header[1] == "[[", counts)
            places.setdefault(table, number)
            continue
        elif depth == 0 and (key := _KEY.match(line)):
            places.setdefault(table + tuple(_names(key[1])), number)
        line, fence = _without_long_strings(line)
        bare = _QUIET.sub("", line)
        depth = max(0, depth + sum(bare.count(c) for c in "[{") - sum(bare.count(c) for c in "]}"))
    return places


def find(text: str, path: Path) -> int | None:
    """Return the line of the nearest enclosing key or table that stands in the text; of several tables, the first's."""
    places = lines_of(text)
    for length in range(len(path), 0, -1):
        for there in (path[:length], (*path[:length], 0)):
            if there in places:
                return places[there]
    return None


def describe(path: FilePath, text: str, key: Path) -> str:
    """Return "file, line n, table.key[i]" for messages; elements are counted from 1."""
    line = find(text, key)
    dotted = "".join(f"[{part + 1}]" if isinstance(part, int) else f".{cut(part, SHOWN)}" for part in key).lstrip(".")
    return ", ".join(filter(None, (path.name, f"line {line}" if line else "", cut(dotted, LONGEST // 2))))


def _without_long_strings(line: str) -> tuple[str, str]:
    """Return the line without strings in triple quotes, and the quotes of one left open."""
    while True:
        starts = [(line.find(quotes), quotes) for quotes in ('"""', "'''") if quotes in line]
        if not starts:
            return line, ""
        at, quotes = min(starts)
        end = line.find(quotes, at + 3)
        if end < 0:
            return line[:at], quotes
        line = line[:at] + line[end + 3 :]


def _names(dotted: str) -> list[str]:
    return [part.strip("\"'") for part in re.findall(_NAME, dotted)]


def _table_path(dotted: str, is_array: bool, counts: dict[Path, int]) -> Path:
    path: Path = ()
    names = _names(dotted)
    for i, name in enumerate(names):
        path += (name,)
        if is_array and i == len(names) - 1:
            counts[path] = counts.get(path, -1) + 1
        if path in counts:
            path += (counts[path],)
    return path
