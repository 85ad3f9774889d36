"""casadi-gnc: spacecraft guidance, navigation and control from CasADi symbols to flight C.

>>> import casadi_gnc
>>> mission = casadi_gnc.load("huang2020/detumble")
>>> flight = casadi_gnc.fly(mission, "damping_pinv")
>>> flight["rate"].shape, flight.unit("rate")
((15001, 3), 'rad/s')

Names are imported when they are first used, so that importing the package costs little.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from casadi_gnc.errors import GncError
    from casadi_gnc.missions.flight import Flight
    from casadi_gnc.missions.flying import fly, fly_all
    from casadi_gnc.missions.mission import Mission
    from casadi_gnc.problem_files.loading import load, shipped
    from casadi_gnc.status import StepStatus

__all__ = ["Flight", "GncError", "Mission", "StepStatus", "fly", "fly_all", "load", "shipped"]

_HOMES = {
    "Flight": "missions.flight",
    "GncError": "errors",
    "Mission": "missions.mission",
    "StepStatus": "status",
    "fly": "missions.flying",
    "fly_all": "missions.flying",
    "load": "problem_files.loading",
    "shipped": "problem_files.loading",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'casadi_gnc' has no attribute {name!r}")
    return getattr(import_module(f"casadi_gnc.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)
