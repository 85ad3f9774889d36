"""Fly a mission's craft with another plant than its own."""

from collections.abc import Sequence
from dataclasses import replace

from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.plant import Plant
from casadi_gnc.missions.scheme import Scheme


def with_plant(mission: Mission, plant: Plant, schemes: Sequence[Scheme] | None = None) -> Mission:
    """Return the mission of a craft that is the same but for what truly moves, and other schemes if they are given."""
    kind = type(mission.craft)
    other = type("Other", (kind,), {"plant": lambda self: plant})
    made = other.model_construct(**dict(mission.craft))
    return replace(mission, craft=made, schemes=schemes or mission.schemes)
