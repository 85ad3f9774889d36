"""Plants: the truth that a controller flies, as pure functions of CasADi symbols."""

from casadi_gnc.plants._plant import Plant
from casadi_gnc.plants.combined_spacecraft import BodyPart, CombinedSpacecraft, compose_inertia
from casadi_gnc.plants.docking_pair import DockingPair, FaultPiece, FaultProfile, MeasurementNoise
from casadi_gnc.plants.drag_free_pair import DragFreePair
from casadi_gnc.plants.environment import Harmonics
from casadi_gnc.plants.proximity_pair import OrbitalDisturbance, ProximityPair, RelativeSensor
from casadi_gnc.plants.wheel_spacecraft import SensorError, WheelSpacecraft

__all__ = [
    "BodyPart",
    "CombinedSpacecraft",
    "DockingPair",
    "DragFreePair",
    "FaultPiece",
    "FaultProfile",
    "Harmonics",
    "MeasurementNoise",
    "OrbitalDisturbance",
    "Plant",
    "ProximityPair",
    "RelativeSensor",
    "SensorError",
    "WheelSpacecraft",
    "compose_inertia",
]
