"""What can be said of a spacecraft on wheels only, before it flies."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from casadi_gnc.checking import geometry, wheels
from casadi_gnc.checks import Check
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.scheme import Scheme

from .tables import RobustWheels, SchemeKeys

if TYPE_CHECKING:
    from .craft import WheelSpacecraftCraft


def checks(craft: WheelSpacecraftCraft, mission: Mission, scheme: Scheme) -> Iterator[Check]:
    """Yield the frames of attitude and wheels, the wheels' speed, and whether one weight bears errors and faults."""
    yield from geometry.orbit_frame(craft.environment, mission)
    points = craft.wheels.as_points
    if points is not None:
        yield geometry.rotation(
            "geometry.configuration",
            points.matrix,
            "The matrix that turns the wheels' axes is no rotation: lengths and angles between axes come out wrong.",
            "Correct the matrix, or give the craft's orientation in the place of as_points.",
        )
    yield from wheels.wheel_speed(mission, scheme, craft.wheels.max_speed)
    allocator = scheme.actuation.allocator
    told = scheme.keys.allocation if isinstance(scheme.keys, SchemeKeys) else None
    half = told.centre_of_mass_error_m if isinstance(told, RobustWheels) else None
    if half is None or not any(fault.channel == "wheel" for fault in craft.fault):
        return

    def with_weight(weight: float) -> Any:
        return dataclasses.replace(allocator, problem=dataclasses.replace(allocator.problem, accuracy_weight=weight))

    corners = []
    for corner in itertools.product(*((-one, one) for one in half)):
        truth = craft.truth.model_copy(update={"centre_of_mass_error_m": list(corner)})
        corners.append(mission.with_craft(craft.model_copy(update={"truth": truth})))
    yield wheels.weight_window(mission, scheme, with_weight, corners)
