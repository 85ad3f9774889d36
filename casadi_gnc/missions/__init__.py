"""Missions: crafts, schemes, the loop that is composed once, engines, flights, the stepper."""

from casadi_gnc.missions.actuation import Actuation, Actuators
from casadi_gnc.missions.craft import Craft, EffortKeys
from casadi_gnc.missions.flight import Flight
from casadi_gnc.missions.flying import fly, fly_all
from casadi_gnc.missions.loop import Loop
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.onboard import describe
from casadi_gnc.missions.origin import Origin
from casadi_gnc.missions.panel import Panel
from casadi_gnc.missions.plant import Plant
from casadi_gnc.missions.requirements import Requirement, Verdict
from casadi_gnc.missions.scheme import Funnel, Metric, Scheme
from casadi_gnc.missions.stepper import Stepper
from casadi_gnc.missions.timing import Noise, Timing

__all__ = [
    "Actuation",
    "Actuators",
    "Craft",
    "EffortKeys",
    "Flight",
    "Funnel",
    "Loop",
    "Metric",
    "Mission",
    "Noise",
    "Origin",
    "Panel",
    "Plant",
    "Requirement",
    "Scheme",
    "Stepper",
    "Timing",
    "Verdict",
    "describe",
    "fly",
    "fly_all",
]
