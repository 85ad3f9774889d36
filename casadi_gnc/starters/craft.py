"""StarterCraft: a rigid body on three torquers about its axes, with a rate sensor; change it into your own.

A craft of one's own is two classes: the truth (a Plant) and the craft (its keys in the file, what flies on board).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import casadi as ca
from pydantic import Field

import casadi_gnc as gnc
from casadi_gnc.mechanics import attitude
from casadi_gnc.mechanics.rigid_body import RigidBody
from casadi_gnc.tables.attitude import AttitudeStart
from casadi_gnc.tables.matrices import Inertia


@dataclass(frozen=True, eq=False)
class StarterPlant(gnc.Plant):
    """Turn a rigid body under torquers and a constant disturbance.

    Parameters
    ----------
    body : true inertia.
    disturbance : torque, (3,), [N m], body frame.
    """

    body: RigidBody
    disturbance: tuple[float, ...]

    # What the plant remembers: names are yours, units are SI, a kind tells the checks what a signal physically is.
    state = gnc.Layout((gnc.Signal("mrp", 3, "-", kind="mrp"), gnc.Signal("rate", 3, "rad/s", kind="rate")))
    # What the sensors give; beyond its limit a measurement is rejected on board.
    measurement = gnc.Layout(
        (gnc.Signal("mrp", 3, "-", limit=2.0, kind="mrp"), gnc.Signal("rate", 3, "rad/s", limit=5.0, kind="rate"))
    )
    # What the actuators are told.
    inputs = gnc.Layout((gnc.Signal("torquer", 3, "N m"),))

    def inertias(self) -> dict[str, Any]:
        """Return the true inertia, for the checks."""
        return {"true": self.body.inertia}

    def rate(self, t: Any, x: Any, actuators: Any, noise: Any) -> Any:
        """Return x', a column of `state`; CasADi operations only."""
        now = self.state.split(x)
        torque = actuators + ca.DM(list(self.disturbance))
        return self.state.pack(
            mrp=attitude.mrp_rate(now.mrp, now.rate), rate=self.body.acceleration(now.mrp, now.rate, torque)
        )

    def settle(self, x: Any) -> Any:
        """Return the same attitude by MRPs of at most half a turn, between steps."""
        now = self.state.split(x)
        return self.state.pack(mrp=attitude.short_way(now.mrp), rate=now.rate)


class StarterCraft(gnc.Craft):
    """A rigid body on three torquers."""

    # Fields are keys of [spacecraft]; one declared by gnc.table() is a table of its own, here [initial].
    inertia_kg_m2: Inertia = Field(description="about the centre of mass, body frame; what the laws believe too")
    inertia_factor: float = Field(default=1.0, gt=0, description="true inertia over the believed one")
    max_torque_N_m: float = Field(gt=0, description="of each torquer")
    disturbance_N_m: list[float] = Field(default=[0.0, 0.0, 0.0], min_length=3, max_length=3)
    initial: AttitudeStart = gnc.table()

    def plant(self) -> StarterPlant:
        """Return the truth."""
        return StarterPlant(RigidBody(self.inertia_factor * ca.DM(self.inertia_kg_m2)), tuple(self.disturbance_N_m))

    def start(self) -> dict[str, list[float]]:
        """Return the state at t = 0, by signal."""
        return self.initial.state()

    def belief(self) -> RigidBody:
        """Return what the flight software believes: laws with a field `body` receive it."""
        return RigidBody(ca.DM(self.inertia_kg_m2))

    def actuators(self) -> gnc.Actuators:
        """Return what the torquers make: effort = effectiveness x commands, within bounds."""
        most = [self.max_torque_N_m] * 3
        return gnc.Actuators(ca.DM.eye(3), [-value for value in most], most)

    def regulated(self, mission: gnc.Mission) -> dict[str, list[float]]:
        """Return the states that laws bring to a value, so that `check` can linearise there."""
        return {"mrp": [0.0] * 3, "rate": [0.0] * 3}

    def checks(self, mission: gnc.Mission, scheme: gnc.Scheme) -> Iterator[gnc.Check]:
        """Yield what only this craft can say before it flies."""
        yield gnc.Check(
            "starter.belief",
            abs(self.inertia_factor - 1),
            0.3,
            "-",
            "warn",
            "The true inertia is far from the believed one: gains may not fit.",
            "Measure the inertia, or lower the gains.",
            "a rule of thumb; put your own reason here",
        )
