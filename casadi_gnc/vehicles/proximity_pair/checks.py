"""What can be said of a chaser and its target only, before they fly."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import casadi as ca

from casadi_gnc.checking import numbers
from casadi_gnc.checks import Check
from casadi_gnc.laws import ProximityTracking
from casadi_gnc.laws.proximity_conditions import coupling_condition
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.rehearsing import rehearsal
from casadi_gnc.missions.scheme import Scheme

if TYPE_CHECKING:
    from .craft import ProximityPairCraft


def checks(craft: ProximityPairCraft, mission: Mission, scheme: Scheme) -> Iterator[Check]:
    """Yield the orbit, the theorem's condition that involves the target, and how near the chaser comes, simulated."""
    plant = craft.plant()
    yield from numbers.orbit(*craft.orbit_shape(mission.start), craft.orbit.body_radius_m)
    if isinstance(scheme.law, ProximityTracking):
        rate = plant.target(ca.DM(mission.start)).rate
        yield coupling_condition(scheme.law, plant.motion, plant.target_inertia, rate)
    if plant.keep_out_radius:
        flown = rehearsal(mission, scheme)
        record = flown.record()
        yield Check(
            "proximity.keep_out",
            float("nan") if record is None else float(record[:, flown.row.place("target_distance")].min()),
            plant.keep_out_radius,
            "m",
            "fail",
            "On its way to the point the chaser enters the keep-out sphere: the law knows nothing of it.",
            "Start from the side of the point, or lead the chaser there by way points.",
            "the path that the law and the limits of the mission give, simulated",
            at_least=True,
        )
