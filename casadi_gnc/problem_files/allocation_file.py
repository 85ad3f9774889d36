"""Problem files of kind "allocation": actuators, uncertainty, bounds, weights and faults.

Actuators come as thrusters (geometry in the chaser's frame, as in a mission), as wheels, both, or as
plain matrices. `load_allocation` returns an `AllocationCase` ready for `casadi_gnc.allocation`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Literal

import casadi as ca
import numpy as np
from pydantic import Field, model_validator

from casadi_gnc.allocation import AllocationProblem
from casadi_gnc.allocation.faults import with_faults
from casadi_gnc.allocation.impulse import never_fires
from casadi_gnc.allocation.priorities import axis_scale, by_priority
from casadi_gnc.allocation.wheels import at_speed, combine, wheel_problem
from casadi_gnc.errors import AllocationError, ProblemError
from casadi_gnc.mechanics.reaction_wheels import WheelArray
from casadi_gnc.problem_files.document import read_kind
from casadi_gnc.problem_files.mission_tables import Format
from casadi_gnc.tables.part import NonNegative, Part, Positive
from casadi_gnc.tables.thrusters import MountedThrusters
from casadi_gnc.tables.wheels import Wheels

_NEAR = 1e-2  # ratio of singular values, rows of like size, below which an effort is nearly lost
Number = Annotated[int, Field(ge=1, description="actuators are numbered from 1, in the order of the columns")]
Table = Annotated[list[list[float]], Field(min_length=1)]


class SpinningWheels(Wheels):
    """Reaction wheels, axes in the body frame, and how fast they turn now."""

    speed_rad_per_s: list[float] | None = Field(default=None, description="speeds now; zero if left out")
    desaturation_per_s: NonNegative = Field(default=0.0, description="null-space rate that brings speeds to zero")


class Matrices(Part):
    """Effectiveness and uncertainty as plain matrices."""

    effectiveness: Table
    coupling: Table | None = None
    errors: Annotated[list[Table], Field(min_length=1)] | None = None
    lower: list[float] | float
    upper: list[float] | float
    max_rate_per_s: list[float] | float | None = None


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


class Options(Part):
    """How commands that cannot be met as they are, are treated."""

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

    @model_validator(mode="after")
    def _some_actuators(self) -> AllocationModel:
        if self.matrices is not None and (self.thrusters is not None or self.wheels is not None):
            raise ValueError("[matrices] stands alone; leave [thrusters] and [wheels] out")
        if self.matrices is None and self.thrusters is None and self.wheels is None:
            raise ValueError("no actuators: give [thrusters], [wheels], both, or [matrices]")
        return self


@dataclass(frozen=True, eq=False)
class AllocationCase:
    """Hold what an allocation file describes.

    Parameters
    ----------
    problem : for `casadi_gnc.allocation`; rows scaled by `row_scale` where priorities are given.
    physical : the same without that scaling, in the effort's own unit.
    has_wheels : whether there are wheels, whose speeds a table of commands does not follow.
    row_scale : (R,), factor to put on a command before it is allocated.
    torque_limit : box that a law may ask for, (R,), or None.
    keep_direction, least_force : see the file's options.
    """

    name: str
    title: str
    problem: AllocationProblem
    physical: AllocationProblem
    has_wheels: bool
    row_scale: np.ndarray
    torque_limit: np.ndarray | None
    keep_direction: bool
    least_force: float | None

    @property
    def warnings(self) -> list[str]:
        """Sentences on what a user should know before trusting the answers."""
        told = []
        if self.has_wheels:
            told.append("wheel speeds stay as given: their limits and desaturation hold for one sample, not along rows")
        told += _rank_warnings(self.physical)
        if self.least_force is not None:
            never = never_fires(self.problem, self.least_force)
            if len(never):
                listed = ", ".join(str(number) for number in never)
                told.append(
                    f"least_force_N is {self.least_force:g}, and from rest actuators {listed} can never make as much: "
                    "their upper bound, or max_rate times the sample period, is below it; they will never fire"
                )
        return told


def _rank_warnings(problem: AllocationProblem) -> list[str]:
    """Return what the effectiveness of the actuators that can move lacks; those whose bounds meet make no effort."""
    rows, movable = len(problem.effectiveness), problem.upper > problem.lower
    columns = (problem.effectiveness * (problem.upper - problem.lower))[:, movable]
    if not columns.size:
        return ["no actuator can move: every lower bound meets its upper one"]
    reach = np.linalg.norm(columns, axis=1)
    if rows > 1 and np.all(reach > 0):  # rows in their own units
        columns = columns / reach[:, None]
    strength = np.zeros(rows)
    found = np.linalg.svd(columns, compute_uv=False)
    strength[: len(found)] = found
    rank = int(np.sum(strength > 1e-9 * max(strength[0], 1e-300)))
    if rank < rows:
        of = "the effectiveness" if np.all(movable) else "the effectiveness of the actuators that can move"
        return [f"{of} has rank {rank} of {rows}: some effort cannot be made by any actuator"]
    if strength[-1] < _NEAR * strength[0]:
        return [
            f"the effectiveness of the actuators that can move is near to rank {rows - 1} of {rows} (singular values "
            f"{strength[-1] / strength[0]:.1e} apart): some effort takes very large forces"
        ]
    return []


def load_allocation(problem: str | Path) -> AllocationCase:
    """Return the case of an allocation file, given by path or shipped name; raise `ProblemError`."""
    document = read_kind(problem, "allocation")
    model: AllocationModel = document.validated(AllocationModel)
    try:
        return _case(model, document.path.stem)
    except AllocationError as error:
        raise ProblemError(str(error), document.path.name) from None


def _case(model: AllocationModel, name: str) -> AllocationCase:
    weights = {
        "accuracy_weight": model.weights.accuracy,
        "effort_weight": model.weights.effort,
        "change_weight": model.weights.change,
        "preferred": model.weights.preferred,
    }
    if model.matrices is not None:
        given = model.matrices
        rate = np.inf if given.max_rate_per_s is None else np.asarray(given.max_rate_per_s)
        problem = AllocationProblem(
            np.array(given.effectiveness),
            given.lower,
            given.upper,
            coupling=given.coupling,
            errors=given.errors,
            max_step=rate * model.sample_period_s,
            **weights,
        )
    else:
        parts = []
        if model.thrusters is not None:
            parts.append(_thrusters(model.thrusters, model.sample_period_s, model.weights.accuracy))
        if model.wheels is not None:
            parts.append(_wheels(model.wheels, model.sample_period_s, model.weights.accuracy))
        problem = parts[0] if len(parts) == 1 else combine(*parts)
        # Weights of the file replace the defaults; the wheels' null-space preference stays if none is given.
        if model.wheels is not None and "preferred" not in model.weights.model_fields_set:
            weights.pop("preferred")
        problem = replace(problem, **weights)
    faults = model.faults
    problem = with_faults(
        problem,
        dead=tuple(faults.dead),
        stuck={fault.actuator: fault.force_N for fault in faults.stuck},
        degraded={fault.actuator: (fault.low, fault.high) for fault in faults.degraded},
    )
    rows = len(problem.effectiveness)
    scale, options, physical = np.ones(rows), model.options, problem
    if options.priorities is not None:
        problem = by_priority(problem, options.priorities, options.priority_ratio)
        scale = axis_scale(options.priorities, options.priority_ratio)
    limit = None if model.torque_limit_N_m is None else np.array(model.torque_limit_N_m)
    if limit is not None and len(limit) != rows:
        raise AllocationError(f"torque_limit_N_m has {len(limit)} entries, expected {rows}")
    return AllocationCase(
        name,
        model.title,
        problem,
        physical,
        model.wheels is not None,
        scale,
        limit,
        options.keep_direction,
        options.least_force_N,
    )


def _thrusters(model: MountedThrusters, period: float, accuracy: float) -> AllocationProblem:
    half = model.centre_of_mass_error_m
    rate = model.max_force_rate_N_per_s
    common: dict[str, Any] = {
        "lower": model.min_force_N,
        "upper": model.max_force_N,
        "max_step": np.inf if rate is None else rate * period,
        "accuracy_weight": accuracy,
    }
    rotation = model.matrix()
    seen = model.mounted().seen_from(rotation, model.centre_of_mass_m)
    if not any(half):
        return AllocationProblem(np.array(seen.effectiveness), **common)
    return AllocationProblem.of_thrusters(seen, rotation, ([-value for value in half], half), **common)


def _wheels(model: SpinningWheels, period: float, accuracy: float) -> AllocationProblem:
    wheels = WheelArray(ca.DM(model.axes).T, model.inertia_kg_m2, model.max_acceleration, model.max_speed)
    speed = np.zeros(len(model.axes)) if model.speed_rad_per_s is None else np.array(model.speed_rad_per_s)
    problem = wheel_problem(wheels, accuracy_weight=accuracy)
    return at_speed(wheels, problem, speed, period, desaturation=model.desaturation_per_s)
