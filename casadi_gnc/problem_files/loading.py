"""Read problem files: find, check, and build what they describe."""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from casadi_gnc import vehicles as crafts
from casadi_gnc.errors import ProblemError
from casadi_gnc.missions.mission import Mission
from casadi_gnc.problem_files import building, schema, toml_place
from casadi_gnc.problem_files.changing import changed
from casadi_gnc.system import assets
from casadi_gnc.system.text import refused


def shipped() -> list[str]:
    """Return the names of the problems that come with the installation, e.g. "huang2020/detumble"."""
    root = assets.folder("problems")
    return sorted(path.relative_to(root).with_suffix("").as_posix() for path in root.rglob("*.toml"))


def locate(problem: str | Path) -> Path:
    """Return the path of a problem given by a path or by the name of a shipped one."""
    path = Path(problem)
    try:
        if path.is_file():
            return path
        name = path.with_suffix("").as_posix()
    except (OSError, ValueError) as error:
        raise ProblemError(f"{str(problem)[:60]!r} names no file: {error}") from None
    known = shipped()
    if name.removeprefix("problems/") in known:
        return assets.folder("problems") / f"{name.removeprefix('problems/')}.toml"
    near = difflib.get_close_matches(name, known, 1)
    hint = f'; did you mean "{near[0]}"?' if near else "; `casadi-gnc problems` lists those that are shipped"
    raise ProblemError(f"no problem file {str(problem)!r}{hint}")


def read(problem: str | Path) -> tuple[Path, str, dict[str, Any]]:
    """Return path, text and parsed content of a problem file; raise `ProblemError` on bad TOML."""
    path = locate(problem)
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise ProblemError(f"cannot be read as UTF-8 text: {error}", str(problem)) from error
    character = refused(text)  # in a comment too: the file travels with the packages that are made of it
    if character:
        number = next(k for k, line in enumerate(text.split("\n"), 1) if refused(line))
        raise ProblemError(
            f"holds the character {character}, which is invisible and can change what a reader takes the rest for; "
            "leave it out",
            f"{path.name}, line {number}",
        )
    try:
        return path, text, tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise ProblemError(f"is not valid TOML: {error}", path.name) from error


def load(problem: str | Path, changes: Mapping[str, Any] | None = None, *, strict: bool = True) -> Mission:
    """Return the mission that a problem file describes.

    Parameters
    ----------
    problem : path of a TOML file, or the name of a shipped problem such as "huang2020/detumble".
    changes : values to replace, by their path (see `casadi_gnc.problem_files.changing`), e.g.
        {"truth.inertia_factor": 1.2, "scheme.observer_pinv.law.rate_gain": 0.5}.
    strict : refuse a sample time that a law cannot bear; `False` lets `check` say so among other things.

    Raises
    ------
    ProblemError
        With file, line, key, what was given and what was expected.

    Examples
    --------
    >>> mission = load("huang2020/detumble")
    >>> mission.timing.samples
    15001
    """
    path, text, data = read_kind(problem, "mission")
    if changes:
        data = changed(data, changes)
        text += "".join(f"\n# {key} = {value!r}" for key, value in sorted(changes.items()))
    return building.build(check(data, path, text), path, text, strict=strict)


def read_kind(problem: str | Path, kind: str) -> tuple[Path, str, dict[str, Any]]:
    """Return path, text and content of a problem file; raise `ProblemError` if it is of another kind."""
    path, text, data = read(problem)
    if data.get("kind") != kind:
        place = toml_place.describe(path, text, ("kind",))
        raise ProblemError(f'kind is {data.get("kind")!r}; this takes a file of kind "{kind}"', place)
    return path, text, data


def validated(file: Any, data: dict[str, Any], path: Path, text: str) -> Any:
    """Return the data checked by a pydantic model; raise `ProblemError` with place and remedy."""
    try:
        return file.model_validate(data)
    except ValidationError as error:
        raise explain(error, path, text, data, file) from None


def check(data: dict[str, Any], path: Path, text: str) -> Any:
    """Return the checked `MissionFile` of the craft that the data name; raise `ProblemError`."""
    table = data.get("spacecraft")
    name = table.get("model") if isinstance(table, dict) else None
    if name is not None and name not in crafts.names():
        place = toml_place.describe(path, text, ("spacecraft", "model"))
        raise ProblemError(f"{name!r} is no craft; there is {', '.join(crafts.names())}", place)
    return validated(crafts.module(name or crafts.names()[0]).MissionFile, data, path, text)


def explain(error: ValidationError, path: Path, text: str, data: dict[str, Any], top: Any) -> ProblemError:
    """Return the first complaint of pydantic as one sentence with its place in the file."""
    problems = error.errors(include_url=False)
    # A misspelled key leaves the right one missing; the misspelling is what to show.
    first = min(problems, key=lambda problem: problem["type"] != "extra_forbidden")
    key: list[str | int] = []
    at: Any = data
    part: Any
    for part in first["loc"]:
        # Locations of unions also name the alternative that was tried; those are not in the file.
        inside = (isinstance(at, dict) and part in at) or (isinstance(at, list) and isinstance(part, int))
        if inside:
            at = at[part]
        elif part != first["loc"][-1] or first["type"] not in ("missing",):
            continue
        key.append(part)
    if first["type"] == "extra_forbidden":
        message = "unknown key" + _near_key(str(key[-1]), first["loc"], top)
    elif first["type"] == "missing":
        message = "is missing"
    elif first["type"] == "value_error":
        message = str(first.get("ctx", {}).get("error", first["msg"]))
    else:
        message = first["msg"][0].lower() + first["msg"][1:]
        if not isinstance(at, (dict, list)):
            message += f", got {at!r}"
        if first["type"] == "list_type" and isinstance(key[-1], int):
            message += "; a matrix is written as rows, [[a, 0, 0], [0, b, 0], [0, 0, c]]"
    if first["type"] == "union_tag_invalid":
        told: Any = first.get("ctx", {})
        kinds = told["expected_tags"].replace("'", "").split(", ")
        near = difflib.get_close_matches(str(told["tag"]), kinds, 1)
        kind = told["discriminator"].strip("'")
        message = f"unknown {kind} {told['tag']!r}"
        message += f"; did you mean {near[0]}?" if near else f"; known: {', '.join(kinds)}"
    more = f" (and {len(problems) - 1} more)" if len(problems) > 1 else ""
    return ProblemError(message + more, toml_place.describe(path, text, tuple(key)))


def _near_key(key: str, location: tuple[str | int, ...], top: Any) -> str:
    """Return a hint at the key that was probably meant."""
    model: Any = top
    for part in location[:-1]:
        if (
            isinstance(part, str)
            and isinstance(model, type)
            and issubclass(model, BaseModel)
            and part in model.model_fields
        ):
            kinds = [model.model_fields[part].annotation]
            while kinds and not (isinstance(kinds[0], type) and issubclass(kinds[0], BaseModel)):
                kinds = [*getattr(kinds[0], "__args__", ()), *kinds[1:]]
            if not kinds:
                break
            # In a union the table itself tells which alternative is meant.
            model = kinds[0]
        elif isinstance(part, str) and part in schema.LAW_MODELS:
            model = schema.LAW_MODELS[part]
    near = difflib.get_close_matches(key, list(model.model_fields), 1)
    return f"; did you mean {near[0]}?" if near else f"; known here: {', '.join(model.model_fields)}"
