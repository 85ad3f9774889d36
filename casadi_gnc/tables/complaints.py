"""What is wrong with a table, one sentence a key, in the words of who wrote the file."""

from __future__ import annotations

import difflib
from collections.abc import Iterator
from typing import Any, Literal, get_args, get_origin

from pydantic import BaseModel, ValidationError

from casadi_gnc.tables.part import MisfitError, SeveralMisfitsError
from casadi_gnc.tables.wording import SHOWN, cut, expected, kind_asked, length_asked, shown

Path = tuple[str | int, ...]
#: A misspelled key leaves the right one missing: so alike that they are one mistake.
_ONE_MISTAKE = 0.6


def sentences(error: ValidationError, model: type[BaseModel], data: Any) -> list[tuple[Path, str]]:
    """Return the path of each key that is wrong, and what is wrong with it; one sentence a key.

    Parameters
    ----------
    error : what pydantic found.
    model : which model it was.
    data : the content that was given, to tell keys of the file from alternatives that were tried.
    """
    problems: dict[Path, list[Any]] = {}
    for problem in _each(error):
        path = _path(problem, data)
        context = problem.get("ctx", {}).get("error")
        if isinstance(context, MisfitError):
            path = (*path, *context.path)
        problems.setdefault(path, []).append(problem)
    # Of a choice, what comes nearest: complaints about entries say more than that a list is no number.
    inner = {path[:-1] for path in problems if path and isinstance(path[-1], int)}
    found = {
        path: _sentence(each, path, model, data)
        for path, each in problems.items()
        if not (path in inner and all(kind_asked(one) for one in each))
    }
    unknown = [path for path, each in problems.items() if each[0]["type"] == "extra_forbidden"]
    missing = {path for path, each in problems.items() if each[0]["type"] == "missing"}
    return [
        (path, text)
        for path, text in found.items()
        if not (path in missing and any(_is_meant(path, other) for other in unknown))
    ]


def _each(error: ValidationError) -> Iterator[Any]:
    """Return what pydantic found, of each key by itself."""
    for problem in error.errors(include_url=False):
        raised = problem.get("ctx", {}).get("error")
        if isinstance(raised, SeveralMisfitsError):
            yield from ({**problem, "ctx": {"error": misfit}} for misfit in raised.misfits)
        else:
            yield problem


def _is_meant(missing: Path, given: Path) -> bool:
    same_table = missing[:-1] == given[:-1]
    return same_table and bool(difflib.get_close_matches(str(given[-1]), [str(missing[-1])], 1, _ONE_MISTAKE))


def _path(problem: Any, data: Any) -> Path:
    """Return the place in the file: locations of unions also name the alternative that was tried."""
    path: list[str | int] = []
    at: Any = data
    for part in problem["loc"]:
        if _inside(at, part):
            at = at[part]
        elif part != problem["loc"][-1] or problem["type"] != "missing":
            continue
        path.append(part)
    return tuple(path)


def _inside(at: Any, part: str | int) -> bool:
    if isinstance(at, dict):
        return part in at
    return isinstance(at, list) and isinstance(part, int) and part < len(at)


def value_at(data: Any, path: Path) -> Any:
    """Return what stands at a path of the data; None where nothing does."""
    for part in path:
        if not _inside(data, part):
            return None
        data = data[part]
    return data


def _sentence(problems: list[Any], path: Path, model: type[BaseModel], data: Any) -> str:
    """Return what is wrong at a path; several problems are the alternatives that a value may be."""
    problem, given = problems[0], value_at(data, path)
    kind = problem["type"]
    if kind == "extra_forbidden":
        return "unknown key" + near_key(str(path[-1]), keys_at(model, problem["loc"][:-1], data))
    if kind == "missing":
        return "is missing" + _choices(model, path)
    if kind == "value_error":
        return str(problem.get("ctx", {}).get("error", "does not fit"))
    if kind == "union_tag_invalid":
        told = problem["ctx"]
        known = told["expected_tags"].replace("'", "").split(", ")
        near = difflib.get_close_matches(str(told["tag"])[:SHOWN], known, 1)
        sentence = f"unknown {told['discriminator'].strip(chr(39))} {cut(repr(told['tag']), SHOWN)}"
        return sentence + (f"; did you mean {near[0]}?" if near else f"; known: {', '.join(known)}")
    if kind == "union_tag_not_found":
        key = problem["ctx"]["discriminator"].strip("'")
        return f"lacks the key {key}{_choices(model, (*path, key))}"
    asked = [each for each in map(kind_asked, problems) if each is not None]
    if not asked:
        return length_asked(problem) or f"is {shown(given)}, which does not fit here"
    text = f"is {shown(given)}, expected {expected(asked)}"
    if kind == "list_type" and path and isinstance(path[-1], int):
        text += "; a matrix is written as rows, [[a, 0, 0], [0, b, 0], [0, 0, c]]"
    elif _may_be_left_out(model, path):
        text += "; leave it out for none"
    return text


def _may_be_left_out(model: type[BaseModel], path: Path) -> bool:
    """Return whether the value at a path is that of a key without which a file is as good."""
    return any(type(None) in get_args(annotation) for annotation in _annotations(model, path))


def _choices(model: type[BaseModel], path: Path) -> str:
    """Return which words may stand at a path, as the end of a sentence; "" where it takes more than some words."""
    words = [repr(word) for annotation in _annotations(model, path) for word in _words(annotation)]
    return f"; write one of {', '.join(dict.fromkeys(words))}" if words else ""


def _words(annotation: Any) -> Iterator[str]:
    """Return the words that an annotation consists of, none where it is anything else."""
    if get_origin(annotation) is Literal:
        yield from (word for word in get_args(annotation) if isinstance(word, str))


def _annotations(model: type[BaseModel], path: Path) -> list[Any]:
    """Return what may stand at a path, of each of the models that may hold it."""
    kinds = [model]
    for part in path[:-1]:
        fields = [kind.model_fields[part] for kind in kinds if isinstance(part, str) and part in kind.model_fields]
        kinds = [found for field in fields for found in _models(field.annotation)] if fields else kinds
    return [kind.model_fields[path[-1]].annotation for kind in kinds if path and path[-1] in kind.model_fields]  # type: ignore[index]


def near_key(key: str, known: list[str]) -> str:
    """Return a hint at the key that was probably meant."""
    near = difflib.get_close_matches(key[:SHOWN], known, 1)
    return f"; did you mean {near[0]}?" if near else f"; known here: {', '.join(known)}"


def keys_at(model: type[BaseModel], location: Path, data: Any) -> list[str]:
    """Return the keys that a table may have; in a union, those of the alternative that the table names."""
    kinds, at = [model], data
    for part in location:
        inner = [field for kind in kinds if (field := kind.model_fields.get(str(part))) is not None]
        if inner:
            kinds = [found for field in inner for found in _models(field.annotation)]
        if _inside(at, part):
            at = at[part]
        elif any(part in _tags(kind) for kind in kinds):
            kinds = [kind for kind in kinds if part in _tags(kind)]
    return list(dict.fromkeys(name for kind in kinds for name in kind.model_fields))


def _models(annotation: Any) -> Iterator[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for inner in get_args(annotation):
        yield from _models(inner)


def _tags(kind: type[BaseModel]) -> set[Any]:
    """Return the words by which a table of this kind is told from others."""
    return {word for field in kind.model_fields.values() for word in get_args(field.annotation)}
