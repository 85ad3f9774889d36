"""Recipes of gain synthesis by the name that a file uses, and what each is given.

A recipe is a table: its fields are the keys of [recipe] in a synthesis file, matrices as rows, and `run` returns
what was found with its certificate. A recipe of your own is derived from `Recipe` and named as
"./file.py:Class", or offered by a package under the entry point `casadi_gnc.synthesis_recipes`.
"""

from __future__ import annotations

from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Union, get_args, get_origin

import numpy as np
from pydantic import Field, ValidationInfo, model_validator

from casadi_gnc import synthesis
from casadi_gnc.errors import ProblemError
from casadi_gnc.registry import Registry
from casadi_gnc.synthesis import LmiAnswer, Synthesis
from casadi_gnc.synthesis.recipes.shi2020_theorem1 import theorem1
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
        """Return what was found by a back end (its name, or itself), certified."""
        raise TypeError(f"{type(self).__name__} defines no run")

    def arguments(self) -> dict[str, Any]:
        """Return what is given under the keys' names, matrices as arrays; of a box its vertices."""
        found = {key: value for key, value in self if value is not None}
        found = {key: np.array(value) if _is_matrix(value) else value for key, value in found.items()}
        if "half_widths" in found:
            half = np.array(found.pop("half_widths"))
            found["vertices"] = synthesis.box_vertices(-half, half)
        return found


def _takes_matrix(annotation: Any) -> bool:
    """Return whether a field holds a matrix and no text: a list of lists of numbers, or None."""
    if get_origin(annotation) in (Union, UnionType, Annotated):
        return any(map(_takes_matrix, get_args(annotation)))
    return get_origin(annotation) is list and _is_row(get_args(annotation)[0])


def _is_row(annotation: Any) -> bool:
    inner = get_args(annotation)[0] if get_origin(annotation) is Annotated else annotation
    return get_origin(inner) is list


def _is_matrix(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and isinstance(value[0], list)


HalfWidths = Annotated[
    Annotated[list[NonNegative], Field(min_length=1, max_length=12)] | None,
    Field(description="of a box of starts of the state about zero, instead of vertices"),
]


def _one_of_starts(part: Any) -> Any:
    if part.vertices is not None and part.half_widths is not None:
        raise ValueError("give either vertices or half_widths, not both")
    return part


Fastest = Annotated[Positive | None, Field(description="largest distance of a pole from zero")]
Decay = Annotated[NonNegative | None, Field(description="every pole's real part is below minus this number")]
Damping = Annotated[
    Annotated[float, Field(gt=0.0, lt=1.0)] | None, Field(description="every pole's damping ratio is above this number")
]
Disc = Annotated[
    Annotated[list[float], Field(min_length=2, max_length=2)] | None,
    Field(description="centre, on the real axis, and radius of a disc that holds every pole [rad/s]"),
]


class StateFeedback(Recipe):
    """u = -K x with the smallest H-infinity norm from w to z = C x + D u + F w."""

    A: Table
    B: Table
    E: Table
    C: Table
    D: Table
    F: Table | None = None
    gamma: Positive | None = Field(default=None, description="bound on the norm; the smallest, and slack, if left out")
    slack: Positive = 0.02
    margin: Positive = 1e-7
    fastest_rad_s: Fastest = None
    decay_1_s: Decay = None
    damping: Damping = None
    disc_rad_s: Disc = None
    vertices: Table | None = Field(default=None, description="starts of the state, one a row, for the peak command")
    half_widths: HalfWidths = None
    limit: Positive | None = Field(default=None, description="of the peak command; a larger one is not certified")

    @model_validator(mode="after")
    def _starts(self) -> StateFeedback:
        return _one_of_starts(self)

    def run(self, backend: Any) -> Synthesis:
        """Return the gains with their certificate."""
        return synthesis.state_feedback(**self.arguments(), backend=backend)


class MixedStateFeedback(Recipe):
    """u = -K x with the smallest H2 norm from w2 to z2 = C2 x + D2 u that keeps the H-infinity norm from w to z."""

    A: Table
    B: Table
    E: Table
    C: Table
    D: Table
    F: Table | None = None
    E2: Table | None = Field(default=None, description="of w2, E if left out")
    C2: Table
    D2: Table
    gamma: Positive = Field(description="bound on the H-infinity norm")
    margin: Positive = 1e-7
    fastest_rad_s: Fastest = None
    decay_1_s: Decay = None
    damping: Damping = None
    disc_rad_s: Disc = None
    vertices: Table | None = Field(default=None, description="starts of the state, one a row, for the peak command")
    half_widths: HalfWidths = None
    limit: Positive | None = Field(default=None, description="of the peak command; a larger one is not certified")

    @model_validator(mode="after")
    def _starts(self) -> MixedStateFeedback:
        return _one_of_starts(self)

    def run(self, backend: Any) -> Synthesis:
        """Return the gains with their certificate."""
        return synthesis.mixed_state_feedback(**self.arguments(), backend=backend)


class Observer(Recipe):
    """L of an observer with the smallest H-infinity norm from w to G times the error."""

    A: Table
    C: Table
    E: Table
    F: Table
    G: Table | None = None
    gamma: Positive | None = Field(default=None, description="bound on the norm; the smallest, and slack, if left out")
    slack: Positive = 0.02
    margin: Positive = 1e-7
    fastest_rad_s: Fastest = None
    decay_1_s: Decay = None
    damping: Damping = None
    disc_rad_s: Disc = None

    def run(self, backend: Any) -> Synthesis:
        """Return the gains with their certificate."""
        return synthesis.observer(**self.arguments(), backend=backend)


class InputEllipsoid(Recipe):
    """u = -K x that decays as asked from a box of starts and keeps the command within a limit."""

    A: Table
    B: Table
    vertices: Table | None = Field(default=None, description="starts, one a row; or give half_widths")
    half_widths: HalfWidths = None
    limit: Positive
    decay_1_s: NonNegative
    per_channel: bool = False
    fastest_rad_s: Fastest = None
    damping: Damping = None
    disc_rad_s: Disc = None
    margin: Positive = 1e-7

    @model_validator(mode="after")
    def _starts(self) -> InputEllipsoid:
        if self.vertices is None and self.half_widths is None:
            raise ValueError("give vertices or half_widths: the starts from which the command is kept small")
        return _one_of_starts(self)

    def run(self, backend: Any) -> Synthesis:
        """Return the gains with their certificate."""
        return synthesis.input_ellipsoid(**self.arguments(), backend=backend)


class IntermediateObserver(Recipe):
    """K and L of the intermediate-observer pair with the smallest certified gamma."""

    A: Table
    B: Table
    C: Table | None = None
    varpi: Positive
    s: Positive = Field(default=0.3, description="where X1^2 is replaced by its tangent")
    margin: Positive = 1e-6
    largest_gamma: Positive = 1e4
    vertices: Table | None = Field(default=None, description="starts of the state, one a row, for the peak command")
    half_widths: HalfWidths = None
    limit: Positive | None = Field(default=None, description="of the peak command; a larger one is not certified")

    @model_validator(mode="after")
    def _starts(self) -> IntermediateObserver:
        return _one_of_starts(self)

    def run(self, backend: Any) -> Synthesis:
        """Return the gains with their certificate."""
        return synthesis.intermediate_observer(**self.arguments(), backend=backend)


class Theorem1(Recipe):
    """Theorem 1 of Shi et al. (2020) as printed."""

    A: Table
    B: Table
    C: Table
    M0: Table
    varpi: Positive
    alpha: Positive
    limit: Positive
    start: Annotated[list[Positive], Field(min_length=3, max_length=3)]
    kappa3: Positive
    price: NonNegative = Field(default=0.0, description="of the squares of W and H, added to gamma_2")
    margin: Positive = 1e-6

    def run(self, backend: Any) -> LmiAnswer:
        """Return the certificate of the inequalities; they give no gains."""
        return theorem1(**self.arguments(), backend=backend)


#: Recipes by name: shipped ones, those of installed packages, a user's own.
REGISTRY = Registry(
    "recipe",
    "casadi_gnc.synthesis_recipes",
    {
        "state_feedback": f"{__name__}:StateFeedback",
        "mixed_state_feedback": f"{__name__}:MixedStateFeedback",
        "observer": f"{__name__}:Observer",
        "input_ellipsoid": f"{__name__}:InputEllipsoid",
        "intermediate_observer": f"{__name__}:IntermediateObserver",
        "shi2020_theorem1": f"{__name__}:Theorem1",
    },
    is_one=lambda thing: isinstance(thing, type) and issubclass(thing, Recipe),
    expected="a class derived from casadi_gnc.problem_files.synthesis_recipes.Recipe",
)
