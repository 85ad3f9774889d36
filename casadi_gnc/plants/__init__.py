"""Plants: the truth that a controller flies, as pure functions of CasADi symbols."""

from casadi_gnc.plants._plant import Plant
from casadi_gnc.plants.combined_spacecraft import BodyPart, CombinedSpacecraft, compose_inertia
from casadi_gnc.plants.drag_free_pair import DragFreePair
from casadi_gnc.plants.environment import HarmonicTorque

__all__ = ["BodyPart", "CombinedSpacecraft", "DragFreePair", "HarmonicTorque", "Plant", "compose_inertia"]
