"""Back ends for LMIs: one file each, found by name, imported when first used.

A back end is a module with

* `REQUIRES`: the packages it needs, by the names they are imported under;
* `solve(scaled, **options) -> Found`: an attempt at scaled conic data.

`Found` is what the solver says; nothing of it is believed: `casadi_gnc.synthesis.certificate`
recomputes everything from the data in original units.

Where no back end is named, `by_size` names those that are asked, one after another until one decides.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from importlib import util
from typing import Any, Protocol

import numpy as np

from casadi_gnc.errors import SynthesisError
from casadi_gnc.registry import Registry
from casadi_gnc.synthesis.scaling import Scaled

__all__ = ["REGISTRY", "BackEnd", "Claim", "Found", "by_size", "module", "names"]

#: Unknowns beyond which `barrier`, whose Newton equations are least squares in the unknowns, is the faster one.
_MANY = 200


class Claim(Enum):
    """What a solver says of a problem."""

    SOLVED = "solved"
    INFEASIBLE = "infeasible"
    UNBOUNDED = "unbounded"
    NOTHING = "nothing"


@dataclass(frozen=True, eq=False)
class Found:
    """Hold what a solver returned, in scaled units.

    Parameters
    ----------
    point : (N,), unknowns, or the ray if it claims an unbounded objective; may be NaN.
    dual : (M,), multipliers in the dual cone, triangles with weights; may be NaN.
    claim : what it says.
    iterations : its count.
    seconds : its own time; NaN if it does not say.
    """

    point: np.ndarray
    dual: np.ndarray
    claim: Claim
    iterations: int = 0
    seconds: float = float("nan")


class BackEnd(Protocol):
    """A module that attempts scaled conic data."""

    REQUIRES: tuple[str, ...]

    def solve(self, scaled: Scaled, **options: Any) -> Found:
        """Return what the solver says."""
        ...


#: Back ends by name: shipped ones, those of installed packages, a user's own.
REGISTRY = Registry(
    "LMI back end",
    "casadi_gnc.synthesis_backends",
    {name: f"{__name__}.{name}_" for name in ("clarabel", "scs", "barrier")},
    is_one=lambda thing: hasattr(thing, "REQUIRES") and hasattr(thing, "solve"),
    expected="an object or module with REQUIRES and solve",
    error=SynthesisError,
)


def names() -> list[str]:
    """Return the names of all back ends, installed or not."""
    return REGISTRY.names()


def by_size(count: int) -> tuple[str, ...]:
    """Return the names of the back ends that are asked in turn, with so many unknowns, where none is named."""
    return ("barrier", "clarabel") if count > _MANY else ("clarabel", "barrier")


def module(name: Any) -> Any:
    """Return a back end; raise `SynthesisError` naming what there is, or what is not installed."""
    found = REGISTRY.find(name)
    lacking = [package for package in found.REQUIRES if util.find_spec(package) is None]
    if lacking:
        raise SynthesisError(
            f"back end {name!r} needs {', '.join(lacking)}, which is not installed; 'barrier' needs nothing"
        )
    return found
