"""Fly a mission's craft with another plant than its own."""

from dataclasses import replace

from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.plant import Plant


def with_plant(mission: Mission, plant: Plant) -> Mission:
    """Return the mission of a craft that is the same but for what truly moves."""
    kind = type(mission.craft)
    other = type("Other", (kind,), {"plant": lambda self: plant})
    return replace(mission, craft=other.model_construct(**dict(mission.craft)), origin=None)
