"""The on-board solver: interior point with a warm-started active set, in static memory.

See `codegen/runtime/gnc_allocate.h` for the method; it is compiled for the problem's sizes.
"""

from __future__ import annotations

import numpy as np

from casadi_gnc.allocation.backends import Capability, Found
from casadi_gnc.allocation.online import OnlineSolver
from casadi_gnc.allocation.problem import AllocationProblem
from casadi_gnc.errors import AllocationError

CAPABILITIES = Capability.ROBUST | Capability.EXACT | Capability.WARM_START | Capability.C_CODE
REQUIRES: tuple[str, ...] = ()
ACCURACY = (1e-8, 1e-14)


class _Online:
    def __init__(self, solver: OnlineSolver) -> None:
        self._solver = solver

    def update(self, problem: AllocationProblem) -> bool:
        """Take other data of the same sizes and keep the warm start."""
        return self._solver.update(problem)

    def find(self, command: np.ndarray, previous: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> Found:
        """Return the forces and vertex weights of the C."""
        raw = self._solver.solve(command, previous, lower, upper)
        return Found(raw.forces, raw.weights, raw.iterations, claimed=raw.status <= 1)


def set_up(problem: AllocationProblem, *, tolerance: float = 0.0, interior_point_only: bool = False) -> _Online:
    """Return the compiled solver; `tolerance` 0 means 1e-8, `interior_point_only` drops the fast path."""
    if not isinstance(tolerance, (int, float)) or not 0 <= tolerance < 1:
        raise AllocationError(f"tolerance is {tolerance!r}, expected a relative gap from 0 to 1")
    return _Online(OnlineSolver(problem, tolerance=tolerance, interior_point_only=interior_point_only))
