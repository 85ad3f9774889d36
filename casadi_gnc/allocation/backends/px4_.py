"""Sequential desaturation, the allocation of PX4's multicopters, for any rows of effort.

Start from the pseudo-inverse about the preferred forces. A **desaturation direction** d is a change of all forces;
along it each actuator beyond a bound asks for a change k = (bound - F_i)/d_i. The most asked upward and the most asked
downward are added: where both ends are saturated the change is the one between, which shares the excess. The change is
made, and then half of what is asked once more, since the first may saturate others.

Here the rows of effort are axes by importance, the first the most. The effort-free direction stands for a multicopter's
collective thrust: the ones, projected on the null space of A, where that moves all actuators the same way.

1. All axes but the last are mixed; then the effort-free direction, then the columns of these axes from the least
   important to the first, desaturate.
2. The last axis (a multicopter's yaw) is added, and desaturated along the effort-free direction and its own column: it
   is given up before the others.

What is still beyond a bound is clipped. Weights and h are not looked at.

Source: the documentation of PX4's control allocation (docs.px4.io), written anew from what it describes.
"""

from __future__ import annotations

import numpy as np

from casadi_gnc.allocation.backends import Capability, Found
from casadi_gnc.allocation.problem import AllocationProblem

CAPABILITIES = Capability.QP
REQUIRES: tuple[str, ...] = ()
ACCURACY = (float("inf"), float("inf"))  # none
OBJECTIVE = "axes are given up by their order, the last one first, until the bounds are met"
_STILL = 0.2  # of the largest entry of a direction: an actuator that it hardly moves asks for nothing


def asked(forces: np.ndarray, direction: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> float:
    """Return how far to go along a direction to balance what the saturated actuators ask for."""
    moved = np.abs(direction) > _STILL * np.max(np.abs(direction), initial=0.0)
    excess = np.where(forces < lower, lower - forces, np.where(forces > upper, upper - forces, 0.0))
    wanted = excess[moved] / direction[moved]
    return float(np.max(wanted, initial=0.0) + np.min(wanted, initial=0.0))


class _SequentialDesaturation:
    def __init__(self, problem: AllocationProblem) -> None:
        self._problem = problem
        self._inverse = np.linalg.pinv(problem.effectiveness)
        ones = np.ones(problem.count)
        free = ones - self._inverse @ (problem.effectiveness @ ones)
        self._free = free if np.min(free) > _STILL * np.max(free) else np.zeros(problem.count)

    def find(self, command: np.ndarray, previous: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> Found:
        """Return the forces; it claims nothing."""
        problem, columns = self._problem, self._inverse.T
        trim = np.clip(problem.preferred, lower, upper)
        share = command - problem.effectiveness @ trim
        last = len(share) - 1
        forces = trim + self._inverse[:, :last] @ share[:last]
        count = 0
        for direction in (self._free, *columns[:last][::-1]):
            forces, count = self._desaturated(forces, direction, lower, upper), count + 1
        forces = forces + columns[last] * share[last]
        for direction in (self._free, columns[last]):
            forces, count = self._desaturated(forces, direction, lower, upper), count + 1
        return Found(np.clip(forces, lower, upper), iterations=count, claimed=False)

    def _desaturated(
        self, forces: np.ndarray, direction: np.ndarray, lower: np.ndarray, upper: np.ndarray
    ) -> np.ndarray:
        for portion in (1.0, 0.5):
            forces = forces + portion * asked(forces, direction, lower, upper) * direction
        return forces


def set_up(problem: AllocationProblem) -> _SequentialDesaturation:
    """Return the pseudo-inverse of a problem and its directions; rank-deficient effectiveness is allowed."""
    return _SequentialDesaturation(problem)
