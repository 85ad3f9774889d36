"""What recipes of gain synthesis share: matrices by rows or files, plants of missions, regions of poles, starts."""

from __future__ import annotations

from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Union, get_args, get_origin

import numpy as np
from pydantic import Field, ValidationInfo, model_validator

from casadi_gnc import synthesis
from casadi_gnc.errors import FlightError, ProblemError
from casadi_gnc.synthesis import LmiAnswer, Synthesis
from casadi_gnc.system.matrix_file import read_matrix
from casadi_gnc.tables.part import MisfitError, NonNegative, Part, Positive, Table


class Recipe(Part):
    """Base of all recipes.

    A key that takes a matrix also takes a file beside the problem file: "plant.csv", or "plant.mat:A".
    """

    @model_validator(mode="before")
    @classmethod
    def _from_files(cls, data: Any, info: ValidationInfo) -> Any:
        if not isinstance(data, dict):
            return data
        folder, read = (info.context or {}).get("folder", Path()), dict(data)
        for key, field in cls.model_fields.items():
            if isinstance(data.get(key), str) and _takes_matrix(field.annotation):
                try:
                    read[key] = read_matrix(data[key], folder)
                except ProblemError as error:
                    raise MisfitError(str(error), key) from None
        return read

    def run(self, backend: Any) -> Synthesis | LmiAnswer:
        """Return what was found by a back end (its name, or itself; None for one by size), certified."""
        raise TypeError(f"{type(self).__name__} defines no run")

    def arguments(self) -> dict[str, Any]:
        """Return what is given under the keys' names, matrices as arrays; of a box its vertices."""
        found = {key: value for key, value in self if value is not None}
        found = {key: np.array(value) if _is_matrix(value) else value for key, value in found.items()}
        if "half_widths" in found:
            half = np.array(found.pop("half_widths"))
            found["vertices"] = synthesis.box_vertices(-half, half)
        return found


class OfPlant(Recipe):
    """Base of recipes of a plant x' = A x + B u, given by its matrices or by a mission, linearised at its target."""

    A: Table | None = Field(default=None, description="[1/s]; or give mission")
    B: Table | None = Field(default=None, description="of the efforts; or give mission")
    mission: str | None = Field(default=None, description="file, or name of a shipped one, whose plant gives A and B")
    scheme: str | None = Field(default=None, description="of that mission, whose efforts u are; the first if left out")
    at_s: NonNegative = Field(default=0.0, description="time at which that plant is linearised")

    @model_validator(mode="before")
    @classmethod
    def _from_mission(cls, data: Any, info: ValidationInfo) -> Any:
        if not isinstance(data, dict):
            return data
        if not _is_linearised(data, "mission", "mission, whose plant is then linearised"):
            return data
        return {**data, **_linearised(data, (info.context or {}).get("folder", Path()))}

    def arguments(self) -> dict[str, Any]:
        """Return what the recipe is given, the plant as matrices, whatever it came from."""
        found = super().arguments()
        return {key: value for key, value in found.items() if key not in ("mission", "scheme", "at_s")}


#: Of a box of starts of the state about zero.
HalfWidths = Annotated[
    Annotated[list[NonNegative], Field(min_length=1, max_length=12)] | None,
    Field(description="of a box of starts of the state about zero, instead of vertices"),
]
Fastest = Annotated[Positive | None, Field(description="largest distance of a pole from zero")]
Damping = Annotated[
    Annotated[float, Field(gt=0.0, lt=1.0)] | None, Field(description="every pole's damping ratio is above this number")
]
Disc = Annotated[
    Annotated[list[float], Field(min_length=2, max_length=2)] | None,
    Field(description="centre, on the real axis, and radius of a disc that holds every pole [rad/s]"),
]


#: Of a gain, by rows: which entries are zero, and which the same number.
Structure = Annotated[list[Annotated[list[int | str], Field(min_length=1)]], Field(min_length=1)]


class InRegion(Recipe):
    """Base of recipes that keep every pole in a region, if asked."""

    fastest_rad_s: Fastest = None
    decay_1_s: NonNegative | None = Field(default=None, description="every pole's real part is below minus this number")
    damping: Damping = None
    disc_rad_s: Disc = None


class FromStarts(OfPlant):
    """Base of recipes that judge the command from some starts, if given."""

    vertices: Table | None = Field(default=None, description="starts of the state, one a row, for the peak command")
    half_widths: HalfWidths = None
    limit: Positive | None = Field(default=None, description="of the peak command; a larger one is not certified")

    @model_validator(mode="after")
    def _starts(self) -> FromStarts:
        return one_of_starts(self)


def one_of_starts(part: Any) -> Any:
    """Return a recipe whose starts are given at most once."""
    if part.vertices is not None and part.half_widths is not None:
        raise ValueError("give either vertices or half_widths, not both")
    return part


def _is_linearised(data: dict[str, Any], key: str, offered: str) -> bool:
    """Return whether A and B come from what a key names; raise `MisfitError` where neither or both give them."""
    told = [name for name in ("A", "B") if data.get(name) is not None]
    if data.get(key) is not None:
        if told:
            raise MisfitError(f"is given beside {told[0]}; A and B come from one of them, leave the other out", key)
        return True
    if not told:
        raise MisfitError(f"is missing; give A and B, or {offered}", "A")
    if len(told) < 2:
        raise MisfitError(f"is missing beside {told[0]}", "B" if told == ["A"] else "A")
    if data.get("scheme") is not None:
        raise MisfitError(f"names one of what the key {key} names; give that too", "scheme")
    return False


def vertices_of(data: dict[str, Any], info: ValidationInfo) -> dict[str, Any]:
    """Return the keys of a recipe of several plants, with A and B, a matrix each, from the missions that it names."""
    named = data.get("missions")
    if not _is_linearised(data, "missions", "missions"):
        return data
    if not isinstance(named, list) or not named or not all(isinstance(one, str) for one in named):
        return data  # what is wrong with it is told by its type
    folder = (info.context or {}).get("folder", Path())
    try:
        plants = [_linearised({**data, "mission": one}, folder) for one in named]
    except MisfitError as error:
        raise MisfitError(str(error), *("missions" if part == "mission" else part for part in error.path)) from None
    return {**data, **{key: [plant[key] for plant in plants] for key in ("A", "B") if plants[0]}}


def _linearised(data: dict[str, Any], folder: Path) -> dict[str, Any]:
    """Return A and B of the mission that a recipe names, linearised."""
    from casadi_gnc.problem_files.loading import load

    named, time = data["mission"], data.get("at_s", 0.0)
    if not isinstance(named, str) or isinstance(time, bool) or not isinstance(time, (int, float)):
        return {}  # what is wrong with them is told by their types
    path = folder / named
    try:
        mission = load(path if path.is_file() else named)
    except ProblemError as error:
        raise MisfitError(f"cannot be read: {error}", "mission") from None
    try:
        plant = mission.linearised(data.get("scheme"), float(time))
    except FlightError as error:
        raise MisfitError(str(error), "mission" if data.get("scheme") is None else "scheme") from None
    return {"A": plant.A.tolist(), "B": plant.B.tolist()}


def _takes_matrix(annotation: Any) -> bool:
    """Return whether a field holds a matrix and no text: a list of lists of numbers, or None."""
    if get_origin(annotation) in (Union, UnionType, Annotated):
        return any(map(_takes_matrix, get_args(annotation)))
    return get_origin(annotation) is list and _is_row(get_args(annotation)[0])


def _is_row(annotation: Any) -> bool:
    inner = get_args(annotation)[0] if get_origin(annotation) is Annotated else annotation
    return get_origin(inner) is list and get_args(inner)[0] is float


def _is_matrix(value: Any) -> bool:
    """Return whether a value is rows of numbers, not of labels, nor a list of matrices."""
    return isinstance(value, list) and bool(value) and isinstance(value[0], list) and isinstance(value[0][0], float)
