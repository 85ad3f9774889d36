"""A solar sail that points at nadir: rigid hub, one bending mode, a gyro with bias, three reaction torquers.

A craft of one's own in one file: the truth, the craft as a table, and a law with an estimator inside.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import casadi as ca
from pydantic import Field

import casadi_gnc as gnc

INERTIA = [12.0, 10.0, 14.0]  # of the hub with the sail locked, principal axes, [kg m^2]


@dataclass(frozen=True, eq=False)
class Sail(gnc.Plant):
    """Turn the hub, bend the sail about x; small angles, the gyro's bias is a state that stays."""

    pressure_torque: float  # of the sun about y, [N m]
    frequency: float  # of the bending mode, [rad/s]
    coupling: float = 0.8  # of the mode with the turn about x, [kg^0.5 m]
    damping: float = 0.005

    state = gnc.Layout(
        (
            gnc.Signal("angle", 3, "rad"),
            gnc.Signal("rate", 3, "rad/s", kind="rate"),
            gnc.Signal("bending", 1, "kg^0.5 m"),
            gnc.Signal("bending_rate", 1, "kg^0.5 m/s"),
            gnc.Signal("gyro_bias", 3, "rad/s"),
        )
    )
    measurement = gnc.Layout((gnc.Signal("angle", 3, "rad", limit=1.0), gnc.Signal("gyro", 3, "rad/s", limit=0.5)))
    inputs = gnc.Layout((gnc.Signal("torque", 3, "N m"),))

    def inertias(self) -> dict[str, Any]:
        return {"true": ca.diag(ca.DM(INERTIA))}

    def measure(self, t: Any, x: Any, noise: Any) -> Any:
        now = self.state.split(x)
        return self.measurement.pack(angle=now.angle, gyro=now.rate + now.gyro_bias)

    def rate(self, t: Any, x: Any, actuators: Any, noise: Any) -> Any:
        now = self.state.split(x)
        torque = actuators + ca.vertcat(0, self.pressure_torque, 0)
        spring = self.frequency**2 * now.bending + 2 * self.damping * self.frequency * now.bending_rate
        # J w' + c q'' = u and q'' + c w' = -spring, about x.
        turned = (torque[0] + self.coupling * spring) / (INERTIA[0] - self.coupling**2)
        acceleration = ca.vertcat(turned, torque[1] / INERTIA[1], torque[2] / INERTIA[2])
        return self.state.pack(
            angle=now.rate,
            rate=acceleration,
            bending=now.bending_rate,
            bending_rate=-spring - self.coupling * acceleration[0],
            gyro_bias=ca.SX.zeros(3),
        )


class SailCraft(gnc.Craft):
    """A sail craft: what the hub carries, and where it begins."""

    area_m2: float = Field(default=32.0, gt=0, description="of the sail")
    mode_Hz: float = Field(default=0.05, gt=0, description="of the first bending mode")
    max_torque_N_m: float = Field(default=0.02, gt=0, description="of each torquer")
    angle_rad: list[float] = Field(default=[0.2, -0.1, 0.1], min_length=3, max_length=3, description="at t = 0")
    gyro_bias_rad_per_s: list[float] = Field(default=[1e-3, -5e-4, 2e-4], min_length=3, max_length=3)

    def plant(self) -> Sail:
        return Sail(pressure_torque=4.6e-6 * self.area_m2, frequency=2 * 3.14159 * self.mode_Hz)

    def start(self) -> dict[str, list[float]]:
        still = {"rate": [0.0] * 3, "bending": [0.0], "bending_rate": [0.0]}
        return {"angle": self.angle_rad, **still, "gyro_bias": self.gyro_bias_rad_per_s}

    def actuators(self) -> gnc.Actuators:
        most = [self.max_torque_N_m] * 3
        return gnc.Actuators(ca.DM.eye(3), [-value for value in most], most)

    def regulated(self, mission: gnc.Mission) -> dict[str, list[float]]:
        return {"angle": [0.0] * 3, "rate": [0.0] * 3}


@dataclass(frozen=True, eq=False)
class NadirPid(gnc.Law):
    """Turn the angles to zero; an observer on angle and gyro estimates the gyro's bias."""

    attitude_gain: Any = gnc.gain("N m/rad", "torque per angle", symbol="k_p", above=0.0)
    rate_gain: Any = gnc.gain("N m s/rad", "torque per rate", symbol="k_d", above=0.0)
    integral_gain: Any = gnc.gain("N m/(rad s)", "torque per integral", symbol="k_i", minimum=0.0, default=0.0)
    observer_pole: Any = gnc.gain("1/s", "of angle and bias estimate", symbol="p", above=0.0, default=0.05)

    effort: ClassVar = gnc.TORQUE
    inputs = gnc.Layout((gnc.Signal("angle", 3, "rad"), gnc.Signal("gyro", 3, "rad/s")))
    memory = gnc.Layout(
        (gnc.Signal("angle_estimate", 3, "rad"), gnc.Signal("bias", 3, "rad/s"), gnc.Signal("sum", 3, "rad s"))
    )
    outputs = gnc.Layout((gnc.Signal("bias_estimate", 3, "rad/s"),))

    def start(self, t: Any, y: Any) -> Any:
        return self.memory.pack(angle_estimate=self.inputs.split(y).angle, bias=ca.DM.zeros(3), sum=ca.DM.zeros(3))

    def command(self, t: Any, y: Any, m: Any) -> Any:
        now, memory = self.inputs.split(y), self.memory.split(m)
        rate = now.gyro - memory.bias
        return -self.attitude_gain * now.angle - self.rate_gain * rate - self.integral_gain * memory.sum

    def rate(self, t: Any, y: Any, m: Any, wanted: Any, achieved: Any) -> Any:
        now, memory, p = self.inputs.split(y), self.memory.split(m), self.observer_pole
        wrong = now.angle - memory.angle_estimate
        angle = now.gyro - memory.bias + 2 * p * wrong
        return self.memory.pack(angle_estimate=angle, bias=-(p**2) * wrong, sum=now.angle)

    def show(self, t: Any, y: Any, m: Any) -> dict[str, Any]:
        return {"bias_estimate": self.memory.split(m).bias}
