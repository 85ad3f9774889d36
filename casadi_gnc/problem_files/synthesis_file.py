"""Problem files of kind "synthesis": a recipe, its matrices, and what is asked of the gains.

`[recipe]` names one of `casadi_gnc.synthesis` and gives its arguments under the names of the recipe's
function, matrices as rows. `synthesize` runs it; what failed certification is never returned as gains.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, model_validator

from casadi_gnc.errors import ProblemError, SynthesisError
from casadi_gnc.problem_files.document import read_kind
from casadi_gnc.problem_files.mission_tables import Format
from casadi_gnc.tables.part import NonNegative, Part, Positive

Table = Annotated[list[list[float]], Field(min_length=1)]


HalfWidths = Annotated[
    list[NonNegative] | None, Field(description="of a box of starts of the state about zero, instead of vertices")
]


def _one_of_starts(part: Any) -> Any:
    if part.vertices is not None and part.half_widths is not None:
        raise ValueError("give either vertices or half_widths, not both")
    return part


class StateFeedback(Part):
    """u = -K x with the smallest H-infinity norm from w to z = C x + D u + F w."""

    type: Literal["state_feedback"]
    A: Table
    B: Table
    E: Table
    C: Table
    D: Table
    F: Table | None = None
    gamma: Positive | None = Field(default=None, description="bound on the norm; the smallest, and slack, if left out")
    slack: Positive = 0.02
    margin: Positive = 1e-7
    fastest_rad_s: Positive | None = Field(default=None, description="largest distance of a pole from zero")
    vertices: Table | None = Field(default=None, description="starts of the state, one a row, for the peak command")
    half_widths: HalfWidths = None
    limit: Positive | None = Field(default=None, description="of the peak command; a larger one is not certified")

    @model_validator(mode="after")
    def _starts(self) -> StateFeedback:
        return _one_of_starts(self)


class Observer(Part):
    """L of an observer with the smallest H-infinity norm from w to G times the error."""

    type: Literal["observer"]
    A: Table
    C: Table
    E: Table
    F: Table
    G: Table | None = None
    gamma: Positive | None = Field(default=None, description="bound on the norm; the smallest, and slack, if left out")
    slack: Positive = 0.02
    margin: Positive = 1e-7
    fastest_rad_s: Positive | None = Field(default=None, description="largest distance of a pole from zero")


class InputEllipsoid(Part):
    """u = -K x that decays as asked from a box of starts and keeps the command within a limit."""

    type: Literal["input_ellipsoid"]
    A: Table
    B: Table
    vertices: Table | None = Field(default=None, description="starts, one a row; or give half_widths")
    half_widths: HalfWidths = None
    limit: Positive
    decay_1_s: NonNegative
    per_channel: bool = False
    margin: Positive = 1e-7

    @model_validator(mode="after")
    def _starts(self) -> InputEllipsoid:
        if self.vertices is None and self.half_widths is None:
            raise ValueError("give vertices or half_widths: the starts from which the command is kept small")
        return _one_of_starts(self)


class IntermediateObserver(Part):
    """K and L of the intermediate-observer pair with the smallest certified gamma."""

    type: Literal["intermediate_observer"]
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


class Theorem1(Part):
    """Theorem 1 of Shi et al. (2020) as printed."""

    type: Literal["shi2020_theorem1"]
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


Recipe = Annotated[
    StateFeedback | Observer | InputEllipsoid | IntermediateObserver | Theorem1, Field(discriminator="type")
]


class SynthesisModel(Part):
    """A synthesis file."""

    format: Format
    kind: Literal["synthesis"]
    title: str = ""
    source: str = ""
    backend: Literal["clarabel", "scs", "barrier"] = "clarabel"
    recipe: Recipe


@dataclass(frozen=True, eq=False)
class SynthesisCase:
    """Hold what a synthesis file describes: the recipe's name and arguments, and the back end."""

    name: str
    title: str
    recipe: str
    arguments: dict[str, Any]
    backend: str


def load_synthesis(problem: str | Path) -> SynthesisCase:
    """Return the case of a synthesis file, given by path or shipped name; raise `ProblemError`."""
    document = read_kind(problem, "synthesis")
    model: SynthesisModel = document.validated(SynthesisModel)
    given = {key: value for key, value in model.recipe if value is not None and key != "type"}
    arguments = {key: _array(value, document.place(("recipe", key))) for key, value in given.items()}
    return SynthesisCase(document.path.stem, model.title, model.recipe.type, arguments, model.backend)


def _array(value: Any, place: str) -> Any:
    if not (isinstance(value, list) and isinstance(value[0], list)):
        return value
    if len({len(row) for row in value}) > 1:
        raise ProblemError(f"rows of different length: {', '.join(str(len(row)) for row in value)}", place)
    return np.array(value)


def synthesize(case: SynthesisCase, backend: str | None = None) -> dict[str, Any]:
    """Return what a recipe found, as plain data with its certificate.

    Keys: status, sentence, certified, gains (empty unless certified), promised and true norm, poles, peak
    command, tolerated (assumed mass) / (true mass), and every constraint with its smallest eigenvalue.

    Raises
    ------
    ProblemError
        For matrices that do not fit each other, by the recipe's words.
    """
    from casadi_gnc import synthesis
    from casadi_gnc.synthesis.recipes.shi2020_theorem1 import theorem1

    arguments = dict(case.arguments, backend=backend or case.backend)
    if "half_widths" in arguments:
        half = np.array(arguments.pop("half_widths"))
        arguments["vertices"] = synthesis.box_vertices(-half, half)
    recipes = {
        "state_feedback": synthesis.state_feedback,
        "observer": synthesis.observer,
        "input_ellipsoid": synthesis.input_ellipsoid,
        "intermediate_observer": synthesis.intermediate_observer,
    }
    try:
        if case.recipe == "shi2020_theorem1":
            return {"problem": case.name, **_inequalities(theorem1(**arguments))}
        found = recipes[case.recipe](**arguments)
    except SynthesisError as error:
        raise ProblemError(str(error), case.name) from None
    data: dict[str, Any] = {"problem": case.name, **_inequalities(found.lmis)}
    data.update(status=found.status.name, sentence=found.sentence(), certified=found.is_certified)
    data["gains"] = {name: gain.tolist() for name, gain in found.gains.items()} if found.is_certified else {}
    data["promised_norm"] = _finite(found.promised)
    data["poles_rad_s"] = [[float(pole.real), float(pole.imag)] for pole in found.poles]
    if found.norm is not None:
        where = _finite(found.norm.frequency_rad_s)
        data["norm"] = {
            "lower": _finite(found.norm.lower),
            "upper": _finite(found.norm.upper),
            "frequency_rad_s": where,
        }
    if found.peak is not None:
        data["peak"] = {
            "value": _finite(found.peak.value),
            "bound": _finite(found.peak.bound),
            "limit": _finite(found.limit),
            "start": found.peak.start.tolist(),
            "time_s": found.peak.time_s,
        }
    if found.ratios is not None:
        data["stable_ratios"] = [_finite(end) for end in found.ratios]
    return data


def _inequalities(answer: Any) -> dict[str, Any]:
    """Return the certificate of a set of LMIs as plain data."""
    return {
        "status": answer.status.name,
        "sentence": answer.sentence(),
        "certified": answer.status.holds,
        "gains": {},
        "backend": answer.backend,
        "conflict": list(answer.conflict),
        "multipliers": answer.infeasibility.shares if answer.infeasibility else {},
        "constraints": [
            {
                "name": one.name,
                "smallest": _finite(one.smallest),
                "rounding": _finite(one.allowance),
                "margin": one.margin,
                "holds": bool(one.holds),
            }
            for one in answer.checks
        ],
    }


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
