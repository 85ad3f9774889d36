"""Control laws and the parts they are made of; a law is one file."""

from casadi_gnc.laws._law import Law, gain, gains_of
from casadi_gnc.laws.attitude_pd import AttitudePD
from casadi_gnc.laws.braking_limiter import BrakingLimiter
from casadi_gnc.laws.command_filter import CommandFilter
from casadi_gnc.laws.detumble import Detumble
from casadi_gnc.laws.disturbance_observer import DisturbanceObserver
from casadi_gnc.laws.drag_free import DragFree
from casadi_gnc.laws.finite_time_fault_tolerant import FiniteTimeFaultTolerant
from casadi_gnc.laws.intermediate_observer import IntermediateObserver
from casadi_gnc.laws.performance_funnel import PerformanceFunnel
from casadi_gnc.laws.position_disturbance_observer import PositionDisturbanceObserver
from casadi_gnc.laws.prescribed_performance import PrescribedPerformance
from casadi_gnc.laws.proximity_tracking import ProximityTracking
from casadi_gnc.laws.rate_damping import RateDamping
from casadi_gnc.laws.sampling import advance
from casadi_gnc.laws.saturation_compensator import SaturationCompensator
from casadi_gnc.laws.two_observer_attitude import TwoObserverAttitude

#: Laws by the name that a problem file uses.
LAWS: dict[str, type[Law]] = {
    "rate_damping": RateDamping,
    "attitude_pd": AttitudePD,
    "detumble": Detumble,
    "prescribed_performance": PrescribedPerformance,
    "intermediate_observer": IntermediateObserver,
    "position_disturbance_observer": PositionDisturbanceObserver,
    "two_observer_attitude": TwoObserverAttitude,
    "finite_time_fault_tolerant": FiniteTimeFaultTolerant,
    "proximity_tracking": ProximityTracking,
    "drag_free": DragFree,
}

__all__ = [
    "LAWS",
    "AttitudePD",
    "BrakingLimiter",
    "CommandFilter",
    "Detumble",
    "DisturbanceObserver",
    "DragFree",
    "FiniteTimeFaultTolerant",
    "IntermediateObserver",
    "Law",
    "PerformanceFunnel",
    "PositionDisturbanceObserver",
    "PrescribedPerformance",
    "ProximityTracking",
    "RateDamping",
    "SaturationCompensator",
    "TwoObserverAttitude",
    "advance",
    "gain",
    "gains_of",
]
