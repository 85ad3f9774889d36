"""Back ends: one file each, found by name, imported when first used.

A back end is a module with

* `CAPABILITIES`: what it can do, of `Capability`;
* `REQUIRES`: the packages it needs beyond the core;
* `set_up(problem, **options)`: returns an object with
  `find(command, previous, lower, upper) -> Found`, called once a sample.

`Found` is what the solver says; nothing of it is believed. `casadi_gnc.allocation.Allocator` moves
the forces into their bounds and certifies them from the data.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Flag, auto
from importlib import import_module, util
from typing import Any, Protocol

import numpy as np

from casadi_gnc.errors import AllocationError


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
        """Return what the solver says of one sample."""
        ...


#: Module of each back end, by the name that users give.
_HOMES = {
    "clarabel": "clarabel_",
    "pinv": "pinv_",
}


def names() -> list[str]:
    """Return the names of all back ends, installed or not."""
    return list(_HOMES)


def module(name: str) -> Any:
    """Return the module of a back end; raise `AllocationError` naming what there is."""
    if name not in _HOMES:
        raise AllocationError(f"no allocation back end {name!r}; there is {', '.join(names())}")
    return import_module(f"{__name__}.{_HOMES[name]}")


def missing(name: str) -> list[str]:
    """Return the packages that a back end needs and that are not installed."""
    return [package for package in module(name).REQUIRES if util.find_spec(package) is None]


def available() -> list[str]:
    """Return the names of the back ends that can be used here."""
    return [name for name in names() if not missing(name)]
