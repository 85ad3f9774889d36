"""Allocation inside a flight: an expression where there is one, else a solver called every sample."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from casadi_gnc.allocation.allocator import Allocator
from casadi_gnc.allocation.answer import AllocationStatus
from casadi_gnc.allocation.online import FAST, OnlineSolver
from casadi_gnc.allocation.problem import AllocationProblem
from casadi_gnc.errors import AllocationError, NoCompilerError
from casadi_gnc.mathematics import bounds, exact
from casadi_gnc.mechanics.rigid_body import inverse3
from casadi_gnc.signals import Layout, Signal
from casadi_gnc.status import StepStatus
from casadi_gnc.system import compilers


def pseudo_inverse(effectiveness: ca.DM) -> ca.DM:
    """Return A'(A A')^-1, (N, 3), by plain arithmetic (no LAPACK, so constants are portable).

    Raises
    ------
    AllocationError
        For actuators that leave an effort out: there is no such inverse.
    """
    if not leaves_none_out(effectiveness):
        rows, rank = effectiveness.shape[0], np.linalg.matrix_rank(np.array(ca.DM(effectiveness)))
        raise AllocationError(
            f"the effectiveness has rank {rank}, expected {rows}: some effort cannot be made by any combination of the "
            'actuators; add or turn one, or allocate with method = "robust", which makes what can be made'
        )
    return ca.mtimes(effectiveness.T, inverse3(ca.mtimes(effectiveness, effectiveness.T)))


def leaves_none_out(effectiveness: Any) -> bool:
    """Return whether every effort can be made, as far as is known: of an effectiveness of numbers, by its rank."""
    if not exact.is_number(effectiveness):
        return True
    matrix = np.array(ca.DM(effectiveness))
    return bool(np.isfinite(matrix).all() and np.linalg.matrix_rank(matrix) == len(matrix))


@dataclass(frozen=True, eq=False)
class PseudoInverse:
    """Allocate by the clipped pseudo-inverse, as a CasADi expression; the effectiveness has full row rank."""

    report = Layout()

    def expression(self, command: Any, previous: Any, lower: Any, upper: Any, effectiveness: Any) -> Any:
        """Return F, (N,), as an expression of its arguments; `effectiveness` is (3, N)."""
        return bounds.clip(ca.mtimes(pseudo_inverse(effectiveness), command), lower, upper)


@dataclass(frozen=True, eq=False)
class Direct:
    """Tell each actuator its own row of the effort, inside its bounds; the effectiveness is the identity."""

    report = Layout()

    def expression(self, command: Any, previous: Any, lower: Any, upper: Any, effectiveness: Any) -> Any:
        """Return the clipped command, (N,)."""
        return bounds.clip(command, lower, upper)


#: What one sample of an allocation leaves in the record.
CERTIFICATE = Layout((Signal("duality_gap"), Signal("allocation_cost"), Signal("worst_vertex"), Signal("iterations")))

#: What the end of an allocation raises in flight; the generated C does the same (allocation_status.j2).
RAISED = {
    AllocationStatus.OPTIMAL: StepStatus(0),
    AllocationStatus.AT_ROUNDING: StepStatus(0),
    AllocationStatus.NOT_CERTIFIED: StepStatus.ALLOCATION_INEXACT,
    AllocationStatus.FAILED: StepStatus.ALLOCATION_FAILED,
    AllocationStatus.BAD_COMMAND: StepStatus.ALLOCATION_FAILED,
}
#: Statuses by their codes in gnc_allocate.h.
CODES = (
    AllocationStatus.OPTIMAL,
    AllocationStatus.AT_ROUNDING,
    AllocationStatus.NOT_CERTIFIED,
    AllocationStatus.BAD_COMMAND,
    AllocationStatus.FAILED,
)

#: (command, previous, lower, upper) -> (forces inside the box, status bits, numbers of the report)
Allocate = Callable[[np.ndarray, np.ndarray, np.ndarray, np.ndarray], tuple[np.ndarray, int, np.ndarray]]


@dataclass(frozen=True, eq=False)
class SolverInFlight:
    """Call a back end every sample, and report its certificate in the record.

    Parameters
    ----------
    problem : what is allocated.
    backend : its name, or a back end itself.
    """

    problem: AllocationProblem
    backend: Any = "clarabel"
    report = CERTIFICATE

    def start(self) -> Allocate:
        """Return the function of one flight; what a solver remembers belongs to that flight alone."""
        allocator = Allocator(self.problem, self.backend)

        def allocate(command: Any, previous: Any, lower: Any, upper: Any) -> tuple[np.ndarray, int, np.ndarray]:
            answer = allocator.solve(command, previous, (np.array(lower), np.array(upper)))
            report = [answer.duality_gap, answer.objective, float(answer.worst_vertex), float(answer.iterations)]
            return answer.forces, int(RAISED[answer.status]), np.array(report)

        return allocate


@dataclass(frozen=True, eq=False)
class OnlineInFlight:
    """Allocate by the on-board solver, which compiled flights call without leaving the C.

    Parameters
    ----------
    problem : what is allocated.
    """

    problem: AllocationProblem
    report = CERTIFICATE

    def solver(self, compiler: compilers.Compiler | None = None, optimise: tuple[str, ...] = FAST) -> OnlineSolver:
        """Return a fresh solver, whose memory a compiled flight may use."""
        return OnlineSolver(self.problem, compiler=compiler, optimise=optimise)

    def start(self, optimise: tuple[str, ...] = FAST) -> Allocate:
        """Return the function of one flight: the same compiled solver, called from Python.

        Without a compiler the cone solver takes its place; its forces differ within both gaps.
        """
        try:
            solver = self.solver(optimise=optimise)
        except NoCompilerError:
            return SolverInFlight(self.problem, "clarabel").start()

        def allocate(command: Any, previous: Any, lower: Any, upper: Any) -> tuple[np.ndarray, int, np.ndarray]:
            raw = solver.solve(command, previous, lower, upper)
            report = [raw.gap, raw.objective, float(raw.worst_vertex), float(raw.iterations)]
            return raw.forces, int(RAISED[CODES[raw.status]]), np.array(report)

        return allocate
