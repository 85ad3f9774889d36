"""Problem files of kind "allocation": from their tables to a problem of `casadi_gnc.allocation`.

`load_allocation` returns an `AllocationCase`; what does not fit together is told with its table.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np

from casadi_gnc.allocation import AllocationProblem
from casadi_gnc.allocation.faults import with_faults
from casadi_gnc.allocation.impulse import never_fires
from casadi_gnc.allocation.lexicographic import LeastPropellant, Limit
from casadi_gnc.allocation.priorities import axis_scale, by_priority
from casadi_gnc.allocation.wheels import at_speed, combine, wheel_problem
from casadi_gnc.errors import AllocationError
from casadi_gnc.mechanics.reaction_wheels import WheelArray
from casadi_gnc.problem_files.allocation_tables import AllocationModel, Faults, SpinningWheels
from casadi_gnc.problem_files.boundary import about
from casadi_gnc.problem_files.document import Complaints, read_kind
from casadi_gnc.tables.thrusters import MountedThrusters

_NEAR = 1e-2  # ratio of singular values, rows of like size, below which an effort is nearly lost


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
    least_propellant : the allocator of a file with that objective, else None.
    units : of the rows of effort, "" where a file does not say.
    doubts : sentences on what a file may not mean as it says it.
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
    doubts: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    least_propellant: LeastPropellant | None = None

    @property
    def warnings(self) -> list[str]:
        """Sentences on what a user should know before trusting the answers."""
        told = list(self.doubts)
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
    complaints = Complaints(document)
    model: AllocationModel | None = complaints.checked(AllocationModel, document.data)
    complaints.settle()
    assert model is not None
    with about(document):
        return _case(model, document.path.stem, complaints)


def _case(model: AllocationModel, name: str, complaints: Complaints) -> AllocationCase:
    """Return the case; raise `ProblemError` about the table that does not fit."""
    options, scale, problem = model.options, np.ones(0), None
    with complaints.about("matrices" if model.matrices is not None else "wheels" if model.wheels else "thrusters"):
        problem = _actuators(model)
    complaints.settle()
    assert problem is not None
    with complaints.about("weights"):
        problem = replace(problem, **_weights(model))
    doubts = tuple(_doubtful(problem, model.faults))
    with complaints.about("faults"):
        problem = _with_faults(problem, model.faults)
    complaints.settle()
    physical, rows = problem, len(problem.effectiveness)
    scale = np.ones(rows)
    is_linear = options.objective == "propellant"
    if options.priorities is not None and not is_linear:
        with complaints.about("options", "priorities"):
            scale = axis_scale(options.priorities, options.priority_ratio)
            problem = by_priority(problem, options.priorities, options.priority_ratio)
    units = ("N m",) * rows if model.matrices is None else tuple(model.matrices.units or ("",) * rows)
    if len(units) != rows:
        complaints.add(("matrices", "units"), f"{len(units)} units, expected {rows}, one a row")
    limit = None if model.torque_limit_N_m is None else np.array(model.torque_limit_N_m)
    if limit is not None and len(limit) != rows:
        complaints.add(("torque_limit_N_m",), f"torque_limit_N_m has {len(limit)} entries, expected {rows}")
    for place, each in enumerate(model.limit):
        if len(each.coefficients) != problem.count:
            told = f"{len(each.coefficients)} coefficients, expected {problem.count}, one an actuator"
            complaints.add(("limit", place, "coefficients"), told)
    if is_linear and not np.any(physical.effort_weight):
        complaints.add(("weights", "effort"), "no force costs propellant: every effort weight is zero; give one more")
    complaints.settle()
    least = None
    if is_linear:
        limits = [Limit(each.coefficients, each.most) for each in model.limit]
        with complaints.about("options", "priorities"):
            least = LeastPropellant(physical, options.priorities, limits)
        if model.weights.change != 0.0 and "change" in model.weights.model_fields_set:
            doubts += ("weights.change is not looked at: propellant does not depend on the forces before",)
    complaints.settle()
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
        doubts,
        units,
        least,
    )


def _actuators(model: AllocationModel) -> AllocationProblem:
    """Return the problem of the actuators of a file, weights left as they are."""
    if model.matrices is not None:
        given = model.matrices
        rate = np.inf if given.max_rate_per_s is None else np.asarray(given.max_rate_per_s)
        return AllocationProblem(
            np.array(given.effectiveness),
            given.lower,
            given.upper,
            coupling=given.coupling,
            errors=given.errors,
            max_step=rate * model.sample_period_s,
            accuracy_weight=model.weights.accuracy,
        )
    parts = []
    if model.thrusters is not None:
        parts.append(_thrusters(model.thrusters, model.sample_period_s, model.weights.accuracy))
    if model.wheels is not None:
        parts.append(_wheels(model.wheels, model.sample_period_s, model.weights.accuracy))
    return parts[0] if len(parts) == 1 else combine(*parts)


def _weights(model: AllocationModel) -> dict[str, Any]:
    """Return the weights of a file; the wheels' null-space preference stays if none is given."""
    given = model.weights
    weights: dict[str, Any] = {
        "accuracy_weight": given.accuracy,
        "effort_weight": given.effort,
        "change_weight": given.change,
        "preferred": given.preferred,
    }
    if model.wheels is not None and "preferred" not in given.model_fields_set:
        weights.pop("preferred")
    return weights


def _with_faults(problem: AllocationProblem, faults: Faults) -> AllocationProblem:
    stuck, degraded = ([fault.actuator for fault in group] for group in (faults.stuck, faults.degraded))
    for number in stuck:
        if number in faults.dead:
            raise AllocationError(
                f"actuator {number} is both dead and stuck; keep one: a dead one makes no force at all"
            )
    for number, what in [*((each, "stuck") for each in stuck), *((each, "degraded") for each in degraded)]:
        if (stuck if what == "stuck" else degraded).count(number) > 1:
            raise AllocationError(f"actuator {number} is {what} twice; keep one")
    return with_faults(
        problem,
        dead=tuple(faults.dead),
        stuck={fault.actuator: fault.force_N for fault in faults.stuck},
        degraded={fault.actuator: (fault.low, fault.high) for fault in faults.degraded},
    )


def _doubtful(problem: AllocationProblem, faults: Faults) -> Iterator[str]:
    """Yield a sentence for each stuck actuator whose force is beyond the bounds that it would have."""
    for fault in faults.stuck:
        if fault.actuator > problem.count:
            continue  # refused with the faults
        low, high = (float(bound[fault.actuator - 1]) for bound in (problem.lower, problem.upper))
        if not low <= fault.force_N <= high:
            bounds = f"{low:g} to {high:g}"
            yield f"actuator {fault.actuator} is stuck at {fault.force_N:g}, outside its own bounds, {bounds}"


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
