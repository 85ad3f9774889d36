"""From what is measured to what laws read: estimators, references, and errors between the two."""

from casadi_gnc.navigation._navigation import Estimator, Navigation, Reference, Wanted
from casadi_gnc.navigation.attitude_navigation import AttitudeNavigation
from casadi_gnc.navigation.mekf import Mekf
from casadi_gnc.navigation.profiles import Slew, Table
from casadi_gnc.navigation.references import GroundTarget, Inertial, Nadir, SunPointing, Tracking
from casadi_gnc.navigation.timelines import Timeline

__all__ = [
    "AttitudeNavigation",
    "Estimator",
    "GroundTarget",
    "Inertial",
    "Mekf",
    "Nadir",
    "Navigation",
    "Reference",
    "Slew",
    "SunPointing",
    "Table",
    "Timeline",
    "Tracking",
    "Wanted",
]
