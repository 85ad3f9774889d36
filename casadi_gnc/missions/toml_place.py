"""Say on which line of a TOML text a key stands, so that an error can point there."""

from __future__ import annotations

import re
from pathlib import Path as FilePath

_TABLE = re.compile(r"^\s*(\[\[?)\s*([A-Za-z0-9_.\-\" ]+?)\s*\]\]?\s*(#.*)?$")
_KEY = re.compile(r"^\s*([A-Za-z0-9_.\-\"]+)\s*=")

Path = tuple[str | int, ...]


def lines_of(text: str) -> dict[Path, int]:
    """Return the line number (from 1) of every table header and key, by its path.

    Paths are as pydantic gives them: names, and indices for arrays of tables. Keys inside inline
    tables are found on the line of the key that holds them.
    """
    places: dict[Path, int] = {}
    counts: dict[Path, int] = {}
    table: Path = ()
    depth = 0
    for number, line in enumerate(text.splitlines(), 1):
        header = _TABLE.match(line) if depth == 0 else None
        if header:
            table = _table_path(header[2], header[1] == "[[", counts)
            places.setdefault(table, number)
            continue
        key = _KEY.match(line) if depth == 0 else None
        if key:
            places.setdefault(table + tuple(_names(key[1])), number)
        bare = re.sub(r'"[^"]*"|#.*', "", line)
        depth = max(0, depth + sum(bare.count(c) for c in "[{") - sum(bare.count(c) for c in "]}"))
    return places


def find(text: str, path: Path) -> int | None:
    """Return the line of the nearest enclosing key or table that stands in the text."""
    places = lines_of(text)
    for length in range(len(path), 0, -1):
        if path[:length] in places:
            return places[path[:length]]
    return None


def describe(path: FilePath, text: str, key: Path) -> str:
    """Return "file, line n, table.key[i]" for messages; elements are counted from 1."""
    line = find(text, key)
    dotted = "".join(f"[{part + 1}]" if isinstance(part, int) else f".{part}" for part in key).lstrip(".")
    return ", ".join(filter(None, (path.name, f"line {line}" if line else "", dotted)))


def _names(dotted: str) -> list[str]:
    return [part.strip().strip('"') for part in dotted.split(".")]


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
