"""Control laws and the parts they are made of; a law is one file."""

from casadi_gnc.laws._law import Law, gain, gains_of
from casadi_gnc.laws.attitude_pd import AttitudePD
from casadi_gnc.laws.braking_limiter import BrakingLimiter
from casadi_gnc.laws.command_filter import CommandFilter
from casadi_gnc.laws.detumble import Detumble
from casadi_gnc.laws.disturbance_observer import DisturbanceObserver
from casadi_gnc.laws.performance_funnel import PerformanceFunnel
from casadi_gnc.laws.prescribed_performance import PrescribedPerformance
from casadi_gnc.laws.rate_damping import RateDamping
from casadi_gnc.laws.sampling import advance
from casadi_gnc.laws.saturation_compensator import SaturationCompensator

#: Laws by the name that a problem file uses.
LAWS: dict[str, type[Law]] = {
    "rate_damping": RateDamping,
    "attitude_pd": AttitudePD,
    "detumble": Detumble,
    "prescribed_performance": PrescribedPerformance,
}

__all__ = [
    "LAWS",
    "AttitudePD",
    "BrakingLimiter",
    "CommandFilter",
    "Detumble",
    "DisturbanceObserver",
    "Law",
    "PerformanceFunnel",
    "PrescribedPerformance",
    "RateDamping",
    "SaturationCompensator",
    "advance",
    "gain",
    "gains_of",
]
