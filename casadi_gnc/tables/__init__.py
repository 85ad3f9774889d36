"""What the tables of a problem file are made of: numbers with ranges, and parts that several crafts share."""

from casadi_gnc.tables.allocation import BackEndName, Pinv, Robust
from casadi_gnc.tables.attitude import AttitudeStart
from casadi_gnc.tables.disturbances import OrbitalPush, OrbitAndTorque, OuterForce
from casadi_gnc.tables.limits import ForceAndTorqueLimits
from casadi_gnc.tables.matrices import SYMMETRIC, Inertia
from casadi_gnc.tables.orientation import Orientation
from casadi_gnc.tables.part import Matrix, MisfitError, NonNegative, Part, Positive, Rows, Table, Vector, table
from casadi_gnc.tables.thrusters import Engine, MountedThrusters, Thrusters
from casadi_gnc.tables.wheels import Wheels

__all__ = [
    "SYMMETRIC",
    "AttitudeStart",
    "BackEndName",
    "Engine",
    "ForceAndTorqueLimits",
    "Inertia",
    "Matrix",
    "MisfitError",
    "MountedThrusters",
    "NonNegative",
    "OrbitAndTorque",
    "OrbitalPush",
    "Orientation",
    "OuterForce",
    "Part",
    "Pinv",
    "Positive",
    "Robust",
    "Rows",
    "Table",
    "Thrusters",
    "Vector",
    "Wheels",
    "table",
]
