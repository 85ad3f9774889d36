"""Change single values of a problem file's content, by the path at which they stand.

A path is written with dots, `truth.inertia_factor`; an item of a list of tables is taken by its name,
`scheme.funnel_robust.law.attitude_gain`, or by its number from 1, `fault.2.bias_N_m`; `*` stands for
every item, `scheme.*.force_limit_N.*`.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping
from typing import Any

from casadi_gnc.errors import ProblemError


def changed(data: dict[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return a copy of parsed content with some values replaced, or added to tables that are there.

    Raises
    ------
    ProblemError
        For a path that leads nowhere; the message says where it ends and what there is.
    """
    result = copy.deepcopy(data)
    for path, value in changes.items():
        _put(result, path.split("."), value, path, "the file")
    return result


def _put(at: Any, parts: list[str], value: Any, path: str, where: str) -> None:
    """Set, in place, what the parts of a path lead to."""
    part, rest = parts[0], parts[1:]
    for key in _keys(at, part, path, where, last=not rest):
        if rest:
            _put(at[key], rest, value, path, part if where == "the file" else f"{where}.{part}")
        else:
            at[key] = copy.deepcopy(value)


def _keys(at: Any, part: str, path: str, where: str, *, last: bool) -> list[Any]:
    """Return the keys or places that one part of a path stands for."""
    if isinstance(at, list) and at:
        return list(range(len(at))) if part == "*" else [_number(at, part, path, where)]
    if isinstance(at, dict) and (part in at or part == "*" or last):
        return list(at) if part == "*" else [part]
    told = f"has no {part!r}, but {', '.join(at)}" if isinstance(at, dict) else f"is {at!r} and has no parts"
    raise ProblemError(f"{path!r} leads nowhere: {where} {told}")


def _number(items: list[Any], part: str, path: str, where: str) -> int:
    """Return the place of an item that is given by its name or by its number from 1."""
    names = [item.get("name") if isinstance(item, dict) else None for item in items]
    if part in names:
        return names.index(part)
    if part.isdecimal() and 1 <= int(part) <= len(items):
        return int(part) - 1
    known = [name for name in names if name is not None]
    told = f"by name there is {', '.join(known)}" if known else f"there are {len(items)}, from 1"
    raise ProblemError(f"{path!r} leads nowhere: {where} has no item {part!r}; {told}")
