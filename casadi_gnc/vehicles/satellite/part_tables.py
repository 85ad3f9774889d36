"""What a satellite carries, one table each: [[wheel]], [[thruster]], [[magnetorquer]], and what swings.

Positions and axes are in the body frame. Tables of one kind become one part of `casadi_gnc.mechanics`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, Any

import casadi as ca
from pydantic import Field, field_validator, model_validator

from casadi_gnc.mathematics import exact
from casadi_gnc.mathematics.exact import array
from casadi_gnc.mechanics import appendages
from casadi_gnc.mechanics import satellite_parts as parts
from casadi_gnc.mechanics.firing import FiringThrusters
from casadi_gnc.mechanics.hinged_panels import HingedPanels
from casadi_gnc.tables import matrices
from casadi_gnc.tables.part import MisfitError, NonNegative, Part, Positive, Vector

from .pulse_tables import PulseTable


class Axial(Part):
    """What has an axis in the body."""

    axis: Vector = Field(description="unit vector, body axes")

    _unit = field_validator("axis")(matrices.check_unit)


class WheelTable(Axial):
    """A reaction wheel; its command is its motor's torque, which turns the body the other way."""

    inertia_kg_m2: Positive | None = Field(
        default=None, description="J_s about the axis, or give max_momentum_N_m_s and max_speed_rad_per_s"
    )
    max_torque_N_m: Positive
    max_momentum_N_m_s: Positive | None = Field(default=None, description="no limit if left out")
    max_speed_rad_per_s: Positive | None = Field(default=None, description="instead of a momentum")
    viscous_N_m_s_per_rad: NonNegative = Field(default=0.0, description="friction per speed")
    coulomb_N_m: NonNegative = Field(
        default=0.0, description="friction of a turning wheel, f tanh(speed/coulomb_speed)"
    )
    coulomb_speed_rad_per_s: Positive = 1.0
    speed_rad_per_s: float = Field(default=0.0, description="at t = 0, relative to the body")

    @model_validator(mode="after")
    def _one_inertia(self) -> WheelTable:
        limits = [name for name in ("max_momentum_N_m_s", "max_speed_rad_per_s") if getattr(self, name) is not None]
        if self.inertia_kg_m2 is None and len(limits) < 2:
            raise ValueError("give inertia_kg_m2, or both max_momentum_N_m_s and max_speed_rad_per_s")
        if self.inertia_kg_m2 is not None and len(limits) == 2:
            raise ValueError("inertia_kg_m2, max_momentum_N_m_s and max_speed_rad_per_s are all given; keep two")
        if abs(self.speed_rad_per_s) > self.max_speed:
            raise MisfitError(
                f"{self.speed_rad_per_s:g} is beyond the wheel's largest speed, {self.max_speed:g}", "speed_rad_per_s"
            )
        return self

    @property
    def spin_inertia(self) -> Any:
        """J_s, [kg m^2]."""
        if self.inertia_kg_m2 is not None:
            return self.inertia_kg_m2
        assert self.max_momentum_N_m_s is not None  # as `_one_inertia` has it
        assert self.max_speed_rad_per_s is not None
        return self.max_momentum_N_m_s / self.max_speed_rad_per_s

    @property
    def max_speed(self) -> Any:
        """Largest speed, [rad/s]; infinite without a limit."""
        if self.max_speed_rad_per_s is not None:
            return self.max_speed_rad_per_s
        return math.inf if self.max_momentum_N_m_s is None else self.max_momentum_N_m_s / self.spin_inertia


class ThrusterTable(Part):
    """A thruster; its command is its force."""

    position_m: Vector
    direction: Vector = Field(description="of the force on the body, unit vector")
    max_force_N: Positive
    min_force_N: NonNegative = 0.0
    rise_time_s: NonNegative = Field(default=0.0, description="to 63 % of the force, and down to 37 %")
    specific_impulse_s: Positive | None = Field(default=None, description="propellant is counted by it")
    pulse: PulseTable | None = Field(default=None, description="the thruster knows on and off alone")

    _unit = field_validator("direction")(matrices.check_unit)

    @model_validator(mode="after")
    def _fit(self) -> ThrusterTable:
        if self.min_force_N > self.max_force_N:
            raise MisfitError(f"{self.min_force_N:g} exceeds max_force_N {self.max_force_N:g}", "min_force_N")
        if self.pulse is not None and not exact.is_zero(self.min_force_N):
            raise MisfitError("a thruster that makes pulses is off in between; leave min_force_N out", "min_force_N")
        return self

    @property
    def least_bit(self) -> Any:
        """Impulse of its shortest pulse, or least difference of two, [N s]; 0 where it makes no pulses."""
        return 0.0 if self.pulse is None else self.max_force_N * max(self.pulse.least_on_s, self.pulse.quantum_s)

    @property
    def fires(self) -> bool:
        """Whether its force is more than what it is told."""
        return self.pulse is not None or self.specific_impulse_s is not None or not exact.is_zero(self.rise_time_s)


class MagnetorquerTable(Axial):
    """A coil; its command is its dipole."""

    max_dipole_A_m2: Positive


class FlexibleModeTable(Part):
    """A bending mode of what is clamped to the body, its coordinate normalised by mass."""

    frequency_Hz: Positive = Field(description="of the appendage clamped; free it swings faster")
    damping: Annotated[float, Field(gt=0, lt=1, description="zeta, share of the critical one")]
    rotation_kg05_m: Vector = Field(description="angular momentum about the origin per speed of the mode")
    translation_kg05: Vector = Field(default=[0.0, 0.0, 0.0], description="momentum per speed of the mode")
    deflection_kg05_m: float = Field(default=0.0, description="at t = 0")


class SloshTable(Axial):
    """A mass of liquid that moves along an axis against a spring."""

    mass_kg: Positive = Field(description="beside the craft's mass_kg")
    position_m: Vector = Field(description="at rest")
    frequency_Hz: Positive = Field(description="of the mass on its spring, the body held")
    damping: Annotated[float, Field(ge=0, lt=1, description="zeta, share of the critical one")]
    offset_m: float = Field(default=0.0, description="from rest at t = 0")


class HingedPanelTable(Axial):
    """A rigid panel that a spring holds on a hinge along an axis."""

    mass_kg: Positive = Field(description="beside the craft's mass_kg")
    inertia_kg_m2: matrices.Inertia = Field(description="about its own centre of mass, body axes, at rest")
    hinge_m: Vector = Field(description="a point on the hinge")
    centre_m: Vector = Field(description="its centre of mass, at rest")
    stiffness_N_m_per_rad: Positive
    damping_N_m_s_per_rad: NonNegative = 0.0
    angle_deg: float = Field(default=0.0, description="from rest at t = 0, by the right hand about the axis")
    rate_deg_per_s: float = Field(default=0.0, description="at t = 0, relative to the body")

    @property
    def frequency_Hz(self) -> Any:
        """Frequency with the body held, [Hz]."""
        inertia = panels([self]).about_hinges()[0]
        return math.sqrt(float(self.stiffness_N_m_per_rad) / float(inertia)) / (2 * math.pi)


def columns(tables: Sequence[Any], key: str) -> Any:
    """Return a vector of each table as columns, (3, N)."""
    return array([list(getattr(table, key)) for table in tables]).T


def directions(tables: Sequence[Any], key: str) -> Any:
    """Return a unit vector of each table, of length one to rounding, as columns, (3, N)."""
    found = columns(tables, key)
    lengths = [exact.sqrt(_square(found[:, i])) for i in range(found.shape[1])]
    return ca.horzcat(*(found[:, i] / length for i, length in enumerate(lengths)))


def _square(column: Any) -> Any:
    square = sum(value * value for value in column.elements())
    return float(square) if exact.is_number(square) else square


def _of(tables: Sequence[Any], key: str) -> Any:
    return array([getattr(table, key) for table in tables])


def wheels(tables: Sequence[WheelTable]) -> parts.Wheels:
    """Return the wheels as one part."""
    keys = ("max_speed", "viscous_N_m_s_per_rad", "coulomb_N_m", "coulomb_speed_rad_per_s", "speed_rad_per_s")
    return parts.Wheels(directions(tables, "axis"), _of(tables, "spin_inertia"), *(_of(tables, key) for key in keys))


def thrusters(tables: Sequence[ThrusterTable]) -> parts.Thrusters:
    """Return the thrusters as one part."""
    positions, pushes = columns(tables, "position_m"), directions(tables, "direction")
    if not any(table.fires for table in tables):
        return parts.Thrusters(positions, pushes)
    return FiringThrusters(
        positions,
        pushes,
        _of(tables, "max_force_N"),
        _of(tables, "rise_time_s"),
        array([0.0 if table.specific_impulse_s is None else table.specific_impulse_s for table in tables]),
        tuple(table.pulse is not None for table in tables),
        array([0.0 if table.pulse is None else table.pulse.delay_s for table in tables]),
    )


def magnetorquers(tables: Sequence[MagnetorquerTable]) -> parts.Magnetorquers:
    """Return the magnetorquers as one part."""
    return parts.Magnetorquers(directions(tables, "axis"))


def modes(tables: Sequence[FlexibleModeTable]) -> appendages.FlexibleModes:
    """Return the modes as one part."""
    return appendages.FlexibleModes(
        array([2 * math.pi * table.frequency_Hz for table in tables]),
        _of(tables, "damping"),
        columns(tables, "rotation_kg05_m"),
        columns(tables, "translation_kg05"),
        _of(tables, "deflection_kg05_m"),
    )


def slosh(tables: Sequence[SloshTable]) -> appendages.SloshMasses:
    """Return the sloshing masses as one part."""
    turns = [2 * math.pi * table.frequency_Hz for table in tables]
    return appendages.SloshMasses(
        _of(tables, "mass_kg"),
        columns(tables, "position_m"),
        directions(tables, "axis"),
        array([table.mass_kg * turn * turn for table, turn in zip(tables, turns, strict=True)]),
        array([2 * table.damping * table.mass_kg * turn for table, turn in zip(tables, turns, strict=True)]),
        _of(tables, "offset_m"),
    )


def panels(tables: Sequence[HingedPanelTable]) -> HingedPanels:
    """Return the panels as one part."""
    hinges, degree = columns(tables, "hinge_m"), math.pi / 180
    return HingedPanels(
        _of(tables, "mass_kg"),
        [array(table.inertia_kg_m2) for table in tables],
        hinges,
        directions(tables, "axis"),
        columns(tables, "centre_m") - hinges,
        _of(tables, "stiffness_N_m_per_rad"),
        _of(tables, "damping_N_m_s_per_rad"),
        array([table.angle_deg * degree for table in tables]),
        array([table.rate_deg_per_s * degree for table in tables]),
    )


class MomentumTable(Part):
    """How wheels are kept in their range while they work."""

    unload_per_s: NonNegative = Field(default=0.0, description="rate at which coils take the wheels' momentum away")
    null_per_s: NonNegative = Field(
        default=0.0, description="rate at which wheels come to rest_speeds, turning nothing"
    )
    rest_speeds_rad_per_s: list[float] | None = Field(default=None, description="of each wheel; zero if left out")
