"""Control laws and the parts they are made of; a law is one file."""

from casadi_gnc.laws._law import Law, gain, gains_of, option
from casadi_gnc.laws.attitude_pd import AttitudePD
from casadi_gnc.laws.bdot import BDot
from casadi_gnc.laws.braking_limiter import BrakingLimiter
from casadi_gnc.laws.command_filter import CommandFilter
from casadi_gnc.laws.detumble import Detumble
from casadi_gnc.laws.disturbance_observer import DisturbanceObserver
from casadi_gnc.laws.drag_free import DragFree
from casadi_gnc.laws.efforts import FORCE, FORCE_AND_TORQUE, TORQUE
from casadi_gnc.laws.finite_time_fault_tolerant import FiniteTimeFaultTolerant
from casadi_gnc.laws.intermediate_observer import IntermediateObserver
from casadi_gnc.laws.modes import Modes
from casadi_gnc.laws.mrp_feedback import MrpFeedback
from casadi_gnc.laws.performance_funnel import PerformanceFunnel
from casadi_gnc.laws.position_disturbance_observer import PositionDisturbanceObserver
from casadi_gnc.laws.prescribed_performance import PrescribedPerformance
from casadi_gnc.laws.proximity_tracking import ProximityTracking
from casadi_gnc.laws.quaternion_feedback import QuaternionFeedback
from casadi_gnc.laws.rate_damping import RateDamping
from casadi_gnc.laws.sampling import advance
from casadi_gnc.laws.saturation_compensator import SaturationCompensator
from casadi_gnc.laws.two_observer_attitude import TwoObserverAttitude
from casadi_gnc.registry import Registry

#: Laws by the name that a problem file uses: shipped ones, those of installed packages, a user's own.
REGISTRY = Registry(
    "law",
    "casadi_gnc.laws",
    {
        "rate_damping": f"{__name__}.rate_damping:RateDamping",
        "attitude_pd": f"{__name__}.attitude_pd:AttitudePD",
        "detumble": f"{__name__}.detumble:Detumble",
        "prescribed_performance": f"{__name__}.prescribed_performance:PrescribedPerformance",
        "intermediate_observer": f"{__name__}.intermediate_observer:IntermediateObserver",
        "position_disturbance_observer": f"{__name__}.position_disturbance_observer:PositionDisturbanceObserver",
        "two_observer_attitude": f"{__name__}.two_observer_attitude:TwoObserverAttitude",
        "finite_time_fault_tolerant": f"{__name__}.finite_time_fault_tolerant:FiniteTimeFaultTolerant",
        "proximity_tracking": f"{__name__}.proximity_tracking:ProximityTracking",
        "drag_free": f"{__name__}.drag_free:DragFree",
        "mrp_feedback": f"{__name__}.mrp_feedback:MrpFeedback",
        "quaternion_feedback": f"{__name__}.quaternion_feedback:QuaternionFeedback",
        "bdot": f"{__name__}.bdot:BDot",
        "modes": f"{__name__}.modes:Modes",
    },
    is_one=lambda thing: isinstance(thing, type) and issubclass(thing, Law),
    expected="a class derived from casadi_gnc.Law",
)

__all__ = [
    "FORCE",
    "FORCE_AND_TORQUE",
    "REGISTRY",
    "TORQUE",
    "AttitudePD",
    "BDot",
    "BrakingLimiter",
    "CommandFilter",
    "Detumble",
    "DisturbanceObserver",
    "DragFree",
    "FiniteTimeFaultTolerant",
    "IntermediateObserver",
    "Law",
    "Modes",
    "MrpFeedback",
    "PerformanceFunnel",
    "PositionDisturbanceObserver",
    "PrescribedPerformance",
    "ProximityTracking",
    "QuaternionFeedback",
    "RateDamping",
    "SaturationCompensator",
    "TwoObserverAttitude",
    "advance",
    "gain",
    "gains_of",
    "option",
]
