"""The chaser's coil as an actuator: the map from moment to force at the measured place, and what it cannot do."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from casadi_gnc.mechanics import dipoles
from casadi_gnc.mechanics.dipoles import TargetDipole
from casadi_gnc.status import StepStatus


@dataclass(frozen=True, eq=False)
class Coil:
    """Turn forces into moments of the chaser.

    Parameters
    ----------
    target : the target's moment.
    damping : d of the damped least squares (`casadi_gnc.mechanics.dipoles`).
    singular_below : cosine of line of sight and target moment that is reported as singular.
    nearest : distance [m] below which coils are no dipoles; 0 leaves that out.
    """

    target: TargetDipole
    damping: float
    singular_below: float
    nearest: float

    def effectiveness(self, seen: Any) -> Any:
        """Return the force per moment, (3, 3), [N/(A m^2)], at the measured position."""
        return dipoles.force_map(seen.position, self.target.at(seen.position))

    def moment(self, seen: Any, force: Any) -> Any:
        """Return the moment, (3,), [A m^2], for a force [N]."""
        return dipoles.moment_for(force, seen.position, self.target.at(seen.position), self.damping)

    def judge(self, seen: Any, limited: Any, actuators: Any) -> dict[StepStatus, Any]:
        """Return whether the map is nearly singular, and whether the craft are too close."""
        aligned = dipoles.alignment(seen.position, self.target.at(seen.position))
        flags = {StepStatus.ALLOCATION_SINGULAR: aligned < self.singular_below}
        if self.nearest:
            flags[StepStatus.NEAR_FIELD] = dipoles.length(seen.position) < self.nearest
        return flags
