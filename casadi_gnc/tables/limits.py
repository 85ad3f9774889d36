"""The keys of a scheme whose every channel of force and torque is clipped by itself."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from casadi_gnc.tables.part import Part, Positive

Limits = Annotated[list[Positive], Field(min_length=3, max_length=3)]


class ForceAndTorqueLimits(Part):
    """Limits of each axis."""

    force_limit_N: Limits
    torque_limit_N_m: Limits

    def column(self) -> list[float]:
        """Return the limits of force and torque, (6,)."""
        return [*self.force_limit_N, *self.torque_limit_N_m]
