"""Draw a pair together: proportional force on position and velocity, no faster than allowed.

With K = [K_p, K_v] the force K_p (r_d - p) - K_v v is K_v (v_d - v) of the wanted velocity
v_d = K_v^-1 K_p (r_d - p). With a speed limit s that velocity is bent,

    v_d -> v_d / sqrt(1 + |v_d|^2/(0.9 s)^2),

so that its norm stays below 0.9 s and its direction, a straight line to the port r_d, is kept: the
position's part of the force is cut, the damping is not. Far away the wanted velocity then tends to
0.9 s, and the force from rest to 0.9 K_v s whatever the distance. The tenth is kept for what the
estimate of the disturbance has not learnt yet; it is no proof, so the closing speed is watched.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

from casadi_gnc.mechanics.relative_motion import PairModel
from casadi_gnc.mechanics.rigid_body import inverse3
from casadi_gnc.status import StepStatus

#: Share of the speed limit that is planned with.
PLANNED = 0.9


@dataclass(frozen=True, eq=False)
class Approach:
    """Hold the feedback of an approach.

    Parameters
    ----------
    gain : K, (3, 6), [N/m] and [N s/m]; its velocity part must be regular where there is a speed limit.
    body : the pair, whose port is r_d, (3,), [m].
    speed : s, [m/s]; none: no limit.
    """

    gain: Any
    body: PairModel
    speed: Any = None

    def force(self, position: Any, velocity: Any) -> Any:
        """Return the force, (3,), [N], with the one that holds the pair at the port."""
        return self.pull(position, velocity) + self.body.holding()

    def pull(self, position: Any, velocity: Any) -> Any:
        """Return the feedback, (3,), [N], zero at rest at the port."""
        stiff, damp = self.gain[:, :3], self.gain[:, 3:]
        ahead = self.body.ahead(position)
        if self.speed is None:
            return ca.mtimes(stiff, ahead) - ca.mtimes(damp, velocity)
        wanted = ca.mtimes(inverse3(damp), ca.mtimes(stiff, ahead))
        planned = PLANNED * self.speed
        bent = wanted / ca.sqrt(1 + ca.sumsqr(wanted) / (planned * planned))
        return ca.mtimes(damp, bent - velocity)

    def status(self, position: Any, velocity: Any) -> dict[StepStatus, Any]:
        """Return whether the distance to the point shrinks faster than the limit."""
        if self.speed is None:
            return {}
        ahead = self.body.ahead(position)
        closing = ca.dot(ahead, velocity)
        return {StepStatus.APPROACH_TOO_FAST: closing > self.speed * ca.sqrt(ca.sumsqr(ahead))}


def as_matrix(value: Any) -> Any:
    """Return rows or numbers as a CasADi matrix; expressions as they are."""
    return value if isinstance(value, (ca.SX, ca.MX)) else ca.DM(value)
