"""Read a mission file: find what it names, check every key, build the mission.

Nothing of a file is used before all of it was looked at: what is wrong is told at once, each with its line.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from pydantic import ValidationError, create_model

from casadi_gnc import guests
from casadi_gnc.errors import GncError, ProblemError
from casadi_gnc.laws import REGISTRY as LAWS
from casadi_gnc.laws import Law
from casadi_gnc.missions.craft import REGISTRY as CRAFTS
from casadi_gnc.missions.craft import Craft
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.origin import Origin
from casadi_gnc.problem_files import building, sound_tables
from casadi_gnc.problem_files.boundary import about
from casadi_gnc.problem_files.changing import changed
from casadi_gnc.problem_files.document import Complaints, Document, read_kind
from casadi_gnc.problem_files.law_tables import law_table
from casadi_gnc.problem_files.mission_tables import MissionTables, SchemeTable
from casadi_gnc.tables.complaints import near_key, sentences
from casadi_gnc.tables.part import Part, own_tables


@dataclass(frozen=True, eq=False)
class Checked:
    """Hold a mission file whose every table was checked.

    Parameters
    ----------
    document : as read.
    common : the tables of every mission.
    craft : made of its tables.
    schemes : the table of each scheme, its law's class, and the law's gains.
    """

    document: Document
    common: MissionTables
    craft: Craft
    schemes: list[tuple[Any, type[Law], Part]]


def load(problem: str | Path, changes: Mapping[str, Any] | None = None, *, strict: bool = True) -> Mission:
    """Return the mission that a problem file describes.

    Parameters
    ----------
    problem : path of a TOML file, or the name of a shipped problem such as "huang2020/detumble".
    changes : values to replace, or to put where the file is silent, by their path (see
        `casadi_gnc.problem_files.changing`), e.g. {"noise.seed": 3, "scheme.observer_pinv.law.rate_gain": 0.5}.
    strict : refuse what cannot fly (a sample time that a law cannot bear, actuators that leave an axis out);
        `False` lets `check` say so among other things.

    Raises
    ------
    ProblemError
        With a line for each key that is wrong: file, line, key, what was given and what was expected.

    Examples
    --------
    >>> mission = load("huang2020/detumble")
    >>> mission.timing.samples
    15001
    """
    return load_document(read_kind(problem, "mission"), changes, strict=strict)


def load_document(document: Document, changes: Mapping[str, Any] | None = None, *, strict: bool = True) -> Mission:
    """Return the mission of a document; arguments and errors as for `load`."""
    changes = changes or {}
    with guests.recorded() as files, guests.looking_in(document.folder), about(document):
        checked = check_tables(document, changes, strict=strict)
        mission = building.mission(checked, strict=strict)
    origin = Origin(document.path.name, document.text, dict(changes), tuple(files), document.folder)
    return mission.read_from(origin)


def check_tables(document: Document, changes: Mapping[str, Any], *, strict: bool = True) -> Checked:
    """Return the tables of a mission file, checked; raise `ProblemError` with all that is wrong."""
    kind = craft_of(document)
    if changes:
        document = document.with_data(changed(document.data, changes, kind))
        kind = craft_of(document)
    data, complaints = document.data, Complaints(document)
    own = own_tables(kind)
    parts = {key: value for key, value in data.items() if key not in ("spacecraft", "scheme", *own)}
    for key in list(parts):
        if key not in MissionTables.model_fields:
            del parts[key]
            complaints.add((key,), "unknown key" + near_key(key, [*MissionTables.model_fields, *own, "scheme"]))
    common = complaints.checked(MissionTables, parts)
    craft = _craft(kind, data, own, complaints)
    schemes = _schemes(kind, craft, data.get("scheme"), complaints)
    if craft is None:
        for misfit in sound_tables.misfits(kind, data, strict=strict):
            complaints.add(misfit.path, str(misfit))
    complaints.settle()
    assert common is not None
    assert craft is not None
    return Checked(document, common, craft, schemes)


def craft_of(document: Document) -> type[Craft]:
    """Return the class of the craft that a file names; raise `ProblemError` where there is none."""
    table = document.data.get("spacecraft")
    if not isinstance(table, dict) or "model" not in table:
        what = "the table [spacecraft] is missing" if table is None else "names no craft"
        raise ProblemError(f'{what}; write model = "..." in it, one of {", ".join(CRAFTS.names())}',
                           document.place(("spacecraft",)))  # fmt: skip
    try:
        name = table["model"]
        found = CRAFTS.find(name if isinstance(name, str) else repr(name), document.folder)
    except GncError as error:
        raise ProblemError(str(error), document.place(("spacecraft", "model"))) from error
    return found if isinstance(found, type) else type(found)


def _craft(kind: type[Craft], data: dict[str, Any], own: list[str], complaints: Complaints) -> Craft | None:
    """Return the craft made of [spacecraft] and its own tables, None where something is wrong with them."""
    table = {key: value for key, value in data["spacecraft"].items() if key != "model"}
    given = {name: data[name] for name in own if name in data}
    for key in table:
        if key in own:
            complaints.add(("spacecraft", key), f"unknown key; [{key}] is a table of its own, not one of [spacecraft]")
    try:
        return kind(**{**{key: value for key, value in table.items() if key not in own}, **given})
    except ProblemError as error:
        if not isinstance(error.__cause__, ValidationError):
            raise
        for path, message in sentences(error.__cause__, kind, {**table, **given}):
            complaints.add(path if path and path[0] in own else ("spacecraft", *path), message)
    except TypeError:  # a key such as "self"
        known = ", ".join(kind.model_fields)
        complaints.add(("spacecraft",), f"has a key of a name that no key has; known here: {known}")
    return None


@lru_cache(maxsize=64)
def scheme_table(kind: type[Craft]) -> Any:
    """Return the model of a [[scheme]] that flies a craft."""
    return create_model("Scheme", __base__=(SchemeTable, kind.scheme_keys), __doc__=SchemeTable.__doc__)


def _schemes(
    kind: type[Craft], craft: Craft | None, tables: Any, complaints: Complaints
) -> list[tuple[Any, type[Law], Part]]:
    """Return the schemes' tables with their laws and gains; those that are wrong are noted and left out."""
    if not isinstance(tables, list) or not tables:
        complaints.add(("scheme",), "is missing; write one [[scheme]] or more")
        return []
    found, names = [], []
    for i, table in enumerate(tables):
        model = complaints.checked(scheme_table(kind), table, ("scheme", i))
        law = _law(table.get("law"), complaints, ("scheme", i, "law")) if isinstance(table, dict) else None
        if law is None:
            continue
        key, wrong = ("scheme", i, "law"), complaints.apart()
        given = {name: value for name, value in table["law"].items() if name != "type"}
        gains = wrong.checked(law_table(law), given, key)
        why = "" if gains is not None or model is None or craft is None else building.misfit(model, law, craft)
        if why:  # gains of a law that cannot fly this craft need no mending
            complaints.add((*key, "type"), why)
            continue
        complaints.join(wrong)
        if model is None or gains is None:
            continue
        if model.name in names:
            complaints.add(("scheme", i, "name"), f"the name {model.name!r} is given twice")
        names.append(model.name)
        found.append((model, law, gains))
    return found


def _law(table: Any, complaints: Complaints, key: tuple[str | int, ...]) -> type[Law] | None:
    """Return the class of the law that a table names."""
    if not isinstance(table, dict):
        return None  # said by the scheme's own table
    if not isinstance(table.get("type"), str):
        complaints.add((*key, "type"), f"is missing; it names the law, one of {', '.join(LAWS.names())}")
        return None
    with complaints.about(*key, "type"):
        return LAWS.find(table["type"], complaints.folder)
    return None
