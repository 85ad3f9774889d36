"""Write a problem file with other values: the text as it stands, comments and order, but for what is changed.

A value that changes is written in its place, a key that the file has not, below the head of its table. Where a text
cannot be changed so (a table in dots, say), the whole content is written anew, without its comments.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator, Mapping
from typing import Any

from casadi_gnc.missions.craft import Craft
from casadi_gnc.problem_files import toml_place
from casadi_gnc.problem_files.changing import changed
from casadi_gnc.problem_files.document import Document

Key = tuple[str | int, ...]
_BARE = re.compile(r"[A-Za-z0-9_-]+")


def rewritten(
    document: Document, changes: Mapping[str, Any], craft: type[Craft], leave_out: tuple[str, ...] = ()
) -> str:
    """Return the text of a mission file with other values.

    Parameters
    ----------
    document : of a mission file.
    changes : values by path, as for `casadi_gnc.problem_files.changing.changed`.
    craft : the file's.
    leave_out : top-level tables that the text is not to have.

    Raises
    ------
    ProblemError
        For a path that leads nowhere.
    """
    wanted = _without_none(changed(document.data, changes, craft))
    for name in leave_out:
        wanted.pop(name, None)
    text = document.text
    for key in dict.fromkeys(_whole(text, key) for key in _apart(document.data, wanted, ())):
        text = _put(text, key, wanted)
    return text if _reads_as(text, wanted) else dumped(wanted)


def _without_none(value: Any) -> Any:
    """Return content without the keys that have no value: defaults that no file can write."""
    if isinstance(value, dict):
        return {name: _without_none(each) for name, each in value.items() if each is not None}
    return [_without_none(each) for each in value] if isinstance(value, list) else value


def _apart(old: Any, new: Any, done: Key) -> Iterator[Key]:
    """Yield the key of everything that differs."""
    if isinstance(old, dict) and isinstance(new, dict):
        for name in new:
            if name not in old:
                yield (*done, name)
            else:
                yield from _apart(old[name], new[name], (*done, name))
    elif isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        for i, (one, other) in enumerate(zip(old, new, strict=True)):
            yield from _apart(one, other, (*done, i))
    elif type(old) is not type(new) or old != new:
        yield done


def _whole(text: str, key: Key) -> Key:
    """Return the longest part of a key that stands as a key of its own in the text; the key itself where none does."""
    lines, places = text.splitlines(), toml_place.lines_of(text)
    for length in range(len(key), 0, -1):
        number = places.get(key[:length])
        if number is not None and not lines[number - 1].lstrip().startswith("["):
            return key[:length]
        if number is not None:
            break
    return key


def _put(text: str, key: Key, wanted: dict[str, Any]) -> str:
    """Return the text with the value that is wanted at a key; as it was where no place for it is found."""
    value: Any = wanted
    for part in key:
        value = value[part]
    lines, places = text.splitlines(keepends=True), toml_place.lines_of(text)
    number = places.get(key)
    if number is not None and not lines[number - 1].lstrip().startswith("["):
        start = sum(map(len, lines[: number - 1])) + lines[number - 1].index("=") + 1
        start += len(text[start:]) - len(text[start:].lstrip(" \t"))
        return text[:start] + written(value) + text[_end(text, start) :]
    if len(key) == 1 and isinstance(value, dict):
        return f"{text.rstrip()}\n\n[{_name(str(key[0]))}]\n{dumped(value, (str(key[0]),))}"
    head = places.get(key[:-1])
    if head is None or not isinstance(key[-1], str):
        return text
    at = sum(map(len, lines[:head]))
    return f"{text[:at]}{_name(key[-1])} = {written(value)}\n{text[at:]}"


def _end(text: str, start: int) -> int:
    """Return where the value that begins at a place ends."""
    depth, at = 0, start
    while at < len(text):
        for quotes in ('"""', "'''", '"', "'"):
            if text.startswith(quotes, at):
                at += len(quotes)
                while at < len(text) and not text.startswith(quotes, at):
                    at += 2 if quotes[0] == '"' and text[at] == "\\" else 1
                at += len(quotes) - 1
                break
        else:
            if text[at] in "[{":
                depth += 1
            elif text[at] in "]}":
                depth -= 1
            elif text[at] == "#" and depth:
                at = text.find("\n", at)
                if at < 0:
                    return len(text)
            elif depth == 0 and text[at] in "\n#":
                return at - (len(text[start:at]) - len(text[start:at].rstrip()))
        at += 1
    return len(text.rstrip())


def _reads_as(text: str, wanted: dict[str, Any]) -> bool:
    try:
        return not list(_apart(tomllib.loads(text), wanted, ())) and not list(_apart(wanted, tomllib.loads(text), ()))
    except tomllib.TOMLDecodeError:
        return False


def written(value: Any) -> str:
    """Return a value as TOML has it, on one line; numbers with all their digits."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (int, float)):
        return repr(value)
    if isinstance(value, str):
        return _quoted(value)
    if isinstance(value, list):
        return f"[{', '.join(map(written, value))}]"
    inside = ", ".join(f"{_name(name)} = {written(each)}" for name, each in value.items())
    return f"{{ {inside} }}" if inside else "{}"


def dumped(data: dict[str, Any], above: tuple[str, ...] = ()) -> str:
    """Return content as a TOML text: keys first, then a [table] or [[tables]] each."""
    tables = {name: each for name, each in data.items() if isinstance(each, dict)}
    lists = {
        name: each
        for name, each in data.items()
        if isinstance(each, list) and each and all(isinstance(item, dict) for item in each)
    }
    text = "".join(
        f"{_name(name)} = {written(each)}\n" for name, each in data.items() if name not in {**tables, **lists}
    )
    for name, each in tables.items():
        path = (*above, name)
        text += f"\n[{'.'.join(map(_name, path))}]\n{dumped(each, path)}"
    for name, items in lists.items():
        path = (*above, name)
        text += "".join(f"\n[[{'.'.join(map(_name, path))}]]\n{dumped(item, path)}" for item in items)
    return text


def _name(name: str) -> str:
    return name if _BARE.fullmatch(name) else _quoted(name)


def _quoted(text: str) -> str:
    inside = text.replace("\\", "\\\\").replace('"', '\\"')
    return '"' + "".join(each if each.isprintable() else f"\\u{ord(each):04x}" for each in inside) + '"'
