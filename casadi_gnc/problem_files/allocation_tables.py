"""What a file of kind "allocation" may say: actuators, uncertainty, bounds, weights, faults and options.

Actuators come as thrusters (geometry in the chaser's frame, as in a mission), as wheels, both, or as plain matrices.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, field_validator, model_validator

from casadi_gnc.problem_files.mission_tables import Format
from casadi_gnc.tables.part import MOST_ACTUATORS, NonNegative, Part, Positive, Table
from casadi_gnc.tables.thrusters import MountedThrusters
from casadi_gnc.tables.wheels import Wheels

Number = Annotated[int, Field(ge=1, description="actuators are numbered from 1, in the order of the columns")]
Column = Annotated[list[float], Field(min_length=1, max_length=MOST_ACTUATORS)]
#: Most vertices of the errors: a cost each in every iteration.
_MOST_VERTICES = 4096
#: Most rows of effort.
_MOST_ROWS = 24


class SpinningWheels(Wheels):
    """Reaction wheels, axes in the body frame, and how fast they turn now."""

    speed_rad_per_s: list[float] | None = Field(default=None, description="speeds now; zero if left out")
    desaturation_per_s: NonNegative = Field(default=0.0, description="null-space rate that brings speeds to zero")


class Matrices(Part):
    """Effectiveness and uncertainty as plain matrices."""

    effectiveness: Table
    units: list[Annotated[str, Field(max_length=12)]] | None = Field(
        default=None, description="of the rows of effort, for what is printed; rows of one unit are of one kind"
    )
    coupling: Table | None = None
    errors: Annotated[list[Table], Field(min_length=1, max_length=_MOST_VERTICES)] | None = None
    lower: Column | float
    upper: Column | float
    max_rate_per_s: Column | float | None = Field(default=None, description="no limit if left out")

    @field_validator("effectiveness")
    @classmethod
    def _is_bounded(cls, value: list[list[float]]) -> list[list[float]]:
        if len(value) > _MOST_ROWS or len(value[0]) > MOST_ACTUATORS:
            raise ValueError(
                f"{len(value)} rows and {len(value[0])} actuators, expected {_MOST_ROWS} and {MOST_ACTUATORS} at most"
            )
        return value

    @field_validator("errors")
    @classmethod
    def _are_alike(cls, value: list[list[list[float]]] | None) -> list[list[list[float]]] | None:
        sizes = {(len(vertex), len(vertex[0])) for vertex in value or ()}
        if len(sizes) > 1:
            told = " and ".join(f"{rows} x {columns}" for rows, columns in sorted(sizes)[:4])
            raise ValueError(f"vertices of {told}, expected matrices of one size")
        return value


class Weights(Part):
    """Weights of the objective; defaults as in a mission."""

    accuracy: Positive = Field(default=1e6, description="h")
    effort: list[NonNegative] | NonNegative = Field(default=1.0, description="diagonal of M1")
    change: list[NonNegative] | NonNegative = Field(default=1.0, description="diagonal of M2")
    preferred: list[float] | float = Field(default=0.0, description="forces that cost nothing")


class Stuck(Part):
    """An actuator that stays at a force."""

    actuator: Number
    force_N: float


class Degraded(Part):
    """An actuator whose force is only known to lie between two shares of the command."""

    actuator: Number
    low: NonNegative
    high: NonNegative


class Faults(Part):
    """Known and possible faults."""

    dead: list[Number] = []
    stuck: list[Stuck] = []
    degraded: list[Degraded] = []


class LinearLimit(Part):
    """A bound on a weighted sum of the forces: total power, neighbours that must not push together."""

    name: Annotated[str, Field(max_length=40)] = ""
    coefficients: Column = Field(description="of each actuator, in units of the limit per force")
    most: float = Field(description="the sum stays at or below this")


class Options(Part):
    """How commands that cannot be met as they are, are treated."""

    objective: Literal["quadratic", "propellant"] = Field(
        default="quadratic", description="propellant: the sum of effort |F - preferred|, by linear programs"
    )
    keep_direction: bool = Field(default=False, description="scale a command that cannot be met instead of turning it")
    priorities: list[Annotated[int, Field(ge=0)]] | None = Field(default=None, description="one a row, 0 first")
    priority_ratio: Annotated[float, Field(gt=1)] = 100.0
    least_force_N: Positive | None = Field(
        default=None, description="minimum impulse: forces are zero or at least this"
    )

    @model_validator(mode="after")
    def _one_treatment(self) -> Options:
        if self.keep_direction and self.least_force_N is not None:
            raise ValueError("keep_direction and least_force_N cannot be combined; leave one out")
        if self.objective == "propellant":
            if self.keep_direction or self.least_force_N is not None:
                given = "keep_direction" if self.keep_direction else "least_force_N"
                raise ValueError(f'{given} needs objective = "quadratic"; leave one out')
            if "priority_ratio" in self.model_fields_set:
                raise ValueError('priorities are exact with objective = "propellant"; leave priority_ratio out')
        return self


class AllocationModel(Part):
    """An allocation file."""

    format: Format
    kind: Literal["allocation"]
    title: str = ""
    source: str = ""
    sample_period_s: Positive = 0.1
    torque_limit_N_m: list[Positive] | None = Field(default=None, description="box that a law may ask for")
    thrusters: MountedThrusters | None = None
    wheels: SpinningWheels | None = None
    matrices: Matrices | None = None
    weights: Weights = Weights()
    faults: Faults = Faults()
    options: Options = Options()
    limit: Annotated[list[LinearLimit], Field(max_length=MOST_ACTUATORS)] = []

    @model_validator(mode="after")
    def _limits_fit(self) -> AllocationModel:
        if self.limit and self.options.objective != "propellant":
            raise ValueError('[[limit]] needs objective = "propellant" under [options], whose linear programs keep it')
        return self

    @model_validator(mode="after")
    def _some_actuators(self) -> AllocationModel:
        if self.matrices is not None and (self.thrusters is not None or self.wheels is not None):
            raise ValueError("[matrices] stands alone; leave [thrusters] and [wheels] out")
        if self.matrices is None and self.thrusters is None and self.wheels is None:
            raise ValueError("no actuators: give [thrusters], [wheels], both, or [matrices]")
        return self
