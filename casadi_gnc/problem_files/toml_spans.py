"""Where in a TOML text each value stands, from its first to its last character, so that one can be put in its place.

The text has been parsed before: what is read here is known to be TOML, and only its layout is of interest.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field

Key = tuple[str | int, ...]

_BARE = re.compile(r"[A-Za-z0-9_-]+")
_BLANK = re.compile(r"[ \t]*")
_NOTHING = re.compile(r"(?:[ \t\r\n]|#[^\n]*)*")
_PLAIN = re.compile(r"[^,\]}#\n\r]+")
_QUOTED = re.compile(r"\"\"\"(?:[^\\]|\\.)*?\"{3,5}|'''.*?'{3,5}|\"(?:[^\"\\\n]|\\.)*\"|'[^'\n]*'", re.DOTALL)


@dataclass
class Layout:
    """Hold places in a text.

    Parameters
    ----------
    values : begin and end of each value, by its path; items of lists have their number from 0.
    heads : end of the line of each table's header, by its path; () is the begin of the text.
    """

    values: dict[Key, tuple[int, int]] = field(default_factory=dict)
    heads: dict[Key, int] = field(default_factory=lambda: {(): 0})


def layout_of(text: str) -> Layout:
    """Return where the values of a TOML text stand; of no use for what `toml_text.parsed` refuses."""
    return _Reader(text).read()


class _Reader:
    def __init__(self, text: str) -> None:
        self.text, self.at, self.found = text, 0, Layout()
        self._counts: dict[Key, int] = {}

    def read(self) -> Layout:
        table: Key = ()
        while self._skip(_NOTHING) < len(self.text):
            if self.text[self.at] == "[":
                table = self._header()
                end = self.text.find("\n", self.at)
                self.at = len(self.text) if end < 0 else end + 1
                self.found.heads[table] = self.at
            else:
                self._pair(table)
        return self.found

    def _skip(self, pattern: re.Pattern[str]) -> int:
        found = pattern.match(self.text, self.at)
        assert found is not None
        self.at = found.end()
        return self.at

    def _header(self) -> Key:
        many = self.text.startswith("[[", self.at)
        self.at += 2 if many else 1
        names, path = self._names(), ()
        for i, name in enumerate(names):
            path = (*path, name)
            if many and i == len(names) - 1:
                self._counts[path] = self._counts.get(path, -1) + 1
            if path in self._counts:
                path = (*path, self._counts[path])
        return path

    def _names(self) -> list[str]:
        names = []
        while True:
            self._skip(_BLANK)
            found = _QUOTED.match(self.text, self.at) or _BARE.match(self.text, self.at)
            assert found is not None
            self.at = found.end()
            names.append(_unquoted(found[0]))
            self._skip(_BLANK)
            if self.text[self.at] != ".":
                return names
            self.at += 1

    def _pair(self, table: Key) -> None:
        path = (*table, *self._names())
        self.at += 1  # =
        self._skip(_BLANK)
        self._value(path)

    def _value(self, path: Key) -> None:
        begin = self.at
        quoted = _QUOTED.match(self.text, begin)
        if quoted:
            self.at = quoted.end()
        elif self.text[begin] == "[":
            self._items(path)
        elif self.text[begin] == "{":
            self._inline(path)
        else:
            plain = _PLAIN.match(self.text, begin)
            assert plain is not None
            self.at = begin + len(plain[0].rstrip())
        self.found.values[path] = (begin, self.at)

    def _items(self, path: Key) -> None:
        self.at += 1
        for number in range(len(self.text)):
            self._skip(_NOTHING)
            if self.text[self.at] == "]":
                break
            self._value((*path, number))
            self._comma()
        self.at += 1

    def _inline(self, path: Key) -> None:
        self.at += 1
        self.found.heads[path] = self.at
        while self.text[self._skip(_NOTHING)] != "}":
            self._pair(path)
            self._comma()
        self.at += 1

    def _comma(self) -> None:
        if self.text[self._skip(_NOTHING)] == ",":
            self.at += 1


def _unquoted(name: str) -> str:
    if name.startswith("'"):
        return name[1:-1]
    if not name.startswith('"'):
        return name
    import tomllib

    return next(iter(tomllib.loads(f"{name} = 0")))
