"""A satellite by tables: a rigid body in [spacecraft], and a table for each thing that it carries.

Tables of the file: [spacecraft]; [[wheel]], [[thruster]], [[magnetorquer]], [[flexible_mode]], [[slosh]],
[[hinged_panel]]; [orbit], [field], [environment], [[plate]], [air]; [[sensor]], [estimator]; [[reference]]; [truth],
[initial]. A class derived from this one adds parts of its own in `components`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, ClassVar

import casadi as ca
import numpy as np
from pydantic import Field, model_validator

from casadi_gnc.checks import Check
from casadi_gnc.errors import FlightError, LawError
from casadi_gnc.mathematics.exact import array
from casadi_gnc.mechanics import quaternions
from casadi_gnc.mechanics.earth import Epoch
from casadi_gnc.mechanics.multibody import Assembly, Component
from casadi_gnc.mechanics.reaction_wheels import TorqueGyrostat, WheelArray
from casadi_gnc.mechanics.rigid_body import RigidBody
from casadi_gnc.mechanics.sensor import Sensor
from casadi_gnc.missions.actuation import Actuation, Actuators
from casadi_gnc.missions.craft import Craft, EffortKeys
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.panel import Panel
from casadi_gnc.missions.parts import Parts
from casadi_gnc.missions.scene import Scene
from casadi_gnc.missions.scheme import Scheme
from casadi_gnc.missions.timing import Timing
from casadi_gnc.navigation import AttitudeNavigation, Estimator, Inertial, Reference
from casadi_gnc.signals import Layout
from casadi_gnc.tables import matrices
from casadi_gnc.tables.part import MOST_ACTUATORS, MisfitError, Part, Positive, Vector, all_of, table

from . import actuating, part_tables, showing, unfit_times
from .attitude_tables import InitialAttitude
from .estimator_tables import AnyEstimator
from .orbit_tables import Environment, FieldTable, OrbitTable
from .part_tables import (
    FlexibleModeTable,
    HingedPanelTable,
    MagnetorquerTable,
    MomentumTable,
    SloshTable,
    ThrusterTable,
    WheelTable,
)
from .plant import Satellite
from .plate_tables import AirTable, PlateTable
from .pulse_tables import ValveTable
from .reference_tables import AnyReference, InertialTable, timeline
from .sensor_tables import AnySensor, made
from .surroundings import SunDirection, Surroundings


class Truth(Part):
    """How the real craft differs from the known one."""

    inertia_factor: Positive = 1.0
    centre_of_mass_error_m: Vector = Field(default=[0.0, 0.0, 0.0], description="true minus known")


class SatelliteCraft(Craft):
    """A satellite of a rigid body and the parts that it carries; laws believe in it as known, liquids at rest."""

    example: ClassVar[str | None] = "satellites/slew"
    further_examples: ClassVar[tuple[str, ...]] = ("satellites/detumble_bdot",)

    mass_kg: Positive = Field(description="with wheels and appendages, without [[slosh]] and [[hinged_panel]]")
    inertia_kg_m2: matrices.Inertia = Field(
        description="of that mass about its centre, body axes, wheels locked, appendages clamped"
    )
    centre_of_mass_m: Vector = Field(default=[0.0, 0.0, 0.0], description="from the origin of positions")
    rate_limit_rad_per_s: Positive = Field(default=10.0, description="larger measured rates per axis are rejected")
    wheel: list[WheelTable] = table([], "a reaction wheel; there may be several")
    thruster: list[ThrusterTable] = table([], "a thruster; there may be several")
    valves: ValveTable | None = table(None)
    magnetorquer: list[MagnetorquerTable] = table([], "a coil; there may be several")
    flexible_mode: list[FlexibleModeTable] = table([], "a bending mode; there may be several")
    slosh: list[SloshTable] = table([], "a mass of liquid; there may be several")
    hinged_panel: list[HingedPanelTable] = table([], "a panel on a hinge; there may be several")
    momentum: MomentumTable = table(MomentumTable())
    orbit: OrbitTable | None = table(None)
    field: FieldTable | None = table(None)
    plate: list[PlateTable] = table([], "a side that air and sunlight push; there may be several")
    air: AirTable | None = table(None)
    environment: Environment = table(Environment())
    sensor: list[AnySensor] = table([], "a sensor; there may be several")
    estimator: AnyEstimator | None = table(None)
    reference: list[AnyReference] = table([], "where to point; there may be several, one after another")
    truth: Truth = table(Truth())
    initial: InitialAttitude = table(InitialAttitude())

    @model_validator(mode="after")
    def _complete(self) -> SatelliteCraft:
        count = len(self.wheel) + len(self.thruster) + len(self.magnetorquer)
        if not 0 < count <= MOST_ACTUATORS:
            told = f"there are {count} wheels, thrusters and magnetorquers"
            raise ValueError(f"{told}; give 1 to {MOST_ACTUATORS} [[wheel]], [[thruster]] or [[magnetorquer]]")
        all_of(
            self._surrounded,
            self._turning,
            self._valved,
            self.pointed,
            self._estimator,
            lambda: actuating.sharing(self),
        )
        return self

    def _surrounded(self) -> None:
        """Raise `ValueError` where something outside has nothing to act on, or does not know where and when."""
        if self.magnetorquer and self.field is None:
            raise ValueError('magnetorquers push against a magnetic field; give [field], e.g. model = "igrf"')
        if self.field is not None:
            self.magnetic_field()
        if (self.plate or self.air is not None) and self.orbit is None:
            raise MisfitError("air and sunlight need to know where the satellite is; give [orbit]", "plate")
        if self.air is not None and not self.plate:
            raise MisfitError("there is no [[plate]] for the air to push; give one for each side", "air")

    def _valved(self) -> None:
        """Raise `ValueError` where valves do not fit the thrusters."""
        if self.valves is not None:
            self.valves.check(self.thruster)
            self.actuators()

    def _when(self) -> Epoch | None:
        return None if self.orbit is None else self.orbit.when()

    def magnetic_field(self) -> Any:
        """Return the magnetic field; raise `MisfitError` where the orbit does not say where and when."""
        assert self.field is not None
        epoch = self._when()
        if epoch is None:
            raise MisfitError("needs to know where and when; give [orbit] with an epoch", "field")
        try:
            return self.field.field(epoch)
        except FlightError as error:
            raise MisfitError(str(error), "orbit", "epoch") from None

    def _turning(self) -> None:
        """Raise `ValueError` where wheels or modes have more inertia than the body that carries them."""
        smallest = np.linalg.eigvalsh(np.array(ca.DM(self._free_inertia())))[0]
        if not smallest > 0:
            raise ValueError(
                "wheels and modes have more inertia about some axis than the body with them; inertia_kg_m2 is that of "
                "the whole, and couplings of modes are in kg^0.5 m"
            )

    def components(self) -> Sequence[Component]:
        """Return the parts that the body carries, in the order of states and commands."""
        kinds: list[tuple[Any, Any]] = [
            (self.wheel, part_tables.wheels),
            (self.thruster, part_tables.thrusters),
            (self.magnetorquer, part_tables.magnetorquers),
            (self.flexible_mode, part_tables.modes),
            (self.slosh, part_tables.slosh),
            (self.hinged_panel, part_tables.panels),
        ]
        return [made(tables) for tables, made in kinds if tables]

    def assembly(self, inertia: Any = None, centre: Any = None) -> Assembly:
        """Return body and parts, with another inertia [kg m^2] and centre of mass [m] where they are given."""
        return Assembly(
            self.mass_kg,
            array(self.centre_of_mass_m if centre is None else centre),
            array(self.inertia_kg_m2) if inertia is None else inertia,
            tuple(self.components()),
        )

    def at_rest(self) -> tuple[Any, Any]:
        """Return inertia about the centre of mass and that centre as known, all that swings at rest."""
        known = self.assembly()
        rest = SimpleNamespace(**{each.name: ca.DM.zeros(each.size) for each in known.state.signals})
        return known.inertia(rest), known.centre(rest)

    def _free_inertia(self) -> Any:
        """Return J - sum J_s g g', and without what the modes take along: what a sudden torque turns of the body."""
        free, centre = array(self.inertia_kg_m2), array(self.centre_of_mass_m)
        for each in self.wheel:
            axis = part_tables.directions([each], "axis")
            free = free - each.spin_inertia * ca.mtimes(axis, axis.T)
        for mode in self.flexible_mode:
            turned = array(mode.rotation_kg05_m) - ca.cross(centre, array(mode.translation_kg05))
            free = free - ca.mtimes(turned, turned.T)
        return free

    def surroundings(self) -> Surroundings:
        """Return what is outside."""
        if self.orbit is None:
            return Surroundings()
        field = None if self.field is None else self.magnetic_field().at
        return Surroundings(
            self.orbit.gravity(),
            self.environment.gravity_gradient,
            field=field,
            sun=self._sun(),
            plates=tuple(each.plate() for each in self.plate),
            air=None if self.air is None else self.air.atmosphere(),
        )

    def _sun(self) -> SunDirection | None:
        epoch = self._when()
        return None if epoch is None else SunDirection(epoch)

    def pointed(self) -> Reference:
        """Return where the satellite should point."""
        return timeline(self.reference, self._when(), has_orbit=self.orbit is not None)

    def _sensors(self) -> tuple[Sensor, ...]:
        return made(self.sensor, len(self.wheel), has_field=self.field is not None, has_sun=self._when() is not None)

    def _estimator(self) -> Estimator | None:
        sensors = self._sensors()
        if self.estimator is None:
            return None
        field = None if self.field is None else self.magnetic_field()
        if field is not None and self.estimator.field_degree is not None:
            field = replace(field, degree=self.estimator.field_degree)
        try:
            return self.estimator.estimator(sensors, None if field is None else field.at, self._sun())
        except (LawError, ValueError) as error:
            raise MisfitError(str(error), "estimator") from None

    def plant(self) -> Satellite:
        """Return the truth."""
        centre = [c + e for c, e in zip(self.centre_of_mass_m, self.truth.centre_of_mass_error_m, strict=True)]
        return Satellite(
            self.assembly(array(self.inertia_kg_m2) * self.truth.inertia_factor, centre),
            self.surroundings(),
            self.environment.disturbance(),
            self.rate_limit_rad_per_s,
            self._sensors(),
            self.estimator is not None,
            self.pointed(),
        )

    def _place(self) -> dict[str, Any]:
        """Return position and velocity at t = 0, where there is an orbit."""
        known = self.orbit
        return {} if known is None else dict(zip(("position", "velocity"), known.elements().state(), strict=True))

    def start(self) -> dict[str, Any]:
        """Return the state at t = 0."""
        place = self._place()
        turned, rate = self.initial.quaternion(), self.initial.rate()
        if self.initial.relative_to == "reference":
            wanted = self.pointed().at(0.0, SimpleNamespace(**place))
            rate = rate + ca.mtimes(quaternions.dcm(turned), wanted.rate)
            turned = quaternions.compose(turned, wanted.quaternion)
        parts = {name: value for part in self.components() for name, value in part.start().items()}
        mrp = quaternions.to_mrp(turned)
        sensed = {name: value for sensor in self._sensors() for name, value in sensor.start().items()}
        first = {"mrp": mrp, "rate": rate, **parts, **place, **sensed}
        found = {name: array(value).elements() for name, value in first.items()}
        # Sensors that are late look at it as if it had been so before.
        latest = max((sensor.delay for sensor in self._sensors()), default=0)
        looked_at = {name for sensor in self._sensors() if sensor.delay for name in sensor.looks_at}
        return {**found, **{f"{name}_past": (latest + 1) * found[name] for name in looked_at}}

    def belief(self) -> RigidBody:
        """Return the body as known, with its wheels."""
        inertia, _ = self.at_rest()
        if not self.wheel:
            return RigidBody(inertia)
        wheels = part_tables.wheels(self.wheel)
        spin = array(wheels.spin_inertia)
        own = ca.mtimes([wheels.axes, ca.diag(spin), wheels.axes.T])
        return TorqueGyrostat(inertia - own, wheels=WheelArray(wheels.axes, spin))

    def navigation(self) -> AttitudeNavigation:
        """Return what laws read: attitude relative to the reference, and what else is measured."""
        measured, estimator = self.plant().measurement, self._estimator()
        # What the filter alone reads, laws need not see.
        own = set() if estimator is None else set(estimator.inputs.names) - {"magnetic_field", "position"}
        passed = tuple(signal for signal in measured.signals if signal.name not in {"mrp", "rate", *own})
        return AttitudeNavigation(estimator=estimator, reference=self.pointed(), passed=Layout(passed))

    def actuators(self) -> Actuators:
        """Return wheels, thrusters and coils as known."""
        # Without thrusters the centre of mass does not matter, and neither do the tables that it follows from.
        return actuating.actuators(self, self.at_rest()[1] if self.thruster else ca.DM.zeros(3))

    def actuation(self, keys: Part | None = None) -> Actuation:
        """Return the actuation of a scheme; [momentum] takes the place of its allocation."""
        return actuating.actuation(self, self.actuators(), keys if isinstance(keys, EffortKeys) else EffortKeys())

    def mass_centre_key(self) -> str:
        """Return the key of the error of the centre of mass."""
        return "truth.centre_of_mass_error_m"

    def flaws(self) -> Iterator[MisfitError]:
        """Yield whether wheels and thrusters leave an axis out."""
        return actuating.flaws(self, self.actuators())

    def untimely(self, timing: Timing, *, strict: bool) -> Iterator[MisfitError]:
        """Yield what does not fit the times of a flight: sensors, and if strict modes, liquids and tables."""
        return unfit_times.misfits(self, self._sensors(), timing, strict=strict)

    def regulated(self, mission: Mission) -> dict[str, list[float]]:
        """Return the attitude of a reference that stays, and rest; of one that moves, nothing."""
        pointed = self.pointed()
        if not self.wheel and not self.thruster:
            return {}  # coils alone hold no attitude at any one time
        if type(pointed) not in (Reference, Inertial):
            return {}
        still = array(pointed.at(0.0, None).quaternion)
        return {"mrp": quaternions.to_mrp(still).elements(), "rate": [0.0] * 3}

    def swinging(self, mission: Mission) -> dict[str, list[float]]:
        """Return the coordinates inside the parts and their speeds, at rest where springs have no force."""
        moving = [pair for part in self.components() for pair in part.moving.items() if pair[1] is not None]
        names = [name for speed, place in moving for name in (str(place), speed)]
        return {name: [0.0] * mission.truth.state.signal(name).size for name in names}

    def held(self, mission: Mission) -> Mission | None:
        """Return the mission with the attitude that is wanted at t = 0 for good, where the reference moves."""
        if type(self.pointed()) in (Reference, Inertial):
            return None
        first = array(self.pointed().at(0.0, SimpleNamespace(**self._place())).quaternion)
        still = self.model_copy(
            update={"reference": [InertialTable(kind="inertial", quaternion_scalar_first=ca.DM(first).elements())]}
        )
        parts = Parts(still)
        schemes = [replace(one, navigation=parts.navigation if one.navigation else None) for one in mission.schemes]
        return replace(mission, craft=still, schemes=schemes, parts=parts)

    def panels(self, mission: Mission) -> tuple[Panel, ...]:
        """Return pointing, rate, torque, and what makes it."""
        return showing.panels(self, mission)

    def scene(self, mission: Mission) -> Scene:
        """Return the body with its wheels and thrusters, the way down, to the sun and along the field."""
        return showing.scene(self, mission)

    def checks(self, mission: Mission, scheme: Scheme) -> Iterator[Check]:
        """Yield what can be said of a satellite before it flies."""
        from .checks import checks

        return checks(self, mission, scheme)

    def key_of(self, signal: str) -> tuple[str, ...]:
        """Return the key of the file that gives a state at the start."""
        return {"rate": ("initial", "rate_rad_per_s"), "wheel_speed": ("wheel",)}.get(signal, ("initial",))
