"""Generalized inverses with redistribution: what a pseudo-inverse leaves undone is given to those that can still move.

With the inverse that minimises |D (F - Fd)|, D^2 = M1 + M2 (1 for an actuator without weight), as `harkegard_`:

    rpinv   one redistribution: those beyond a bound are put there, the others share the rest of the effort by the
            inverse of their own columns, and are clipped
    cgi     cascaded: the same again and again, until none is beyond a bound or none is left

Neither looks back: an actuator that was put at a bound stays there, so that an attainable effort may be missed. h is
not looked at.

Sources: J. C. Virnig, D. S. Bodden, AIAA 94-3609, doi:10.2514/6.1994-3609; K. A. Bordignon, "Constrained control
allocation for systems with redundant control effectors", Virginia Tech, 1996.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from casadi_gnc.allocation.backends import BackEnd, Capability, Found
from casadi_gnc.allocation.problem import AllocationProblem

OBJECTIVE = "least effort for the command, bounds met afterwards: an actuator that was put at a bound stays there"


class _Redistributed:
    def __init__(self, problem: AllocationProblem, *, cascaded: bool) -> None:
        self._problem = problem
        self._most = problem.count + 1 if cascaded else 2
        total = problem.effort_weights + problem.change_weight
        self._size = np.where(total > 0, np.sqrt(np.where(total > 0, total, 1.0)), 1.0)
        self._total = total

    def find(self, command: np.ndarray, previous: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> Found:
        """Return the forces; it claims nothing."""
        problem = self._problem
        pulled = problem.effort_weights * problem.preferred + problem.change_weight * previous
        wanted = np.where(self._total > 0, pulled / np.where(self._total > 0, self._total, 1.0), 0.0)
        free, forces, count = np.ones(problem.count, dtype=bool), np.clip(wanted, lower, upper), 0
        while np.any(free) and count < self._most:
            count += 1
            left = command - problem.effectiveness[:, ~free] @ forces[~free]
            columns = problem.effectiveness[:, free] / self._size[free]
            missing = left - problem.effectiveness[:, free] @ wanted[free]
            share = wanted[free] + np.linalg.lstsq(columns, missing, 1e-10)[0] / self._size[free]
            forces[free] = np.clip(share, lower[free], upper[free])
            beyond = np.flatnonzero(free)[(share < lower[free]) | (share > upper[free])]
            if not beyond.size:
                break
            free[beyond] = False
        return Found(forces, iterations=count, claimed=False)


def _set_up(problem: AllocationProblem, *, cascaded: bool) -> _Redistributed:
    return _Redistributed(problem, cascaded=cascaded)


_NONE = (float("inf"), float("inf"))
RPINV = BackEnd(Capability.QP, (), _NONE, partial(_set_up, cascaded=False), OBJECTIVE=OBJECTIVE)
CGI = BackEnd(Capability.QP, (), _NONE, partial(_set_up, cascaded=True), OBJECTIVE=OBJECTIVE)
