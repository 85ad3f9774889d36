"""The [environment] of craft that are pushed at the orbital rate: shared tables, no craft of its own."""

from __future__ import annotations

from pydantic import Field

from casadi_gnc.mechanics.disturbances import OrbitalDisturbance
from casadi_gnc.problem_files.schema import NonNegative, Part, Vector


class Push(Part):
    """A disturbance of the craft, in its own frame."""

    force_N: Vector = [0.0, 0.0, 0.0]
    torque_N_m: Vector = [0.0, 0.0, 0.0]

    def column(self) -> tuple[float, ...]:
        """Return force and torque, (6,)."""
        return (*self.force_N, *self.torque_N_m)


class Environment(Part):
    """Disturbances: constant + sine sin(n t) + cosine cos(n t), n the orbital rate, and a random part."""

    constant: Push = Push()
    sine: Push = Push()
    cosine: Push = Push()
    random_force_N: NonNegative = Field(default=0.0, description="standard deviation of each axis")
    random_torque_N_m: NonNegative = Field(default=0.0, description="standard deviation of each axis")

    def disturbance(self) -> OrbitalDisturbance:
        """Return what the plant feels."""
        random = (self.random_force_N,) * 3 + (self.random_torque_N_m,) * 3
        return OrbitalDisturbance(self.constant.column(), self.sine.column(), self.cosine.column(), random)
