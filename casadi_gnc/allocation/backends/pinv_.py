"""Pseudo-inverse, then clip: the baseline of Huang, Biggs, Duan (2020).

    F = clip(A'(A A')^-1 u, lower, upper)

Cheap and blind: thrusters push one way only, so the clip loses about half of the torque. Weights,
preferred forces and uncertainty are not looked at.
"""

from __future__ import annotations

import numpy as np

from casadi_gnc.allocation.backends import Capability, Found
from casadi_gnc.allocation.problem import AllocationProblem

CAPABILITIES = Capability.ROBUST | Capability.C_CODE
REQUIRES: tuple[str, ...] = ()
ACCURACY = (float("inf"), float("inf"))  # none
OBJECTIVE = "least sum of squared forces for the command, without bounds, which are met by clipping"


class _PseudoInverse:
    def __init__(self, problem: AllocationProblem) -> None:
        self._inverse = np.linalg.pinv(problem.effectiveness)

    def find(self, command: np.ndarray, previous: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> Found:
        """Return the clipped pseudo-inverse solution; it claims nothing."""
        return Found(np.clip(self._inverse @ command, lower, upper), claimed=False)


def set_up(problem: AllocationProblem) -> _PseudoInverse:
    """Return the pseudo-inverse of a problem; rank-deficient effectiveness is allowed."""
    return _PseudoInverse(problem)
