"""Plants: the truth that a controller flies, as pure functions of CasADi symbols."""

from casadi_gnc.plants.combined_spacecraft import BodyPart, CombinedSpacecraft, compose_inertia
from casadi_gnc.plants.environment import HarmonicTorque

__all__ = ["BodyPart", "CombinedSpacecraft", "HarmonicTorque", "compose_inertia"]
