"""A TOML text: parsed within limits, and what is wrong with it in our words, with its line.

No key of any kind of file takes a date, a number of more than 64 bits, or tables in tables in tables without end: they
are refused here, before anything is done with them.
"""

from __future__ import annotations

import datetime
import re
import tomllib
from collections.abc import Iterator
from typing import Any

from casadi_gnc.tables.wording import cut, shown

Key = tuple[str | int, ...]

#: Deepest nesting of tables and lists, and most entries in all.
DEEPEST, MOST = 16, 200_000
_WORD = r"(?:[A-Za-z0-9_-]+|\"[^\"\n]*\"|'[^'\n]*')"
#: A key of more parts than any file nests: the parser's work grows with the square of its length.
_ENDLESS = re.compile(rf"(?<![A-Za-z0-9_-])(?:{_WORD}[ \t]*\.[ \t]*){{{DEEPEST}}}")
_ENDLESS_NUMBER = re.compile(r"[0-9_]{4300}")
_WHERE = re.compile(r" \(at line (\d+), column (\d+)\)$")
_CLOCK = (datetime.date, datetime.time)

#: Begins of what the parser says, and what we say.
_SAID = {
    "Invalid statement": "begins with what is neither a key nor a [table]",
    "Expected '=' after a key": "has a key without = after it",
    "Invalid value": "has a value that is no number, text in quotes, true, false, list or table",
    "Unclosed array": "is in a list that is not closed by ]",
    "Unclosed inline table": "is in a table that is not closed by }",
    "Duplicate inline table key": "has a key that its table has already",
    "Cannot overwrite a value": "has a key that is given already",
    "Cannot declare": "declares a table that is there already",
    "Cannot mutate immutable namespace": "adds to a table or list that is complete already",
    "Cannot redefine namespace": "declares a table that is there already",
    "Expected ']": "has a table whose name is not closed by ]",
    "Expected newline": "goes on after the end of a value; write one key a line",
    "Expected": "lacks a quotation mark",
    "Illegal character": "has a line end or an invisible character inside a text in quotes",
    "Found invalid character": "has an invisible character",
    "Unterminated string": "has a text whose quotes are not closed",
    "Unescaped": "has a backslash in a text that is none of TOML's; write two, or use single quotes",
    "Invalid hex value": "has a backslash in a text that is none of TOML's; write two, or use single quotes",
    "Escaped character": "names a character that there is not",
    "Invalid initial character": "has a key that begins with a character that no key begins with",
    "Invalid date": "has a date or time that there is not",
}


def parsed(text: str) -> dict[str, Any]:
    """Return the content of a TOML text; raise `TextError` with the line where it is none or beyond the limits."""
    for pattern, what in ((_ENDLESS, "a key of very many parts"), (_ENDLESS_NUMBER, "a number of very many digits")):
        if found := pattern.search(text):
            raise TextError(f"has {what}", text.count("\n", 0, found.start()) + 1)
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        told = str(error)
        where = _WHERE.search(told)
        said = next((ours for begin, ours in _SAID.items() if told.startswith(begin)), "cannot be understood")
        line = int(where[1]) if where else text.count("\n") + 1
        raise TextError(said if where else f"is the last, and the text {_ending(said)}", line) from None
    except (RecursionError, ValueError, OverflowError):
        raise TextError("or one after it is nested too deep, or has a number that is too long", 1) from None


def _ending(said: str) -> str:
    return "ends in the middle of something" if said.startswith(("begins", "has a value")) else said


class TextError(ValueError):
    """Say what is wrong with the text of a file, and in which line."""

    def __init__(self, message: str, line: int) -> None:
        self.line = line
        super().__init__(message)


def misfits(data: dict[str, Any]) -> Iterator[tuple[Key, str]]:
    """Yield the key of each value that no file can have, and what is wrong with it; the first one beyond the limits."""
    count, waiting = 0, list[tuple[Key, Any]]([((), data)])
    while waiting:
        key, value = waiting.pop()
        count += 1
        if count > MOST:
            yield (), f"has more than {MOST} values; split it"
            return
        if isinstance(value, (dict, list)):
            if len(key) >= DEEPEST:
                yield key, f"is nested more than {DEEPEST} deep"
                return
            items = value.items() if isinstance(value, dict) else enumerate(value)
            waiting += [((*key, name), each) for name, each in items]
        elif isinstance(value, _CLOCK):
            yield key, f"is {shown(value)}; no key takes one"
        elif isinstance(value, int) and abs(value) >= 2**63:
            yield key, f"is {cut(shown(value))}, beyond the largest whole number, 2^63; write it with a decimal point"


def extreme(data: dict[str, Any]) -> tuple[Key, float] | None:
    """Return key and value of the number of largest magnitude, None where there is none."""
    best: tuple[Key, float] | None = None
    waiting = list[tuple[Key, Any]]([((), data)])
    while waiting:
        key, value = waiting.pop()
        if isinstance(value, (dict, list)):
            items = value.items() if isinstance(value, dict) else enumerate(value)
            waiting += [((*key, name), each) for name, each in items]
        elif type(value) in (int, float) and (best is None or abs(value) > abs(best[1])):
            best = key, float(value)
    return best
