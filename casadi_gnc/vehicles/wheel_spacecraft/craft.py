"""A spacecraft on reaction wheels, with faults of its actuators and errors of its sensors.

Tables of the file: [spacecraft] with wheels, [truth], [sensors], [[fault]], [environment], [initial].
Source: Huang and Duan (2019), doi:10.1109/ACCESS.2019.2949285.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Iterator
from typing import Annotated, Any, Literal, cast

import casadi as ca
import numpy as np
from pydantic import Field, field_validator, model_validator

from casadi_gnc.allocation import AllocationProblem, OnlineInFlight, PseudoInverse, SolverInFlight
from casadi_gnc.allocation.faults import with_faults
from casadi_gnc.checks import Check
from casadi_gnc.errors import AllocationError, FlightError, ProblemError
from casadi_gnc.mathematics.bounds import any_of
from casadi_gnc.mechanics import reaction_wheels
from casadi_gnc.mechanics.actuator_faults import ActuatorFault, FaultSchedule
from casadi_gnc.mechanics.reaction_wheels import Gyrostat, WheelArray
from casadi_gnc.missions.mission import Actuation, Mission, Panel
from casadi_gnc.missions.mission import Scheme as MissionScheme
from casadi_gnc.problem_files.schema import (
    Matrix,
    MissionModel,
    NonNegative,
    Orientation,
    Part,
    Positive,
    Rows,
    SchemeModel,
    Vector,
    law_tables,
    orientation,
)
from casadi_gnc.status import StepStatus
from casadi_gnc.tables import matrices
from casadi_gnc.vehicles import Craft, Where
from casadi_gnc.vehicles.combined_spacecraft.craft import Environment, Initial, PinvModel
from casadi_gnc.vehicles.wheel_spacecraft.plant import SensorError, WheelSpacecraft

#: Shown with every flight whose wheel axes are taken for points.
AXES_AS_POINTS = (
    "Wheel axes are taken for points, C = R (Cbar - r_c 1'), as the paper has them; those of real wheels are free "
    "vectors, C = R Cbar."
)


class AxesAsPoints(Part):
    """The paper's configuration matrix C = R (Cbar - r_c 1') instead of C = R Cbar (eqs 4 to 7)."""

    matrix: Matrix = Field(description="R, used as it is: the printed one is no rotation")
    centre_of_mass_m: Vector = Field(description="r_c, in the frame in which the axes are given")


class Wheels(Part):
    """The wheels, in the frame of the craft that carries them."""

    axes: Rows = Field(description="spin axes, unit vectors, one a row")
    inertia_kg_m2: Positive
    max_acceleration_rad_per_s2: Positive
    max_speed_rad_per_s: Positive | None = Field(default=None, description="no limit if left out")
    as_points: AxesAsPoints | None = None

    @field_validator("axes")
    @classmethod
    def _are_units(cls, value: list[list[float]]) -> list[list[float]]:
        return [matrices.check_unit(row, f"wheel {i}: ") for i, row in enumerate(value, 1)]


class Spacecraft(Orientation):
    """The craft as known, which is what the laws believe; its orientation turns the wheels' axes."""

    model: Literal["wheel_spacecraft"]
    inertia_kg_m2: Matrix = Field(description="about the centre of mass, wheels locked, body frame")
    rate_limit_rad_per_s: Positive = Field(default=10.0, description="larger measured rates per axis are rejected")
    wheels: Wheels

    _spd = field_validator("inertia_kg_m2")(matrices.check_inertia)

    @model_validator(mode="after")
    def _one_configuration(self) -> Spacecraft:
        if self.wheels.as_points is not None and orientation(self) is not None:
            raise ValueError("wheels.as_points has a matrix of its own; leave the rotation out")
        return self


class Truth(Part):
    """How the real craft differs from the known one."""

    inertia_kg_m2: Matrix | None = None
    centre_of_mass_error_m: Vector = Field(default=[0.0, 0.0, 0.0], description="true minus known, of axes as points")

    @field_validator("inertia_kg_m2")
    @classmethod
    def _spd(cls, value: list[list[float]] | None) -> list[list[float]] | None:
        return None if value is None else matrices.check_inertia(value)


class Sensors(Part):
    """Standard deviations of the sensors' errors, drawn as [noise] says (eq. 60)."""

    mrp_deviation: NonNegative = Field(default=0.0, description="of each axis")
    mrp_factor_deviation: NonNegative = Field(default=0.0, description="of the factor of all axes")
    rate_deviation_rad_per_s: NonNegative = Field(default=0.0, description="of each axis")
    rate_factor_deviation: NonNegative = Field(default=0.0, description="of the factor of all axes")


class Fault(Part):
    """A fault that grows as 1 - e^(-growth (t - from)) (eqs 20 and 21); it ends at once."""

    channel: Literal["axis", "wheel"] = Field(description="axis: the torques after the wheels; wheel: what wheels make")
    index: int = Field(description="of the axis or wheel, from 1")
    effectiveness: float = Field(default=1.0, description="share of the command that is still made")
    bias_N_m: float = Field(default=0.0, description="of an axis: torque on the body")
    bias_rad_per_s2: float = Field(default=0.0, description="of a wheel: acceleration")
    from_s: float
    until_s: float | None = Field(default=None, description="it stays if left out")
    growth_per_s: float = 1.0

    @model_validator(mode="after")
    def _bias_fits(self) -> Fault:
        wrong, right = ("bias_rad_per_s2", "bias_N_m") if self.channel == "axis" else ("bias_N_m", "bias_rad_per_s2")
        if getattr(self, wrong):
            raise ValueError(f'the bias of a fault of channel "{self.channel}" is {right}, not {wrong}')
        return self


class RobustModel(Part):
    """Robust min-max allocation against errors of the centre of mass (axes as points) or weak wheels."""

    method: Literal["robust"]
    backend: Literal["online", "clarabel"] = Field(default="online", description="online: the on-board solver, in C")
    centre_of_mass_error_m: Annotated[list[NonNegative], Field(min_length=3, max_length=3)] | None = Field(
        default=None, description="half width of the box of errors; of axes as points only"
    )
    wheel_effectiveness: Annotated[list[NonNegative], Field(min_length=2, max_length=2)] | None = Field(
        default=None, description="least and largest share of its command that each wheel may make"
    )
    accuracy_weight: Positive = Field(default=1e4, description="h, weight of the squared torque error")
    effort_weight: NonNegative = Field(default=1.0, description="diagonal of M1")
    change_weight: NonNegative = Field(default=0.0, description="diagonal of M2")


_Laws = law_tables("attitude_pd", "two_observer_attitude", "finite_time_fault_tolerant", "rate_damping", "detumble")


class Scheme(SchemeModel):
    """A scheme of this craft."""

    torque_limit_N_m: Annotated[list[Positive], Field(min_length=3, max_length=3)]
    law: _Laws  # type: ignore[valid-type]
    allocation: Annotated[PinvModel | RobustModel, Field(discriminator="method")]


class MissionFile(MissionModel):
    """A mission of a spacecraft on wheels."""

    spacecraft: Spacecraft
    truth: Truth = Truth()
    sensors: Sensors = Sensors()
    fault: list[Fault] = []
    environment: Environment = Environment()
    initial: Initial
    scheme: Annotated[list[Scheme], Field(min_length=1)]


def build(model: MissionFile, where: Where) -> Craft:
    """Return the craft that a file describes."""
    craft, truth, sensors = model.spacecraft, model.truth, model.sensors
    _refuse(model, where)
    wheels, orbit_rate = craft.wheels, model.environment.orbit_rate_rad_per_s
    known = WheelArray(_axes(craft, [0.0, 0.0, 0.0]), wheels.inertia_kg_m2)
    real = WheelArray(_axes(craft, truth.centre_of_mass_error_m), wheels.inertia_kg_m2)
    strength = np.linalg.svd(np.array(known.axes), compute_uv=False)
    if len(strength) < 3 or strength[2] < 1e-9 * strength[0]:
        place = where(("spacecraft", "wheels", "axes"))
        raise ProblemError("the wheels make no torque about some axis; add or turn one", place)
    for i, scheme in enumerate(model.scheme):
        try:
            _allocator(scheme.allocation, craft, known)
        except AllocationError as error:
            raise ProblemError(str(error), where(("scheme", i, "allocation"))) from None
    largest_speed, count = wheels.max_speed_rad_per_s or math.inf, known.count
    plant = WheelSpacecraft(
        Gyrostat(ca.DM(truth.inertia_kg_m2 or craft.inertia_kg_m2), orbit_rate=orbit_rate, wheels=real),
        model.environment.disturbance(),
        axis_faults=_faults(model, "axis", 3, where),
        wheel_faults=_faults(model, "wheel", count, where),
        attitude_error=SensorError(sensors.mrp_deviation, sensors.mrp_factor_deviation),
        rate_error=SensorError(sensors.rate_deviation_rad_per_s, sensors.rate_factor_deviation),
        max_speed=largest_speed,
        rate_limit=craft.rate_limit_rad_per_s,
    )
    return Craft(
        plant=plant,
        start=[*model.initial.mrp, *model.initial.rate_rad_per_s, *[0.0] * count],
        start_keys={"mrp": "mrp", "rate": "rate_rad_per_s"},
        believed=Gyrostat(ca.DM(craft.inertia_kg_m2), orbit_rate=orbit_rate, wheels=known),
        actuation=lambda scheme: _actuation(scheme, craft, known),
        target={"mrp": [0.0] * 3, "rate": [0.0] * 3},
        checks=lambda mission, scheme: _checks(model, mission, scheme),
        truths=lambda mission, scheme: _truths(model, real),
        panels=(
            Panel("tracked", "mrp", "attitude MRP"),
            Panel("effort", "torque", "torque"),
            Panel("actuators", "wheel_acceleration", "wheel acc."),
            Panel("lines", "wheel_speed", "wheel speed"),
        ),
        notes=() if wheels.as_points is None else (AXES_AS_POINTS,),
    )


def _checks(model: MissionFile, mission: Mission, scheme: MissionScheme) -> Iterator[Check]:
    """Yield what can be said of a craft on wheels only."""
    from casadi_gnc.checking import geometry, wheels

    craft, plant = model.spacecraft, cast(WheelSpacecraft, mission.truth)
    if craft.wheels.as_points is not None:
        yield geometry.rotation(
            "geometry.configuration",
            craft.wheels.as_points.matrix,
            "The matrix that turns the wheels' axes is no rotation: lengths and angles between axes come out wrong.",
            "Correct the matrix, or give the craft's orientation in the place of as_points.",
        )
    yield from wheels.wheel_speed(mission, scheme, plant.max_speed)
    allocator, told = scheme.actuation.allocator, _told_errors(model, scheme.name)
    if told is None or not any(fault.channel == "wheel" for fault in model.fault):
        return

    def with_weight(weight: float) -> Any:
        return dataclasses.replace(allocator, problem=dataclasses.replace(allocator.problem, accuracy_weight=weight))

    corners = []
    for corner in itertools.product(*((-half, half) for half in told)):
        array = WheelArray(_axes(craft, list(corner)), craft.wheels.inertia_kg_m2)
        body = dataclasses.replace(plant.body, wheels=array)
        corners.append(dataclasses.replace(mission, truth=dataclasses.replace(plant, body=body)))
    yield wheels.weight_window(mission, scheme, with_weight, corners)


def _told_errors(model: MissionFile, name: str) -> list[float] | None:
    """Return the half widths of the mass centre that a scheme's allocation is told, if it is."""
    allocation = next(scheme.allocation for scheme in model.scheme if scheme.name == name)
    return allocation.centre_of_mass_error_m if isinstance(allocation, RobustModel) else None


def _truths(model: MissionFile, real: WheelArray) -> dict[str, np.ndarray]:
    """Return the true effectiveness without faults, and with each set of faults that come together."""
    effectiveness = np.array(ca.DM(real.effectiveness))
    truths = {"the true wheels": effectiveness}
    onsets = sorted({fault.from_s for fault in model.fault})
    for onset in onsets:
        e = effectiveness.copy()
        present = [f for f in model.fault if f.from_s <= onset and (f.until_s is None or f.until_s > onset)]
        for fault in present:
            if fault.channel == "wheel":
                e[:, fault.index - 1] *= fault.effectiveness
            else:
                e[fault.index - 1] *= fault.effectiveness
        weak = [fault for fault in present if fault.effectiveness != 1]
        told = ", ".join(f"{fault.channel} {fault.index} at {fault.effectiveness:g}" for fault in weak) or "biases"
        truths[f"the faults from {onset:g} s on ({told})"] = e
    return truths


def _axes(craft: Spacecraft, error: list[float]) -> ca.DM:
    """Return C, (3, N), where the centre of mass is off by `error` [m]."""
    mounted, points = ca.DM(craft.wheels.axes).T, craft.wheels.as_points
    if points is not None:
        centre = [c + e for c, e in zip(points.centre_of_mass_m, error, strict=True)]
        return reaction_wheels.axes_as_points(points.matrix, mounted, centre)
    turned = orientation(craft)
    return reaction_wheels.free_axes(ca.DM.eye(3) if turned is None else turned, mounted)


def _refuse(model: MissionFile, where: Where) -> None:
    """Refuse a mass centre where none enters, and a robust allocation against nothing."""
    enters = model.spacecraft.wheels.as_points is not None
    told = (
        "no centre of mass moves wheel axes, which are free vectors; leave it out or give spacecraft.wheels.as_points"
    )
    if any(model.truth.centre_of_mass_error_m) and not enters:
        raise ProblemError(told, where(("truth", "centre_of_mass_error_m")))
    for i, scheme in enumerate(model.scheme):
        allocation, place = scheme.allocation, ("scheme", i, "allocation")
        if not isinstance(allocation, RobustModel):
            continue
        if allocation.centre_of_mass_error_m is not None and not enters:
            raise ProblemError(told, where((*place, "centre_of_mass_error_m")))
        if allocation.centre_of_mass_error_m is None and allocation.wheel_effectiveness is None:
            choice = "wheel_effectiveness" + (" or centre_of_mass_error_m" if enters else "")
            raise ProblemError(f"robust against what? give {choice}", where(place))
        low, high = allocation.wheel_effectiveness or (1.0, 1.0)
        if low > high:
            message = f"the least share {low:g} exceeds the largest {high:g}; exchange them"
            raise ProblemError(message, where((*place, "wheel_effectiveness")))


def _faults(model: MissionFile, channel: str, count: int, where: Where) -> FaultSchedule:
    """Return the faults of one channel; the place of a message is the latest fault that it is about."""
    faults: list[ActuatorFault] = []
    for i, fault in enumerate(model.fault):
        if fault.channel != channel:
            continue
        try:
            until = math.inf if fault.until_s is None else fault.until_s
            bias = fault.bias_N_m + fault.bias_rad_per_s2  # one of them is zero
            made = ActuatorFault(
                fault.index, fault.effectiveness, bias, fault.from_s, until, fault.growth_per_s, group=channel
            )
            faults = list(FaultSchedule(count, (*faults, made)).faults)
        except FlightError as error:
            raise ProblemError(str(error), where(("fault", i))) from None
    return FaultSchedule(count, tuple(faults))


def _actuation(scheme: Scheme, craft: Spacecraft, known: WheelArray) -> Actuation:
    count, limit, most = known.count, scheme.torque_limit_N_m, craft.wheels.max_acceleration_rad_per_s2
    actuation = Actuation(
        effectiveness=known.effectiveness,
        lower=[-most] * count,
        upper=[most] * count,
        rate=math.inf,
        limit_below=[-value for value in limit],
        limit_above=limit,
        allocator=_allocator(scheme.allocation, craft, known),
    )
    fastest = craft.wheels.max_speed_rad_per_s
    if fastest is None:
        return actuation
    return dataclasses.replace(
        actuation,
        reach=lambda seen, period: reaction_wheels.acceleration_bounds(seen.wheel_speed, fastest, period, -most, most),
        judge=lambda seen, limited, actuators: {
            StepStatus.WHEEL_SATURATED: any_of(ca.fabs(seen.wheel_speed) >= (1 - 1e-6) * fastest)
        },
    )


def _allocator(model: Any, craft: Spacecraft, known: WheelArray) -> Any:
    if isinstance(model, PinvModel):
        return PseudoInverse()
    most, points, uncertainty = craft.wheels.max_acceleration_rad_per_s2, craft.wheels.as_points, {}
    if model.centre_of_mass_error_m is not None and points is not None:
        half = model.centre_of_mass_error_m
        uncertainty = {
            "coupling": np.full((1, known.count), craft.wheels.inertia_kg_m2),
            "errors": reaction_wheels.corner_shifts(points.matrix, [-value for value in half], half),
        }
    problem = AllocationProblem(
        np.array(known.effectiveness),
        lower=-most,
        upper=most,
        effort_weight=model.effort_weight,
        change_weight=model.change_weight,
        accuracy_weight=model.accuracy_weight,
        **uncertainty,
    )
    if model.wheel_effectiveness is not None:
        low, high = model.wheel_effectiveness
        problem = with_faults(problem, degraded=dict.fromkeys(range(1, known.count + 1), (low, high)))
    return OnlineInFlight(problem) if model.backend == "online" else SolverInFlight(problem, model.backend)
