"""Write a problem file with other values: the text as it stands, comments and order, but for what is changed.

A value that changes is written in its place, in a list or a table in one line too; a key that the file has not, below
the head of its table. Where a text cannot be changed so (a table in dots, say), the whole content is written anew,
without its comments.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator, Mapping
from typing import Any

from casadi_gnc.missions.craft import Craft
from casadi_gnc.problem_files.changing import changed
from casadi_gnc.problem_files.document import Document
from casadi_gnc.problem_files.toml_spans import Key, Layout, layout_of

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
    layout, edits, whole = layout_of(document.text), list[tuple[int, int, str]](), ""
    for key in _apart(document.data, wanted, ()):
        value = _at(wanted, key)
        if key in layout.values:
            edits.append((*layout.values[key], written(value)))
        elif len(key) == 1 and isinstance(value, dict):
            whole += f"\n\n[{_name(str(key[0]))}]\n{dumped(value, (str(key[0]),)).rstrip()}"
        elif key[:-1] in layout.heads and isinstance(key[-1], str):
            edits.append(_added(document.text, layout, key, value))
    text = document.text
    for begin, end, put in sorted(edits, reverse=True):
        text = text[:begin] + put + text[end:]
    text = f"{text.rstrip()}{whole}\n" if whole else text
    return text if _reads_as(text, wanted) else dumped(wanted)


def _at(content: Any, key: Key) -> Any:
    for part in key:
        content = content[part]
    return content


def _added(text: str, layout: Layout, key: Key, value: Any) -> tuple[int, int, str]:
    """Return (begin, end, what comes there) for a key that a table has not."""
    at, pair = layout.heads[key[:-1]], f"{_name(str(key[-1]))} = {written(value)}"
    if key[:-1] not in layout.values:
        return at, at, f"{pair}\n"
    others = text[at : layout.values[key[:-1]][1] - 1].strip()  # of { ... }
    return at, at, f" {pair}," if others else f" {pair} "


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
