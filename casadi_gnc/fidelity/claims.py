"""What a claims file may say: the printed numbers of a paper and what answers each.

A claim is answered by one metric of a flight, or by a named computation. The verdict is never
written down; `casadi_gnc.fidelity.verdict` computes it from the two numbers.
"""

from __future__ import annotations

import inspect
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any, Literal, get_type_hints

from pydantic import (
    AfterValidator,
    Field,
    ValidationError,
    ValidationInfo,
    create_model,
    field_validator,
    model_validator,
)

from casadi_gnc.errors import ProblemError, offer
from casadi_gnc.fidelity.computations import COMPUTATIONS
from casadi_gnc.problem_files.document import read_kind
from casadi_gnc.problem_files.mission_tables import Format, MetricAsked
from casadi_gnc.status import StepStatus
from casadi_gnc.system import assets
from casadi_gnc.tables.complaints import near_key, sentences
from casadi_gnc.tables.part import MisfitError, Name, NonNegative, Part
from casadi_gnc.tables.wording import shown


def _found(problem: str, info: ValidationInfo) -> str:
    """Return the path of a problem file that lies beside the claims file; a shipped one's name as it is."""
    folder = (info.context or {}).get("folder", Path())
    for name in (problem, f"{problem}.toml"):
        with suppress(OSError, ValueError):  # what is no name of a file is told by its flight
            if (folder / name).is_file():
                return str((folder / name).resolve())
    return problem


class FlightModel(Part):
    """The flight that answers a claim: a shipped problem, one of its schemes, and what is changed."""

    problem: Annotated[str, AfterValidator(_found)] = Field(
        description="a mission file beside the claims file, or the name of a shipped one"
    )
    scheme: str
    mode: Literal["sampled", "continuous"] | None = None
    changes: dict[str, Any] = Field(default={}, description="values by path, e.g. 'truth.inertia_factor'")


class StatusModel(Part):
    """A number of a status bit: how many samples raised it, or when the first did [s]."""

    name: Literal[tuple(bit.name for bit in StepStatus)]  # type: ignore[valid-type]
    value: Literal["samples", "first_s"]


class ComputationModel(Part):
    """The computation that answers a claim."""

    name: str
    arguments: dict[str, Any] = {}

    @field_validator("name")
    @classmethod
    def _is_known(cls, value: str) -> str:
        if value not in COMPUTATIONS:
            raise ValueError(f"no computation {shown(value)}{near_key(value, list(COMPUTATIONS))}")
        return value

    @field_validator("arguments")
    @classmethod
    def _is_beside(cls, value: dict[str, Any], info: ValidationInfo) -> dict[str, Any]:
        problem = value.get("problem")
        return {**value, "problem": _found(problem, info)} if isinstance(problem, str) else value

    @model_validator(mode="after")
    def _are_taken(self) -> ComputationModel:
        table = arguments_table(self.name)
        try:
            table.model_validate(self.arguments)
        except ValidationError as error:
            path, message = sentences(error, table, self.arguments)[0]
            raise MisfitError(message, "arguments", *path) from None
        return self


@lru_cache(maxsize=64)
def arguments_table(name: str) -> type[Part]:
    """Return the model of what a computation takes, by the types that its function declares."""
    function = COMPUTATIONS[name]
    hints, taken = get_type_hints(function), inspect.signature(function).parameters
    fields: dict[str, Any] = {
        key: (hints[key], ... if each.default is inspect.Parameter.empty else each.default)
        for key, each in taken.items()
    }
    return create_model("Arguments", __base__=Part, **fields)


#: Beyond this lies no number of a craft, whatever its unit.
_BEYOND = 1e12


class ClaimModel(Part):
    """One printed number."""

    id: Name
    text: str = Field(description="what is claimed, in a few words")
    where: str = Field(description="where it is printed")
    printed: float
    unit: str = ""
    relation: Literal["equals", "at_most", "at_least"] = Field(
        default="equals", description="equals: the printed number itself; else the number is a bound"
    )
    tolerance: NonNegative = Field(default=0.0, description="relative to the printed number")
    tolerance_absolute: NonNegative = 0.0
    assumption: str = Field(default="", description="what the paper does not say and the answer needs")
    flight: FlightModel | None = None
    metric: MetricAsked | None = Field(default=None, description="as [[metric]] of a mission, without a name")
    status: StatusModel | None = Field(default=None, description="instead of a metric: a status of the flight")
    computation: ComputationModel | None = None
    bound: ComputationModel | None = Field(
        default=None, description="a number that no implementation can pass; the printed one may"
    )
    bound_is: Literal["lowest", "highest"] = "lowest"

    @model_validator(mode="after")
    def _has_one_answer(self) -> ClaimModel:
        if (self.flight is None) == (self.computation is None):
            raise ValueError(f"claim {self.id!r} needs either a flight or a computation")
        if (self.flight is not None) != ((self.metric is not None) + (self.status is not None) == 1):
            raise ValueError(f"claim {self.id!r}: a flight, and nothing else, takes either a metric or a status")
        return self

    @model_validator(mode="after")
    def _can_fail(self) -> ClaimModel:
        most, told = abs(self.printed) or _BEYOND, f"claim {self.id!r} printed as {self.printed:g}"
        for name, room, limit in (
            ("tolerance", self.tolerance, 1.0),
            ("tolerance_absolute", self.tolerance_absolute, most),
        ):
            if room > limit:
                message = f"{name} is {room:g}, expected at most {limit:g}; it would take any answer to {told}"
                raise MisfitError(message, name)
        if self.metric is not None and (self.metric.threshold or 0.0) > _BEYOND:
            message = f"threshold is {self.metric.threshold:g}, expected at most {_BEYOND:g}; no signal exceeds it"
            raise MisfitError(message, "metric", "threshold")
        return self


class ClaimsFile(Part):
    """The claims of one paper."""

    format: Format
    kind: Literal["claims"]
    paper: str
    doi: str
    claim: Annotated[list[ClaimModel], Field(min_length=1)]

    @field_validator("claim")
    @classmethod
    def _ids_differ(cls, value: list[ClaimModel]) -> list[ClaimModel]:
        ids = [claim.id for claim in value]
        for one in ids:
            if ids.count(one) > 1:
                raise ValueError(f"the claim {one!r} is given twice")
        return value


def papers() -> dict[str, Path]:
    """Return the claims files that are shipped, by the paper's name, e.g. "huang2020"."""
    return {path.parent.name: path for path in sorted(assets.folder("problems").glob("*/claims.toml"))}


def read_claims(paper: str) -> ClaimsFile:
    """Return the claims of a shipped paper, or of a claims file given by its path.

    Raises
    ------
    ProblemError
        For an unknown paper or a file that is wrong; the message has file, line and key.
    """
    known = papers()
    if paper not in known and not Path(paper).is_file():
        raise ProblemError(f"no paper {paper!r}; {offer(paper, known, ', or the path of a claims file')}")
    return read_kind(known.get(paper, Path(paper)), "claims").validated(ClaimsFile)
