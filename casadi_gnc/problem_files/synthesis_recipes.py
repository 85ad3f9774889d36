"""Recipes of gain synthesis by the name that a file uses, and what each is given.

A recipe is a table: its fields are the keys of [recipe] in a synthesis file, matrices as rows, and `run` returns
what was found with its certificate. A recipe of your own is derived from `Recipe` and named as
"./file.py:Class", or offered by a package under the entry point `casadi_gnc.synthesis_recipes`.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, ValidationInfo, model_validator

from casadi_gnc import synthesis
from casadi_gnc.problem_files.recipe_parts import (
    Damping,
    Disc,
    Fastest,
    FromStarts,
    HalfWidths,
    InRegion,
    OfPlant,
    Recipe,
    Structure,
    one_of_starts,
    vertices_of,
)
from casadi_gnc.registry import Registry
from casadi_gnc.synthesis import LmiAnswer, Synthesis
from casadi_gnc.synthesis.recipes.shi2020_theorem1 import theorem1
from casadi_gnc.tables.part import NonNegative, Positive, Table


class StateFeedback(FromStarts, InRegion):
    """u = -K x with the smallest H-infinity norm from w to z = C x + D u + F w."""

    E: Table | None = Field(default=None, description="of the disturbance; B if left out")
    C: Table
    D: Table
    F: Table | None = None
    gamma: Positive | None = Field(default=None, description="bound on the norm; the smallest, and slack, if left out")
    slack: Positive = 0.02
    margin: Positive = 1e-7

    def run(self, backend: Any) -> Synthesis:
        """Return the gains with their certificate."""
        given = self.arguments()
        return synthesis.state_feedback(**{"E": given["B"], **given}, backend=backend)


class MixedStateFeedback(FromStarts, InRegion):
    """u = -K x with the smallest H2 norm from w2 to z2 = C2 x + D2 u that keeps the H-infinity norm from w to z."""

    E: Table | None = Field(default=None, description="of the disturbance; B if left out")
    C: Table
    D: Table
    F: Table | None = None
    E2: Table | None = Field(default=None, description="of w2, E if left out")
    C2: Table
    D2: Table
    gamma: Positive = Field(description="bound on the H-infinity norm")
    margin: Positive = 1e-7

    def run(self, backend: Any) -> Synthesis:
        """Return the gains with their certificate."""
        given = self.arguments()
        return synthesis.mixed_state_feedback(**{"E": given["B"], **given}, backend=backend)


class OutputFeedback(FromStarts, InRegion):
    """u = -K y, y = M x + N w, of any structure, with a small H-infinity norm from w to z = C x + D u + F w."""

    E: Table | None = Field(default=None, description="of the disturbance; B if left out")
    C: Table
    D: Table
    F: Table | None = None
    M: Table | None = Field(default=None, description="of the measurement; the state if left out")
    N: Table | None = Field(default=None, description="of w in the measurement; none if left out")
    structure: Structure | None = Field(
        default=None,
        description="of K: 0, or a whole number or name for each number in it, with a minus for its negative",
    )
    gamma: Positive | None = Field(default=None, description="bound on the norm; the smallest, and slack, if left out")
    slack: Positive = 0.02
    tries: Annotated[int, Field(ge=1, le=1000)] = Field(default=6, description="starts of the search")
    margin: Positive = 1e-7

    def run(self, backend: Any) -> Synthesis:
        """Return the gains with their certificate."""
        given = self.arguments()
        return synthesis.output_feedback(**{"E": given["B"], **given}, backend=backend)


class PolytopeStateFeedback(InRegion):
    """u = -K x for every plant between some others, by one gain or one that follows the plant."""

    A: list[Table] | None = Field(default=None, description="a matrix for each vertex; or give missions")
    B: list[Table] | None = Field(default=None, description="as many, or one for all; or give missions")
    missions: Annotated[list[str], Field(min_length=1)] | None = Field(
        default=None, description="files or shipped names, whose plants are the vertices"
    )
    scheme: str | None = Field(
        default=None, description="of those missions, whose efforts u are; the first if left out"
    )
    at_s: NonNegative = Field(default=0.0, description="time at which those plants are linearised")
    E: Table | None = Field(default=None, description="of the disturbance; the first B if left out")
    C: Table
    D: Table
    F: Table | None = None
    scheduled: bool = Field(default=False, description="whether the gain follows the plant: one for each vertex")
    dependent: bool = Field(default=False, description="whether each vertex has a Lyapunov matrix of its own")
    gamma: Positive | None = Field(default=None, description="bound on the norm; the smallest, and slack, if left out")
    slack: Positive = 0.02
    margin: Positive = 1e-7

    @model_validator(mode="before")
    @classmethod
    def _from_missions(cls, data: Any, info: ValidationInfo) -> Any:
        return vertices_of(data, info) if isinstance(data, dict) else data

    def run(self, backend: Any) -> Synthesis:
        """Return the gains with their certificate."""
        given = {key: value for key, value in self.arguments().items() if key not in ("missions", "scheme", "at_s")}
        return synthesis.polytope_state_feedback(**{"E": given["B"][0], **given}, backend=backend)


class Observer(InRegion):
    """L of an observer with the smallest H-infinity norm from w to G times the error."""

    A: Table
    C: Table
    E: Table
    F: Table
    G: Table | None = None
    gamma: Positive | None = Field(default=None, description="bound on the norm; the smallest, and slack, if left out")
    slack: Positive = 0.02
    margin: Positive = 1e-7

    def run(self, backend: Any) -> Synthesis:
        """Return the gains with their certificate."""
        return synthesis.observer(**self.arguments(), backend=backend)


class InputEllipsoid(OfPlant):
    """u = -K x that decays as asked from a box of starts and keeps the command within a limit."""

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
        return one_of_starts(self)

    def run(self, backend: Any) -> Synthesis:
        """Return the gains with their certificate."""
        return synthesis.input_ellipsoid(**self.arguments(), backend=backend)


class IntermediateObserver(FromStarts):
    """K and L of the intermediate-observer pair with the smallest certified gamma."""

    C: Table | None = None
    varpi: Positive
    s: Positive = Field(default=0.3, description="where X1^2 is replaced by its tangent")
    margin: Positive = 1e-6
    largest_gamma: Positive = 1e4

    def run(self, backend: Any) -> Synthesis:
        """Return the gains with their certificate."""
        return synthesis.intermediate_observer(**self.arguments(), backend=backend)


class SaturationMargin(OfPlant):
    """How far commands of u = -K x may exceed their limits with the loop still proved stable."""

    K: Table = Field(description="the gain that is judged")
    criterion: Literal["circle", "popov"] = Field(
        default="popov", description="circle holds for limits that change with time too, popov proves more"
    )
    margin: Positive = 1e-7
    largest: Positive = Field(default=1e4, description="inverse of the smallest share that is sought")

    def run(self, backend: Any) -> Synthesis:
        """Return the gain with its certificate."""
        return synthesis.saturation_margin(**self.arguments(), backend=backend)


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
        "output_feedback": f"{__name__}:OutputFeedback",
        "polytope_state_feedback": f"{__name__}:PolytopeStateFeedback",
        "observer": f"{__name__}:Observer",
        "input_ellipsoid": f"{__name__}:InputEllipsoid",
        "intermediate_observer": f"{__name__}:IntermediateObserver",
        "saturation_margin": f"{__name__}:SaturationMargin",
        "shi2020_theorem1": f"{__name__}:Theorem1",
    },
    is_one=lambda thing: isinstance(thing, type) and issubclass(thing, Recipe),
    expected="a class derived from casadi_gnc.problem_files.synthesis_recipes.Recipe",
)
