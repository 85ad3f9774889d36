"""How a wanted effort is shared out among actuators, as a scheme of a file says it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, ValidationInfo, WithJsonSchema

from casadi_gnc.allocation import AllocationProblem, OnlineInFlight, PseudoInverse, SolverInFlight, backends
from casadi_gnc.errors import AllocationError, GncError
from casadi_gnc.tables.part import NonNegative, Part, Positive


def _found(value: Any, info: ValidationInfo) -> Any:
    """Return a back end's name as it is, if there is one, and the back end itself of a file of the user's own."""
    folder = (info.context or {}).get("folder", Path())
    try:
        found = backends.REGISTRY.find(value, folder)
    except GncError as error:
        raise ValueError(str(error)) from None
    return value if isinstance(value, str) and not value.startswith("./") else found


#: A back end by its name, or "./file.py:NAME" beside the problem file.
BackEndName = Annotated[
    Any, BeforeValidator(_found), WithJsonSchema({"type": "string", "description": "a back end of the allocation"})
]


def mass_centre(half: Sequence[float]) -> dict[str, tuple[float, float]]:
    """Return the box of a true centre of mass's errors, by key of a file; an axis without error is none of it."""
    return {f"truth.centre_of_mass_error_m.{i}": (-one, one) for i, one in enumerate(half, 1) if one > 0}


class Pinv(Part):
    """Pseudo-inverse, then clip."""

    method: Literal["pinv"] = "pinv"

    def allocator(self, problem: AllocationProblem | None) -> Any:
        """Return the allocator; an expression, which takes the effectiveness of every sample."""
        return PseudoInverse()


class Robust(Part):
    """Robust min-max allocation; a craft says against what."""

    method: Literal["robust"]
    backend: BackEndName = Field(default="online", description="online: the on-board solver, in C")
    accuracy_weight: Positive = Field(default=1e6, description="h, weight of the squared torque error")
    effort_weight: NonNegative = Field(default=1.0, description="diagonal of M1")
    change_weight: NonNegative = Field(default=1.0, description="diagonal of M2")

    def weights(self) -> dict[str, float]:
        """Return the weights under the names of `AllocationProblem`."""
        return {name: getattr(self, name) for name in ("accuracy_weight", "effort_weight", "change_weight")}

    def allocator(self, problem: AllocationProblem | None) -> Any:
        """Return the allocator of a problem that was made with `weights`."""
        if problem is None:
            raise AllocationError("robust allocation needs a problem")
        return OnlineInFlight(problem) if self.backend == "online" else SolverInFlight(problem, self.backend)
