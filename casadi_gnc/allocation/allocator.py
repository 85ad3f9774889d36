"""Allocate: one command, or command after command with a warm start."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any, Literal

import numpy as np

from casadi_gnc.allocation import backends
from casadi_gnc.allocation.answer import ACCURACIES, AllocationStatus, Answer, certify, saturation
from casadi_gnc.allocation.backends import Capability, Found
from casadi_gnc.allocation.problem import AllocationProblem
from casadi_gnc.errors import AllocationError, offer
from casadi_gnc.mathematics.arrays import real_array

Accuracy = Literal["low", "mid", "high"]
LARGEST = 1e100  # numbers beyond are no commands, and their squares no numbers


class Allocator:
    """Solve a problem for command after command; the last forces are the next previous ones.

    Parameters
    ----------
    problem : what stays the same.
    backend : name of a back end, or one itself, see `casadi_gnc.allocation.backends`.
    accuracy : "low", "mid" or "high": to which gap an answer counts as certified.
    options : of the back end; an unknown one is an error.

    Raises
    ------
    AllocationError
        For an unknown or missing back end, or one that cannot solve this kind of problem.
    """

    def __init__(
        self, problem: AllocationProblem, backend: Any = "clarabel", *, accuracy: Accuracy = "mid", **options: Any
    ) -> None:
        if accuracy not in ACCURACIES:
            raise AllocationError(f"accuracy {accuracy!r} is not known; {offer(accuracy, ACCURACIES)}")
        self._module = backends.module(backend)
        lacking, backend = backends.missing(backend), backends.name_of(backend)
        if lacking:
            raise AllocationError(f"back end {backend!r} needs {', '.join(lacking)}, which is not installed")
        self.backend, self._accuracy, self._options = backend, ACCURACIES[accuracy], options
        self._set_up(problem)
        self.previous = np.clip(np.zeros(problem.count), problem.lower, problem.upper)

    def _set_up(self, problem: AllocationProblem) -> None:
        if problem.is_robust and Capability.ROBUST not in self._module.CAPABILITIES:
            raise AllocationError(
                f"back end {self.backend!r} solves problems without uncertainty only; "
                "leave coupling and errors out, or take another back end"
            )
        try:
            self._solver: backends.Solver = self._module.set_up(problem, **self._options)
        except TypeError as error:
            raise AllocationError(f"back end {self.backend!r}: {error}") from error
        self.problem = problem

    def update(self, **changes: Any) -> None:
        """Change fields of the problem (bounds, weights, effectiveness) and keep the last forces.

        A back end that can also keeps what it knows of the last answer.
        """
        try:
            changed = replace(self.problem, **changes)
        except TypeError as error:
            raise AllocationError(f"no such field of the problem: {error}") from error
        warm = getattr(self._solver, "update", None)
        if warm is not None and warm(changed):
            self.problem = changed
            return
        self._set_up(changed)
        if len(self.previous) != changed.count:
            self.previous = np.clip(np.zeros(changed.count), changed.lower, changed.upper)

    def solve(self, command: Any, previous: Any = None, box: tuple[np.ndarray, np.ndarray] | None = None) -> Answer:
        """Return the allocation of a command.

        Parameters
        ----------
        command : u, (R,), [N m].
        previous : Fp, (N,), [N]; those of the last call by default, at first zero.
        box : lower and upper bounds of this sample, (N,) each, [N]; the problem's amplitude and rate
            bounds by default.

        Raises
        ------
        AllocationError
            For a wrong shape. Numbers that are not finite, or whose squares would not be, give the
            status BAD_COMMAND.
        """
        problem = self.problem
        u = real_array("command", command, AllocationError)
        last = self.previous if previous is None else real_array("previous", previous, AllocationError)
        rows = len(problem.effectiveness)
        if u.shape != (rows,) or last.shape != (problem.count,):
            raise AllocationError(
                f"command has shape {u.shape}, expected ({rows},); previous {last.shape}, expected ({problem.count},)"
            )
        box = None if box is None else self._checked(box)
        started = time.perf_counter()
        wanted, known = np.abs(u) <= LARGEST, np.abs(last) <= LARGEST  # false for NaN
        if not (np.all(wanted) and np.all(known)):
            kept = np.clip(np.where(known, last, self.previous), problem.lower, problem.upper)
            return self._answer(
                np.where(wanted, u, 0.0),
                kept,
                Found(kept, claimed=False),
                AllocationStatus.BAD_COMMAND,
                started,
                problem.box(kept) if box is None else box,
            )
        lower, upper = problem.box(last) if box is None else box
        return self._answer(u, last, self._solver.find(u, last, lower, upper), None, started, (lower, upper))

    def _checked(self, box: tuple[np.ndarray, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        lower, upper = (real_array("box", bound, AllocationError) for bound in box)
        count = self.problem.count
        if lower.shape != (count,) or upper.shape != (count,):
            raise AllocationError(f"box has shapes {lower.shape} and {upper.shape}, expected ({count},) twice")
        if not np.all(lower <= upper) or not np.all(np.isfinite(lower) & np.isfinite(upper)):
            raise AllocationError("box has a lower bound above its upper one, or a bound that is not finite")
        return lower, upper

    # Weights may be so large that costs overflow; such a cost is judged, not warned of.
    @np.errstate(over="ignore", invalid="ignore")
    def _answer(
        self,
        u: np.ndarray,
        last: np.ndarray,
        found: Found,
        status: AllocationStatus | None,
        started: float,
        box: tuple[np.ndarray, np.ndarray],
    ) -> Answer:
        problem, (lower, upper) = self.problem, box
        usable = np.shape(found.forces) == np.shape(lower) and bool(np.all(np.isfinite(found.forces)))
        forces = np.clip(found.forces if usable else last, lower, upper)
        seconds = time.perf_counter() - started
        cost, gap, weights, certified = certify(problem, u, last, forces, found.weights, self._accuracy, box)
        if status is None:
            status = certified if usable else AllocationStatus.FAILED
        self.previous = forces.copy()
        return Answer(
            forces=forces,
            objective=cost,
            duality_gap=gap,
            vertex_weights=weights,
            worst_vertex=int(np.argmax(problem.vertex_costs(forces, u))),
            unallocated=u - problem.effectiveness @ forces,
            saturation=saturation(problem, forces, box),
            status=status,
            iterations=found.iterations,
            claimed=found.claimed,
            backend=self.backend,
            seconds=seconds,
            solver_seconds=found.seconds,
        )


def solve(
    problem: AllocationProblem, command: Any, previous: Any = None, *, backend: str = "clarabel", **options: Any
) -> Answer:
    """Return the allocation of one command; arguments as for `Allocator` and `Allocator.solve`."""
    return Allocator(problem, backend, **options).solve(command, previous)
