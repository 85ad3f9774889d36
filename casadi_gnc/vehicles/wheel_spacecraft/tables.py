"""Tables of a file that only the spacecraft on wheels has."""

from __future__ import annotations

import math
from typing import Annotated, Literal

import casadi as ca
from pydantic import Field, model_validator

from casadi_gnc.mathematics.exact import array
from casadi_gnc.mechanics import reaction_wheels
from casadi_gnc.mechanics.actuator_faults import ActuatorFault
from casadi_gnc.tables import matrices
from casadi_gnc.tables.allocation import Pinv, Robust
from casadi_gnc.tables.part import Matrix, NonNegative, Part, Positive, Vector
from casadi_gnc.tables.wheels import Wheels


class AxesAsPoints(Part):
    """The paper's configuration matrix C = R (Cbar - r_c 1') instead of C = R Cbar (eqs 4 to 7)."""

    matrix: Matrix = Field(description="R, used as it is: the printed one is no rotation")
    centre_of_mass_m: Vector = Field(description="r_c, in the frame in which the axes are given")


class MountedWheels(Wheels):
    """The wheels, in the frame of the craft that carries them."""

    as_points: AxesAsPoints | None = None

    def turned(self, rotation: ca.DM, error: list[float]) -> ca.DM:
        """Return C, (3, N), where the centre of mass is off by `error` [m]; of axes as points it matters."""
        mounted, points = array(self.axes).T, self.as_points
        if points is None:
            return reaction_wheels.free_axes(rotation, mounted)
        centre = [c + e for c, e in zip(points.centre_of_mass_m, error, strict=True)]
        return reaction_wheels.axes_as_points(points.matrix, mounted, centre)


class Truth(Part):
    """How the real craft differs from the known one."""

    inertia_kg_m2: matrices.Inertia | None = None
    centre_of_mass_error_m: Vector = Field(default=[0.0, 0.0, 0.0], description="true minus known, of axes as points")


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
        of_axis = self.channel == "axis"
        wrong, right = ("bias_rad_per_s2", "bias_N_m") if of_axis else ("bias_N_m", "bias_rad_per_s2")
        if self.bias_rad_per_s2 if of_axis else self.bias_N_m:
            raise ValueError(f'the bias of a fault of channel "{self.channel}" is {right}, not {wrong}')
        return self

    def actuator_fault(self) -> ActuatorFault:
        """Return the fault of an axis [N m] or of a wheel [rad/s^2]."""
        until = math.inf if self.until_s is None else self.until_s
        bias = self.bias_N_m + self.bias_rad_per_s2  # one of them is zero
        growth, group = self.growth_per_s, self.channel
        return ActuatorFault(self.index, self.effectiveness, bias, self.from_s, until, growth, group=group)

    def present(self, t: float) -> bool:
        """Return whether the fault has come and not gone at a time [s]."""
        return self.from_s <= t and (self.until_s is None or self.until_s > t)


class RobustWheels(Robust):
    """Robust min-max allocation against errors of the centre of mass (axes as points) or weak wheels."""

    centre_of_mass_error_m: Annotated[list[NonNegative], Field(min_length=3, max_length=3)] | None = Field(
        default=None, description="half width of the box of errors; of axes as points only"
    )
    wheel_effectiveness: Annotated[list[NonNegative], Field(min_length=2, max_length=2)] | None = Field(
        default=None, description="least and largest share of its command that each wheel may make"
    )
    accuracy_weight: Positive = Field(default=1e4, description="h, weight of the squared torque error")
    change_weight: NonNegative = Field(default=0.0, description="diagonal of M2")


class SchemeKeys(Part):
    """How far a law may ask, and how its torque is allocated."""

    torque_limit_N_m: Annotated[list[Positive], Field(min_length=3, max_length=3)]
    allocation: Annotated[Pinv | RobustWheels, Field(discriminator="method")]
