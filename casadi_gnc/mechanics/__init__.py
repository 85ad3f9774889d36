"""Bodies and what moves and measures them: attitude, rigid bodies, actuators, orbits, fields, sensors, faults."""

from casadi_gnc.mechanics import attitude, dipoles, earth, geomagnetic, orbits, plates, quaternions, sensors
from casadi_gnc.mechanics.actuator_faults import ActuatorFault, FaultSchedule
from casadi_gnc.mechanics.circular_orbit import CircularOrbit
from casadi_gnc.mechanics.disturbances import Harmonics, OrbitalDisturbance
from casadi_gnc.mechanics.proximity_motion import ProximityMotion
from casadi_gnc.mechanics.reaction_wheels import Gyrostat, WheelArray
from casadi_gnc.mechanics.relative_motion import EllipticOrbit, PairModel
from casadi_gnc.mechanics.rigid_body import RigidBody, inverse3
from casadi_gnc.mechanics.thrusters import ThrusterGeometry

__all__ = [
    "ActuatorFault",
    "CircularOrbit",
    "EllipticOrbit",
    "FaultSchedule",
    "Gyrostat",
    "Harmonics",
    "OrbitalDisturbance",
    "PairModel",
    "ProximityMotion",
    "RigidBody",
    "ThrusterGeometry",
    "WheelArray",
    "attitude",
    "dipoles",
    "earth",
    "geomagnetic",
    "inverse3",
    "orbits",
    "plates",
    "quaternions",
    "sensors",
]
