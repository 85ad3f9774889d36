"""casadi-gnc: spacecraft guidance, navigation and control from CasADi symbols to flight C.

>>> import casadi_gnc as gnc
>>> flight = gnc.fly("huang2020/detumble", "damping_pinv")
>>> flight["rate"].shape, flight.unit("rate")
((15001, 3), 'rad/s')

What a craft, a law or a check of your own is derived from, and what flies, checks and delivers it, is here.
Names are imported when they are first used, so that importing the package costs little.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from casadi_gnc.checks import Check
    from casadi_gnc.delivery.fmu import generate_fmu
    from casadi_gnc.delivery.generating import generate
    from casadi_gnc.delivery.verifying import verify
    from casadi_gnc.errors import GncError
    from casadi_gnc.laws import FORCE, FORCE_AND_TORQUE, TORQUE, Law, gain, option
    from casadi_gnc.missions.actuation import Actuation, Actuators
    from casadi_gnc.missions.craft import Craft, EffortKeys
    from casadi_gnc.missions.fault_handling import FaultHandling
    from casadi_gnc.missions.flight import Flight
    from casadi_gnc.missions.mission import Mission
    from casadi_gnc.missions.panel import Panel
    from casadi_gnc.missions.plant import Plant
    from casadi_gnc.missions.requirements import Requirement, Verdict
    from casadi_gnc.missions.scheme import Funnel, Metric, Scheme
    from casadi_gnc.missions.timing import Noise, Timing
    from casadi_gnc.problem_files.by_name import campaign, check, fly, fly_all, margins, sensitivities, vary
    from casadi_gnc.problem_files.document import shipped
    from casadi_gnc.problem_files.loading import load
    from casadi_gnc.signals import Layout, Signal
    from casadi_gnc.status import StepStatus
    from casadi_gnc.tables.part import Part, table
    from casadi_gnc.tuning.falsifying import falsify
    from casadi_gnc.tuning.tune import tune

#: Where each name lives.
_HOMES = {
    "Actuation": "missions.actuation",
    "Actuators": "missions.actuation",
    "Check": "checks",
    "Craft": "missions.craft",
    "EffortKeys": "missions.craft",
    "FORCE": "laws",
    "FORCE_AND_TORQUE": "laws",
    "FaultHandling": "missions.fault_handling",
    "Flight": "missions.flight",
    "Funnel": "missions.scheme",
    "GncError": "errors",
    "Law": "laws",
    "Layout": "signals",
    "Metric": "missions.scheme",
    "Mission": "missions.mission",
    "Noise": "missions.timing",
    "Panel": "missions.panel",
    "Part": "tables.part",
    "Plant": "missions.plant",
    "Requirement": "missions.requirements",
    "Scheme": "missions.scheme",
    "Signal": "signals",
    "StepStatus": "status",
    "TORQUE": "laws",
    "Timing": "missions.timing",
    "Verdict": "missions.requirements",
    "campaign": "problem_files.by_name",
    "check": "problem_files.by_name",
    "falsify": "tuning.falsifying",
    "fly": "problem_files.by_name",
    "fly_all": "problem_files.by_name",
    "gain": "laws",
    "generate": "delivery.generating",
    "generate_fmu": "delivery.fmu",
    "load": "problem_files.loading",
    "margins": "problem_files.by_name",
    "option": "laws",
    "sensitivities": "problem_files.by_name",
    "shipped": "problem_files.document",
    "table": "tables.part",
    "tune": "tuning.tune",
    "vary": "problem_files.by_name",
    "verify": "delivery.verifying",
}

__all__ = [
    "FORCE",
    "FORCE_AND_TORQUE",
    "TORQUE",
    "Actuation",
    "Actuators",
    "Check",
    "Craft",
    "EffortKeys",
    "FaultHandling",
    "Flight",
    "Funnel",
    "GncError",
    "Law",
    "Layout",
    "Metric",
    "Mission",
    "Noise",
    "Panel",
    "Part",
    "Plant",
    "Requirement",
    "Scheme",
    "Signal",
    "StepStatus",
    "Timing",
    "Verdict",
    "campaign",
    "check",
    "falsify",
    "fly",
    "fly_all",
    "gain",
    "generate",
    "generate_fmu",
    "load",
    "margins",
    "option",
    "sensitivities",
    "shipped",
    "table",
    "tune",
    "vary",
    "verify",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'casadi_gnc' has no attribute {name!r}")
    return getattr(import_module(f"casadi_gnc.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)
