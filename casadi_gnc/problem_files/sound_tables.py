"""What can be said of the tables of a craft that are right, where others are wrong."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from pydantic import ValidationError, create_model

from casadi_gnc.errors import GncError
from casadi_gnc.missions.craft import Craft
from casadi_gnc.problem_files.mission_tables import TimingTable
from casadi_gnc.tables.part import MisfitError, Part, misfits_of, own_tables


def misfits(kind: type[Craft], data: Mapping[str, Any], *, strict: bool) -> Iterator[MisfitError]:
    """Yield what can be said of a craft that cannot be made: what `Craft.untimely` and, if strict, `Craft.flaws` say.

    Flaws are asked of a craft that lacks the tables that are wrong, and are told if they follow from the others alone.

    Parameters
    ----------
    kind : class of the craft, of which a table is wrong, or tables do not fit each other.
    data : content of the file.
    strict : as in `Craft.untimely`.
    """
    own = own_tables(kind)
    plain = {name: value for name, value in data["spacecraft"].items() if name in kind.model_fields and name not in own}
    given = {**plain, **{name: data[name] for name in own if name in data}}
    sound = _sound(kind, given)
    if any(field.is_required() and name not in sound for name, field in kind.model_fields.items()):
        return
    craft = kind.model_construct(**sound)
    try:
        timing = TimingTable.model_validate(data.get("timing")).timing()
        yield from craft.untimely(timing, strict=strict)
    except MisfitError as error:
        yield from misfits_of(error)
    except (ValidationError, GncError, ValueError):
        pass
    for name in given.keys() - sound.keys():
        vars(craft).pop(name, None)
    try:
        yield from craft.flaws() if strict else ()
    except (AttributeError, GncError, ValueError):
        return  # they cannot be told without what is wrong


def _sound(kind: type[Craft], given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of those keys and tables that are right by themselves."""
    found = {}
    for name, value in given.items():
        field = kind.model_fields[name]
        alone: Any = create_model("Alone", __base__=Part, **{name: (field.annotation, field)})  # type: ignore[call-overload]
        try:
            found[name] = getattr(alone.model_validate({name: value}), name)
        except ValidationError:
            continue
    return found
