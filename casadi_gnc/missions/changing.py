"""Change single values of a problem file's content, by the path at which they stand.

A path is written with dots, `truth.inertia_factor`; an item of a list of tables is taken by its name,
`scheme.funnel_robust.law.attitude_gain`, or by its number from 1, `fault.2.bias_N_m`.
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
        *way, last = path.split(".")
        at: Any = result
        for depth, part in enumerate(way):
            at = _inside(at, part, path, ".".join(way[:depth]) or "the file")
        if isinstance(at, list):
            at[_number(at, last, path, ".".join(way))] = copy.deepcopy(value)
        elif isinstance(at, dict):
            at[last] = copy.deepcopy(value)
        else:
            raise ProblemError(f"{path!r} leads into {'.'.join(way)}, which is {at!r} and has no parts")
    return result


def _inside(at: Any, part: str, path: str, where: str) -> Any:
    if isinstance(at, list):
        return at[_number(at, part, path, where)]
    if isinstance(at, dict) and part in at:
        return at[part]
    known = ", ".join(at) if isinstance(at, dict) else repr(at)
    raise ProblemError(f"{path!r} leads nowhere: {where} has no {part!r}, but {known}")


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
