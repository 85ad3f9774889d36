"""A spacecraft on reaction wheels, with faults of its actuators and errors of its sensors.

Tables of the file: [spacecraft] with wheels, [truth], [sensors], [[fault]], [environment], [initial].
Source: Huang and Duan (2019), doi:10.1109/ACCESS.2019.2949285.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, ClassVar, Literal, cast

import casadi as ca
import numpy as np
from pydantic import Field, model_validator

from casadi_gnc.allocation import AllocationProblem
from casadi_gnc.allocation.faults import with_faults
from casadi_gnc.checks import Check
from casadi_gnc.errors import FlightError
from casadi_gnc.mathematics.exact import array
from casadi_gnc.mechanics import reaction_wheels
from casadi_gnc.mechanics.actuator_faults import FaultSchedule
from casadi_gnc.mechanics.reaction_wheels import Gyrostat, WheelArray
from casadi_gnc.missions.actuation import Actuation, Actuators
from casadi_gnc.missions.craft import Craft
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.panel import Panel
from casadi_gnc.missions.scene import Arrow, Scene, Spinners
from casadi_gnc.missions.scheme import Scheme
from casadi_gnc.tables import matrices
from casadi_gnc.tables.allocation import mass_centre
from casadi_gnc.tables.attitude import AttitudeStart
from casadi_gnc.tables.disturbances import OrbitAndTorque
from casadi_gnc.tables.orientation import Orientation
from casadi_gnc.tables.part import MisfitError, Part, Positive, table

from .limits import SpeedLimit
from .plant import SensorError, WheelSpacecraft
from .tables import Fault, MountedWheels, RobustWheels, SchemeKeys, Sensors, Truth

#: Shown with every flight whose wheel axes are taken for points.
AXES_AS_POINTS = (
    "Wheel axes are taken for points, C = R (Cbar - r_c 1'), as the paper has them; those of real wheels are free "
    "vectors, C = R Cbar."
)
_NOWHERE = [0.0, 0.0, 0.0]


class WheelSpacecraftCraft(Craft, Orientation):
    """A craft on reaction wheels as known, which is what the laws believe; its orientation turns the wheels' axes."""

    scheme_keys: ClassVar[type[Part]] = SchemeKeys
    example: ClassVar[str | None] = "huang2019/nominal"

    inertia_kg_m2: matrices.Inertia = Field(description="about the centre of mass, wheels locked, body frame")
    rate_limit_rad_per_s: Positive = Field(default=10.0, description="larger measured rates per axis are rejected")
    wheels: MountedWheels
    truth: Truth = table(Truth())
    sensors: Sensors = table(Sensors())
    fault: list[Fault] = table([])
    environment: OrbitAndTorque = table(OrbitAndTorque())
    initial: AttitudeStart = table()

    @model_validator(mode="after")
    def _one_configuration(self) -> WheelSpacecraftCraft:
        if self.wheels.as_points is not None and self.turned() is not None:
            raise ValueError("wheels.as_points has a matrix of its own; leave the rotation out")
        if self.wheels.as_points is None and any(self.truth.centre_of_mass_error_m):
            raise MisfitError(_NO_MASS_CENTRE, "truth", "centre_of_mass_error_m")
        for channel, count in (("axis", 3), ("wheel", len(self.wheels.axes))):
            self._faults(channel, count)
        return self

    def _array(self, error: list[float]) -> WheelArray:
        """Return the wheels where the centre of mass is off by `error` [m]."""
        axes = self.wheels.turned(self.matrix(), error)
        return WheelArray(axes, self.wheels.inertia_kg_m2, self.wheels.max_acceleration, self.wheels.max_speed)

    def _faults(self, channel: str, count: int) -> FaultSchedule:
        """Return the faults of one channel; a `MisfitError` is about the latest fault that it concerns."""
        schedule = FaultSchedule(count)
        for i, fault in enumerate(self.fault):
            if fault.channel == channel:
                try:
                    schedule = FaultSchedule(count, (*schedule.faults, fault.actuator_fault()))
                except FlightError as error:
                    raise MisfitError(str(error), "fault", i) from None
        return schedule

    def plant(self) -> WheelSpacecraft:
        """Return the truth."""
        truth, sensors, rate = self.truth, self.sensors, self.environment.orbit_rate_rad_per_s
        inertia = array(truth.inertia_kg_m2 or self.inertia_kg_m2)
        return WheelSpacecraft(
            Gyrostat(inertia, orbit_rate=rate, wheels=self._array(truth.centre_of_mass_error_m)),
            self.environment.disturbance(),
            axis_faults=self._faults("axis", 3),
            wheel_faults=self._faults("wheel", len(self.wheels.axes)),
            attitude_error=SensorError(sensors.mrp_deviation, sensors.mrp_factor_deviation),
            rate_error=SensorError(sensors.rate_deviation_rad_per_s, sensors.rate_factor_deviation),
            rate_limit=self.rate_limit_rad_per_s,
            frame_rate=self.environment.frame_rate,
        )

    def start(self) -> dict[str, list[float]]:
        """Return attitude and rate at t = 0; the wheels stand."""
        return {**self.initial.state(), "wheel_speed": [0.0] * len(self.wheels.axes)}

    def belief(self) -> Gyrostat:
        """Return the craft as known, with its wheels."""
        rate = self.environment.orbit_rate_rad_per_s
        return Gyrostat(array(self.inertia_kg_m2), orbit_rate=rate, wheels=self._array(_NOWHERE))

    def actuators(self) -> Actuators:
        """Return the wheels as known."""
        known, most = self._array(_NOWHERE), self.wheels.max_acceleration
        limit = None if math.isinf(known.max_speed) else SpeedLimit(known.max_speed, most)
        return Actuators(
            effectiveness=known.effectiveness,
            lower=[-most] * known.count,
            upper=[most] * known.count,
            reach=None if limit is None else limit.reach,
            judge=None if limit is None else limit.judge,
        )

    def actuation(self, keys: Part | None = None) -> Actuation:
        """Return the actuation of a scheme."""
        told = cast(SchemeKeys, keys)
        return Actuation.of(self.actuators(), told.torque_limit_N_m, told.allocation.allocator(self._problem(told)))

    def _problem(self, told: SchemeKeys) -> AllocationProblem | None:
        """Return the problem of a robust allocation, none of another; refuse one against nothing."""
        robust, points, known = told.allocation, self.wheels.as_points, self._array(_NOWHERE)
        if not isinstance(robust, RobustWheels):
            return None
        half, shares = robust.centre_of_mass_error_m, robust.wheel_effectiveness
        if half is not None and points is None:
            raise MisfitError(_NO_MASS_CENTRE, "allocation", "centre_of_mass_error_m")
        if half is None and shares is None:
            choice = "wheel_effectiveness" + (" or centre_of_mass_error_m" if points is not None else "")
            raise MisfitError(f"robust against what? give {choice}", "allocation")
        if shares is not None and shares[0] > shares[1]:
            message = f"the least share {shares[0]:g} exceeds the largest {shares[1]:g}; exchange them"
            raise MisfitError(message, "allocation", "wheel_effectiveness")
        uncertainty: dict[str, Any] = {}
        if half is not None and points is not None:
            uncertainty["coupling"] = np.full((1, known.count), self.wheels.inertia_kg_m2)
            uncertainty["errors"] = reaction_wheels.corner_shifts(points.matrix, [-value for value in half], half)
        most = self.wheels.max_acceleration
        effectiveness = np.array(known.effectiveness)
        problem = AllocationProblem(effectiveness, lower=-most, upper=most, **robust.weights(), **uncertainty)
        if shares is None:
            return problem
        return with_faults(problem, degraded=dict.fromkeys(range(1, known.count + 1), (shares[0], shares[1])))

    def regulated(self, mission: Mission) -> dict[str, list[float]]:
        """Return attitude and rate at zero."""
        return {"mrp": [0.0] * 3, "rate": [0.0] * 3}

    def panels(self, mission: Mission) -> tuple[Panel, ...]:
        """Return attitude, torque, wheels."""
        return (
            Panel("tracked", "mrp", "attitude MRP"),
            Panel("effort", "torque", "torque"),
            Panel("actuators", "wheel_acceleration", "wheel acc."),
            Panel("lines", "wheel_speed", "wheel speed"),
        )

    def scene(self, mission: Mission) -> Scene:
        """Return the body with its wheels along their axes."""
        return Scene(
            attitude="mrp",
            reference="orbit frame",
            spinners=Spinners("wheel_speed", np.array(self._array(_NOWHERE).axes).T.tolist()),
            arrows=(Arrow("rate", "rate"), Arrow("true_torque", "torque of the wheels")),
        )

    def checks(self, mission: Mission, scheme: Scheme) -> Iterator[Check]:
        """Yield what can be said of a craft on wheels only."""
        from .checks import checks

        return checks(self, mission, scheme)

    def mass_centre_key(self) -> str:
        """Return the key of the error of the centre of mass."""
        return "" if self.wheels.as_points is None else "truth.centre_of_mass_error_m"

    def true_effectivenesses(self, mission: Mission, scheme: Scheme) -> dict[str, np.ndarray]:
        """Return the true effectiveness without faults, and with each set of faults that come together."""
        real = np.array(ca.DM(self._array(self.truth.centre_of_mass_error_m).effectiveness))
        found = {"the true wheels": real}
        for onset in sorted({fault.from_s for fault in self.fault}):
            e, present = real.copy(), [fault for fault in self.fault if fault.present(onset)]
            for fault in present:
                if fault.channel == "wheel":
                    e[:, fault.index - 1] *= fault.effectiveness
                else:
                    e[fault.index - 1] *= fault.effectiveness
            weak = [fault for fault in present if fault.effectiveness != 1]
            told = ", ".join(f"{fault.channel} {fault.index} at {fault.effectiveness:g}" for fault in weak) or "biases"
            found[f"the faults from {onset:g} s on ({told})"] = e
        return found

    def claimed(
        self, mission: Mission, scheme: Scheme, by: Literal["allocation", "theorem"]
    ) -> dict[str, tuple[float, float]]:
        """Return the errors of the centre of mass and the shares of wheels that a robust allocation is set up for.

        Raises
        ------
        FlightError
            For a wheel without a fault, through which alone its share may come true.
        """
        told = cast(SchemeKeys, scheme.keys).allocation
        if by == "theorem" or not isinstance(told, RobustWheels):
            return {}
        found, shares = mass_centre(told.centre_of_mass_error_m or []), told.wheel_effectiveness
        if shares is None or not shares[0] < shares[1]:
            return found
        faults = {i: fault.index for i, fault in enumerate(self.fault, 1) if fault.channel == "wheel"}
        lacking = sorted({*range(1, len(self.wheels.axes) + 1)} - {*faults.values()})
        if lacking:
            raise FlightError(
                f"the allocation is set up for wheels of {shares[0]:g} to {shares[1]:g} of their command, and wheel "
                f"{', '.join(map(str, lacking))} has no fault by which that comes true; give each a [[fault]] with "
                'channel = "wheel" and effectiveness = 1.0'
            )
        return {**found, **{f"fault.{i}.effectiveness": (shares[0], shares[1]) for i in faults}}

    def flaws(self) -> Iterator[MisfitError]:
        """Yield whether the wheels leave an axis out."""
        strength = np.linalg.svd(np.array(self._array(_NOWHERE).axes), compute_uv=False)
        if len(strength) < 3 or strength[2] < 1e-9 * strength[0]:
            yield MisfitError(
                "the wheels make no torque about some axis; add or turn one", "spacecraft", "wheels", "axes"
            )

    def notes(self) -> tuple[str, ...]:
        """Return the caution about axes as points."""
        return () if self.wheels.as_points is None else (AXES_AS_POINTS,)

    def key_of(self, signal: str) -> tuple[str, ...]:
        """Return the key of [initial]."""
        return ("initial", {"mrp": "mrp", "rate": "rate_rad_per_s"}.get(signal, ""))


_NO_MASS_CENTRE = (
    "no centre of mass moves wheel axes, which are free vectors; leave it out or give spacecraft.wheels.as_points"
)
