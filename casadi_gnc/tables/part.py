"""What every table of a problem file is: a pydantic model that takes SI numbers and refuses all else.

`Part` is the base, the annotated types below are its vocabulary. SI units and radians throughout, with the
unit in the key where it helps; unknown keys, infinities, NaN and numbers as text are refused.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, field_validator

from casadi_gnc.system.text import refused

#: Most actuators of a craft: what computes with their subsets ends within seconds.
MOST_ACTUATORS = 128
#: Most rows or columns of a matrix.
_LARGEST_MATRIX = 1000


def _rectangular(rows: list[list[float]]) -> list[list[float]]:
    sizes = {len(row) for row in rows}
    if len(sizes) > 1 or sizes == {0}:
        raise ValueError(f"rows of {' and '.join(map(str, sorted(sizes)[:4]))} entries, expected as many in each")
    return rows


#: A matrix by its rows, all as long, none empty.
Table = Annotated[
    list[Annotated[list[float], Field(max_length=_LARGEST_MATRIX)]],
    Field(min_length=1, max_length=_LARGEST_MATRIX),
    AfterValidator(_rectangular),
]
Vector = Annotated[list[float], Field(min_length=3, max_length=3)]
#: A vector for each actuator.
Rows = Annotated[list[Vector], Field(min_length=1, max_length=MOST_ACTUATORS)]
Matrix = Annotated[list[Vector], Field(min_length=3, max_length=3)]
Positive = Annotated[float, Field(gt=0)]
NonNegative = Annotated[float, Field(ge=0)]
Angle = Annotated[float, Field(ge=-2 * math.pi, le=2 * math.pi, description="in radians")]
Angles = Annotated[list[Angle], Field(min_length=3, max_length=3)]
#: A name that may stand in files' names and in C.
NAME = r"^[A-Za-z][A-Za-z0-9_]{0,62}$"
Name = Annotated[str, Field(pattern=NAME, description="letters, digits and _")]


class Part(BaseModel):
    """Base of all parts of a file."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False, frozen=True, strict=True)

    @field_validator("*", mode="after")
    @classmethod
    def _can_be_read(cls, value: Any) -> Any:
        for text in value if isinstance(value, list) else [value]:
            if isinstance(text, str) and (character := refused(text)):
                raise ValueError(
                    f"holds the character {character}, which is invisible and can change what a reader, a terminal or "
                    "a compiler takes the rest for; leave it out"
                )
        return value


class MisfitError(ValueError):
    """Say that keys do not fit each other, and which one to look at.

    Parameters
    ----------
    message : what was given, what was expected, what to do.
    path : of the key, below the table whose validator raises it.
    """

    def __init__(self, message: str, *path: str | int) -> None:
        self.path = path
        super().__init__(message)


class SeveralMisfitsError(MisfitError):
    """Say at once of several keys that they do not fit.

    Parameters
    ----------
    misfits : two or more.
    """

    def __init__(self, misfits: Sequence[MisfitError]) -> None:
        self.misfits = tuple(misfits)
        super().__init__("; ".join(map(str, misfits)), *misfits[0].path)


def all_of(*asked: Callable[[], Any]) -> None:
    """Call each of what raises `ValueError` where something does not fit; raise all that was raised at once.

    Raises
    ------
    ValueError
        What one of them raises; a `SeveralMisfitsError` where there are more.
    """
    raised: list[ValueError] = []
    for each in asked:
        try:
            each()
        except ValueError as error:
            raised.append(error)
    if len(raised) == 1:
        raise raised[0]
    if raised:
        raise SeveralMisfitsError([misfit for error in raised for misfit in misfits_of(error)])


def misfits_of(error: ValueError) -> Sequence[MisfitError]:
    """Return an error as what does not fit, of one key or of several."""
    if isinstance(error, SeveralMisfitsError):
        return error.misfits
    return [error if isinstance(error, MisfitError) else MisfitError(str(error))]


def table(default: Any = ..., note: str = "") -> Any:
    """Declare a field of a craft that is a table of its own in a file, [initial], and no key of [spacecraft].

    Parameters
    ----------
    default : what holds where the file has no such table; without one it must be there.
    note : what the table is, in a few words.
    """
    return Field(default, description=note or None, json_schema_extra={"table": True})


def own_tables(model: type[BaseModel]) -> list[str]:
    """Return the fields of a craft that are tables of their own."""
    extras = ((name, field.json_schema_extra) for name, field in model.model_fields.items())
    return [name for name, extra in extras if isinstance(extra, dict) and extra.get("table")]


def plain(value: Any) -> Any:
    """Return a value as TOML would give it: arrays, tuples and CasADi numbers as lists."""
    if type(value) in (float, int, str, bool) or isinstance(value, Part):
        return value
    if isinstance(value, (list, tuple)):
        return [plain(each) for each in value]
    if isinstance(value, dict):
        return {key: plain(each) for key, each in value.items()}
    if hasattr(value, "full"):  # casadi.DM
        value = value.full()
        value = value.ravel() if 1 in value.shape else value
    return value.tolist() if hasattr(value, "tolist") else value
