"""Back ends: one file each, found by name, imported when first used.

A back end is a module, or a `BackEnd` in one, with

* `CAPABILITIES`: what it can do, of `Capability`;
* `REQUIRES`: the packages it needs, by the names they are imported under;
* `ACCURACY`: relative gap and rounding floor (share of h |full effort|^2) that its answers keep, by test;
* `set_up(problem, **options)`: returns an object with
  `find(command, previous, lower, upper) -> Found`, called once a sample;
* `OBJECTIVE`, only where it minimises something else than the cost of the problem: what that is.

`Found` is what the solver says; nothing of it is believed. `casadi_gnc.allocation.Allocator` moves
the forces into their bounds and certifies them from the data.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Flag, auto
from importlib import import_module, util
from typing import Any, Protocol

import numpy as np

from casadi_gnc.errors import AllocationError
from casadi_gnc.registry import Registry

__all__ = [
    "QPSOLVERS",
    "REGISTRY",
    "BackEnd",
    "Capability",
    "Found",
    "Solver",
    "available",
    "missing",
    "module",
    "name_of",
    "names",
    "objective_of",
]


class Capability(Flag):
    """What a back end can do."""

    ROBUST = auto()  # the min-max problem; without it only problems without uncertainty
    EXACT = auto()  # solves to optimality; without it a heuristic
    WARM_START = auto()  # uses the previous answer
    SOCP = auto()
    SDP = auto()
    NLP = auto()
    QP = auto()
    C_CODE = auto()  # runs in generated C


@dataclass(frozen=True, eq=False)
class Found:
    """Hold what a solver returned.

    Parameters
    ----------
    forces : (N,); may lie outside the bounds by the solver's tolerance, or not be finite.
    weights : (V,), multipliers of the vertices; None if the solver has none.
    iterations : its count.
    claimed : whether it says that it solved the problem.
    seconds : its own time; NaN if it does not say.
    """

    forces: np.ndarray
    weights: np.ndarray | None = None
    iterations: int = 0
    claimed: bool = True
    seconds: float = float("nan")


class Solver(Protocol):
    """One back end, set up for one problem."""

    def find(self, command: np.ndarray, previous: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> Found:
        """Return what the solver says of one sample.

        A solver may also have `update(problem) -> bool`: take other data and keep its warm start, or
        return False to be set up again.
        """
        ...


@dataclass(frozen=True, eq=False)
class BackEnd:
    """Hold a back end that shares its module with others; the fields are those of a module."""

    CAPABILITIES: Capability
    REQUIRES: tuple[str, ...]
    ACCURACY: tuple[float, float]
    set_up: Callable[..., Solver]
    OBJECTIVE: str = ""


#: Before the name of any solver that qpsolvers finds, whatever its licence.
QPSOLVERS = "qpsolvers:"
_PARTS = ("CAPABILITIES", "REQUIRES", "ACCURACY", "set_up")

#: Back ends by the name that users give: shipped ones, those of installed packages, a user's own.
REGISTRY = Registry(
    "allocation back end",
    "casadi_gnc.allocation_backends",
    {
        name: f"{__name__}.{home}"
        for name, home in {
            "online": "online_",
            "clarabel": "clarabel_",
            "scs": "scs_",
            "sdp": "sdp_",
            "sdp_scs": "sdp_:SCS",
            "ipopt": "nlp_",
            "sqpmethod": "nlp_:SQPMETHOD",
            "sqpmethod_qrqp": "nlp_:SQPMETHOD_QRQP",
            "proxqp": "proxqp_",
            "daqp": "daqp_",
            "osqp": "qpsolvers_:OSQP",
            "highs": "qpsolvers_:HIGHS",
            "piqp": "qpsolvers_:PIQP",
            "wls": "harkegard_:WLS",
            "eiqp": "eiqp_",
            "sls": "harkegard_:SLS",
            "rpinv": "generalized_inverses_:RPINV",
            "cgi": "generalized_inverses_:CGI",
            "px4": "px4_",
            "rls": "robust_least_squares_:RLS",
            "ellipsoid": "robust_least_squares_:ELLIPSOID",
            "pinv": "pinv_",
        }.items()
    },
    is_one=lambda thing: all(hasattr(thing, part) for part in _PARTS),
    expected=f"a casadi_gnc.allocation.backends.BackEnd, or a module with {', '.join(_PARTS)}",
    more=f", and {QPSOLVERS}NAME for any solver that qpsolvers finds",
    error=AllocationError,
)


def names() -> list[str]:
    """Return the names of all back ends, installed or not."""
    return REGISTRY.names()


def module(name: Any) -> Any:
    """Return a back end (its module or `BackEnd`) by its name; raise `AllocationError` naming what there is."""
    if isinstance(name, str) and name.startswith(QPSOLVERS):
        return import_module(f"{__name__}.qpsolvers_").back_end(name.removeprefix(QPSOLVERS))
    return REGISTRY.find(name)


def name_of(name: Any) -> str:
    """Return the name of a back end that is given by it, or as an object."""
    return name if isinstance(name, str) else REGISTRY.name_of(name)


def objective_of(name: Any) -> str:
    """Return what a back end minimises in the place of the problem's cost; empty where it is that cost."""
    return str(getattr(module(name), "OBJECTIVE", ""))


def missing(name: Any) -> list[str]:
    """Return the packages that a back end needs and that are not installed."""
    return [package for package in module(name).REQUIRES if util.find_spec(package) is None]


def available() -> list[str]:
    """Return the names of the back ends that can be used here."""
    return [name for name in names() if not missing(name)]
