"""Change single values of a problem file's content, by the path at which they stand.

A path is written with dots, `truth.inertia_factor`; an item of a list of tables is taken by its name,
`scheme.funnel_robust.law.attitude_gain`, or by its number from 1, `fault.2.bias_N_m`; `*` stands for
every item, `scheme.*.force_limit_N.*`. Where a file is silent and its schema has a default, the default is what
is changed. In a symmetric matrix the mirror image of an entry follows it, unless it is changed too.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping
from typing import Any, get_args

from pydantic import BaseModel
from pydantic_core import PydanticUndefined

from casadi_gnc.errors import ProblemError
from casadi_gnc.missions.craft import Craft
from casadi_gnc.problem_files.mission_tables import MissionTables
from casadi_gnc.tables.complaints import near_key
from casadi_gnc.tables.matrices import symmetric_keys
from casadi_gnc.tables.part import own_tables

#: Rows of a symmetric matrix, and which entry of them was changed.
Entry = tuple[list[Any], int, int]


def changed(data: dict[str, Any], changes: Mapping[str, Any], craft: type[Craft]) -> dict[str, Any]:
    """Return a copy of parsed content with some values replaced, or put where the file has none.

    Parameters
    ----------
    data : of a mission file.
    changes : values by path.
    craft : the file's, whose schema says what may be put where the file is silent.

    Raises
    ------
    ProblemError
        For a path that leads nowhere; the message says where it ends and what there is.
    """
    result = copy.deepcopy(data)
    entries: list[Entry] = []
    for path, value in changes.items():
        _put(result, path.split("."), value, path, (), craft, entries)
    given = {(id(rows), i, j) for rows, i, j in entries}
    for rows, i, j in entries:
        if (id(rows), j, i) not in given and j < len(rows) and isinstance(rows[j], list) and i < len(rows[j]):
            rows[j][i] = rows[i][j]
    return result


def _put(
    at: Any, parts: list[str], value: Any, path: str, done: tuple[str, ...], craft: type[Craft], entries: list[Entry]
) -> None:
    """Set, in place, what the parts of a path lead to; note entries of symmetric matrices."""
    part, rest = parts[0], parts[1:]
    for key in _keys(at, part, path, done, rest, craft):
        if not rest:
            at[key] = copy.deepcopy(value)
        elif len(rest) <= 2 and isinstance(at[key], list) and part in _symmetric(craft, done):
            rows = at[key]
            _put(rows, rest, value, path, (*done, part), craft, entries)
            for i in _keys(rows, rest[0], path, (*done, part), rest[1:], craft):
                row = rows[i] if isinstance(rows[i], list) else []
                columns = _keys(row, rest[1], path, (*done, part, rest[0]), [], craft) if rest[1:] else range(len(row))
                entries += [(rows, i, j) for j in columns]
        else:
            _put(at[key], rest, value, path, (*done, part), craft, entries)


def _keys(at: Any, part: str, path: str, done: tuple[str, ...], rest: list[str], craft: type[Craft]) -> list[Any]:
    """Return the keys or places that one part of a path stands for."""
    if isinstance(at, list) and at:
        return list(range(len(at))) if part == "*" else [_number(at, part, path, done)]
    if isinstance(at, dict) and (part in at or part == "*"):
        return list(at) if part == "*" else [part]
    if isinstance(at, dict):
        known = _schema(craft, done)
        default = known.get(part, PydanticUndefined)
        if default is not PydanticUndefined or not known:
            if rest and default is not PydanticUndefined:
                at[part] = default
            if not rest or default is not PydanticUndefined:
                return [part]
        told = f"has no {part!r}{near_key(part, list(dict.fromkeys([*at, *known])))}"
    else:
        told = f"is {at!r} and has no parts"
    raise ProblemError(f"{path!r} leads nowhere: {'.'.join(done) or 'the file'} {told}")


def _number(items: list[Any], part: str, path: str, done: tuple[str, ...]) -> int:
    """Return the place of an item that is given by its name or by its number from 1."""
    names = [item.get("name", item.get("id")) if isinstance(item, dict) else None for item in items]
    if part in names:
        return names.index(part)
    if part.isdecimal() and 1 <= int(part) <= len(items):
        return int(part) - 1
    known = [name for name in names if name is not None]
    told = f"by name there is {', '.join(known)}" if known else f"there are {len(items)}, from 1"
    raise ProblemError(f"{path!r} leads nowhere: {'.'.join(done)} has no item {part!r}; {told}")


def _schema(craft: type[Craft], done: tuple[str, ...]) -> dict[str, Any]:
    """Return the keys that a table may have with their defaults as a file would write them; empty where unknown."""
    own = own_tables(craft)
    if not done:
        top = {**MissionTables.model_fields, **{name: craft.model_fields[name] for name in own}}
        return {name: _written(field) for name, field in top.items()}
    fields = {name: field for model in _tables(craft, done) for name, field in model.model_fields.items()}
    return {name: _written(field) for name, field in fields.items() if done != ("spacecraft",) or name not in own}


def _symmetric(craft: type[Craft], done: tuple[str, ...]) -> set[str]:
    """Return the keys of a table that are symmetric matrices."""
    return {name for model in (_tables(craft, done) if done else []) for name in symmetric_keys(model)}


def _tables(craft: type[Craft], done: tuple[str, ...]) -> list[type[BaseModel]]:
    """Return the models, of which one is that of the table where a path has come to; none where unknown."""
    own = own_tables(craft)
    if done == ("spacecraft",):
        return [craft]
    if done[0] == "spacecraft":
        fields = {name: field for name, field in craft.model_fields.items() if name not in own}
        done = done[1:]
    else:
        fields = {**MissionTables.model_fields, **{name: craft.model_fields[name] for name in own}}
    models = _models(fields[done[0]].annotation) if done[0] in fields else []
    for part in done[1:]:
        inner = [model.model_fields[part] for model in models if part in model.model_fields]
        models = [found for field in inner for found in _models(field.annotation)] or models
    return models


def _models(annotation: Any) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [model for inner in get_args(annotation) for model in _models(inner)]


def _written(field: Any) -> Any:
    """Return a field's default as a file would write it: an empty table for one that must be given."""
    default = field.get_default(call_default_factory=True)
    if isinstance(default, BaseModel):
        return default.model_dump()
    if default is None or default is PydanticUndefined:
        return {} if _models(field.annotation) else default
    return copy.deepcopy(default)
