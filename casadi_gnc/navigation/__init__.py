"""From what is measured to what laws read: estimators, references, and errors between the two."""

from casadi_gnc.navigation._navigation import Estimator, Navigation, Reference, Wanted
from casadi_gnc.navigation.attitude_navigation import AttitudeNavigation

__all__ = ["AttitudeNavigation", "Estimator", "Navigation", "Reference", "Wanted"]
