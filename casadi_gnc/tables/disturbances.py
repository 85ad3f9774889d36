"""What acts on a craft from outside: constant and harmonic torques and forces."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from casadi_gnc.mechanics.disturbances import Harmonics, OrbitalDisturbance
from casadi_gnc.tables.part import NonNegative, Part, Positive, Vector


class HarmonicTorque(Part):
    """One harmonic of the disturbance torque."""

    frequency_rad_per_s: Positive
    amplitude_N_m: Vector
    phase_rad: float = Field(default=0.0, description="at t = 0; pi/2 for a cosine")


class OrbitAndTorque(Part):
    """What acts from outside: gravity at the orbital rate, and torques."""

    orbit_rate_rad_per_s: NonNegative = 0.0
    corrected: list[Literal["orbit_frame_rate"]] = Field(
        default=[],
        description="errata of the truth that are corrected; orbit_frame_rate: the orbit frame, from which the "
        "attitude counts, turns. Left out, as the papers have it, it stands as at t = 0",
    )
    constant_torque_N_m: Vector = [0.0, 0.0, 0.0]
    harmonic: list[HarmonicTorque] = []

    @property
    def frame_rate(self) -> float:
        """Rate [rad/s] at which the frame of the attitude turns about its y axis."""
        return self.orbit_rate_rad_per_s if "orbit_frame_rate" in self.corrected else 0.0

    def disturbance(self) -> Harmonics:
        """Return the torque that acts besides gravity."""
        return Harmonics(
            tuple(self.constant_torque_N_m),
            tuple(harmonic.frequency_rad_per_s for harmonic in self.harmonic),
            tuple(tuple(harmonic.amplitude_N_m) for harmonic in self.harmonic),
            tuple(harmonic.phase_rad for harmonic in self.harmonic),
        )


class HarmonicForce(Part):
    """One harmonic of a force."""

    frequency_rad_per_s: Positive
    amplitude_N: Vector
    phase_rad: float = Field(default=0.0, description="at t = 0; pi/2 for a cosine")


class OuterForce(Part):
    """What acts on one craft from outside."""

    constant_N: Vector = [0.0, 0.0, 0.0]
    harmonic: list[HarmonicForce] = []

    def force(self) -> Harmonics:
        """Return the force as a function of time."""
        return Harmonics(
            tuple(self.constant_N),
            tuple(each.frequency_rad_per_s for each in self.harmonic),
            tuple(tuple(each.amplitude_N) for each in self.harmonic),
            tuple(each.phase_rad for each in self.harmonic),
        )


class Push(Part):
    """A disturbance of the craft, in its own frame."""

    force_N: Vector = [0.0, 0.0, 0.0]
    torque_N_m: Vector = [0.0, 0.0, 0.0]

    def column(self) -> tuple[float, ...]:
        """Return force and torque, (6,)."""
        return (*self.force_N, *self.torque_N_m)


class OrbitalPush(Part):
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
