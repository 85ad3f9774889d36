"""A block of 1 kg on ice, braked: speed' = push + wind, linear in truth."""

from dataclasses import dataclass
from typing import Any, ClassVar

import casadi as ca
from pydantic import Field

import casadi_gnc as gnc

PUSH = gnc.Layout((gnc.Signal("push", 3, "N"),))


@dataclass(frozen=True, eq=False)
class Block(gnc.Plant):
    wind: Any
    kink: Any
    state = gnc.Layout((gnc.Signal("speed", 3, "m/s"),))
    measurement = gnc.Layout((gnc.Signal("speed", 3, "m/s"),))
    inputs = gnc.Layout((gnc.Signal("force_of_push", 3, "N"),))

    def measure(self, t, x, noise):
        return x

    def rate(self, t, x, actuators, noise):
        friction = self.kink * ca.sign(self.wind * x[0])
        return actuators + ca.vertcat(self.wind - friction, 0, 0)


class BlockCraft(gnc.Craft):
    wind_N: float = Field(default=0.0, description="on the block")
    kink_N: float = Field(default=0.0, description="of a friction that jumps")
    speed_m_per_s: float = Field(default=1.0, description="at t = 0")

    def plant(self):
        return Block(self.wind_N, self.kink_N)

    def start(self):
        return {"speed": [self.speed_m_per_s, 0.0, 0.0]}

    def actuators(self):
        return gnc.Actuators(ca.DM.eye(3), [-100.0] * 3, [100.0] * 3, effort=PUSH)

    def claimed(self, mission, scheme, by):
        own = scheme.law.covers() if by == "theorem" else {}
        return {f"spacecraft.{name}_N": ends for name, ends in own.items()}

    def regulated(self, mission):
        return {"speed": [0.0] * 3}


@dataclass(frozen=True, eq=False)
class Brake(gnc.Law):
    brake_gain: Any = gnc.gain("N s/m", "push per speed", symbol="k", above=0.0)
    effort: ClassVar = PUSH
    inputs = gnc.Layout((gnc.Signal("speed", 3, "m/s"),))

    def covers(self):
        return {"wind": (-0.5, 0.5)}

    def command(self, t, y, m):
        return -self.brake_gain * y
