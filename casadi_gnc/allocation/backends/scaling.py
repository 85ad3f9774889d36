"""The problem in units near one, shared by the back ends; a second try where the first is inexact.

With forces F = s reach x and efforts in units of s w, where s is the share of a sample,

    minimise over low <= x <= high   x'diag(q)x/2 + c'x + t   s.t.  |B_v x - b|^2/2 <= t  for every v.

q and the B_v do not depend on the sample, so that set-ups are reused; c, b and the box do. Solvers are
exact to some digits of numbers near one: the share makes the optimal t such a number. It is guessed
from the command, and where our gap says that the answer is poor, taken from the cost that was found.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from contextlib import redirect_stdout
from dataclasses import dataclass, replace
from io import StringIO
from typing import Any

import numpy as np

from casadi_gnc.allocation.backends import Found
from casadi_gnc.allocation.problem import AllocationProblem
from casadi_gnc.errors import AllocationError

LEAST_SHARE = 1e-6


@dataclass(frozen=True, eq=False)
class Sample:
    """Hold what changes from sample to sample, in scaled units.

    Parameters
    ----------
    unit : (N,), [N] per scaled force.
    linear : c, (N,).
    target : b, (R,).
    lower, upper : (N,), the box of x.
    preferred, previous : (N,), the forces that the two quadratic terms pull to.
    """

    unit: np.ndarray
    linear: np.ndarray
    target: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    preferred: np.ndarray
    previous: np.ndarray


class ScaledSolver(ABC):
    """Solve in scaled units; a back end writes `attempt`.

    Attributes
    ----------
    effort_quadratic, change_quadratic : (N,), the two parts of q.
    quadratic : q, (N,), non-negative.
    matrices : B_v, (V, R, N).
    tries : at most this many shares are tried on a sample.
    enough : relative gap and rounding floor (share of h |full effort|^2) above which another is tried.
    """

    tries = 2
    enough = (1e-9, 1e-14)

    def __init__(self, problem: AllocationProblem) -> None:
        self.problem = problem
        reach = np.maximum(np.abs(problem.lower), np.abs(problem.upper))
        self._reach = np.where(reach > 0, reach, 1.0)
        self._full = float(np.linalg.norm(problem.effectiveness * self._reach, 2)) or 1.0
        # The optimum of an attainable command is some 1e-5 of the full effort's cost: a unit of a
        # hundredth of the effort puts it near 1, where the solvers' tolerances bite.
        self._effort = 1e-2 * self._full
        self._cost = 2 * problem.accuracy_weight * self._effort**2
        self.effort_quadratic = 2 * problem.effort_weights * self._reach**2 / self._cost
        self.change_quadratic = 2 * problem.change_weight * self._reach**2 / self._cost
        self.quadratic = self.effort_quadratic + self.change_quadratic
        self.matrices = self.in_units(problem.vertices)

    def in_units(self, effectiveness: np.ndarray) -> np.ndarray:
        """Return an effectiveness, (..., N), as scaled effort by scaled force."""
        return effectiveness * self._reach / self._effort

    @abstractmethod
    def attempt(self, sample: Sample) -> Found:
        """Return what the solver says of a scaled sample, `forces` being x."""

    def find(self, command: np.ndarray, previous: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> Found:
        """Return the solver's forces and vertex weights, of the better of the tries."""
        problem = self.problem
        forced = float(np.max(np.maximum(lower, -upper) / self._reach))
        share = max(float(np.linalg.norm(command)) / self._full, forced, 0.1)
        found, gap = self._try(share, command, previous, lower, upper)
        for _ in range(self.tries - 1):
            cost = problem.objective(np.clip(found.forces, lower, upper), command, previous)
            if gap <= max(self.enough[0] * cost, self.enough[1] * problem.accuracy_weight * self._full**2):
                break
            share = self._next(share, cost)
            other, better = self._try(share, command, previous, lower, upper)
            chosen, gap = (other, better) if better < gap else (found, gap)
            found = replace(
                chosen, iterations=found.iterations + other.iterations, seconds=found.seconds + other.seconds
            )
        return found

    def _next(self, share: float, cost: float) -> float:
        aim = max(0.3 * np.sqrt(cost / self._cost), LEAST_SHARE) if np.isfinite(cost) else 0.1 * share
        return aim if max(aim / share, share / aim) > 2 else 0.2 * aim  # the same once more is no second try

    def _try(
        self, share: float, command: np.ndarray, previous: np.ndarray, lower: np.ndarray, upper: np.ndarray
    ) -> tuple[Found, float]:
        sample = self._scaled(share, command, previous, lower, upper)
        found = self.attempt(sample)
        found = replace(found, forces=found.forces * sample.unit)
        if self.tries == 1 or not np.all(np.isfinite(found.forces)):
            return found, np.inf
        weights = np.ones(len(self.problem.vertices)) if found.weights is None else found.weights
        gap = self.problem.gap(np.clip(found.forces, lower, upper), weights, command, previous, lower, upper)
        return found, gap if np.isfinite(gap) else np.inf

    def _scaled(
        self, share: float, command: np.ndarray, previous: np.ndarray, lower: np.ndarray, upper: np.ndarray
    ) -> Sample:
        unit = share * self._reach
        preferred, last = self.problem.preferred / unit, previous / unit
        return Sample(
            unit=unit,
            linear=-self.effort_quadratic * preferred - self.change_quadratic * last,
            target=command / (self._effort * share),
            lower=lower / unit,
            upper=upper / unit,
            preferred=preferred,
            previous=last,
        )


class QuadraticProgram(ScaledSolver):
    """The scaled problem without uncertainty: minimise x'H x/2 + g'x over the box.

    Attributes
    ----------
    hessian : H = diag(q) + B'B, (N, N), positive semidefinite.
    equal : the vertex weights, (V,): all vertices are the same one.
    """

    def __init__(self, problem: AllocationProblem) -> None:
        super().__init__(problem)
        self._effectiveness = self.matrices[0]
        self.hessian = np.diag(self.quadratic) + self._effectiveness.T @ self._effectiveness
        self.equal = np.full(len(self.matrices), 1 / len(self.matrices))

    def gradient(self, sample: Sample) -> np.ndarray:
        """Return g = c - B'b, (N,)."""
        return sample.linear - self._effectiveness.T @ sample.target


class _Nowhere(StringIO):
    def write(self, text: str, /) -> int:
        return len(text)


def silence() -> redirect_stdout[_Nowhere]:
    """Keep what qpOASES and SCS print in spite of their options off `sys.stdout`, which they print to."""
    return redirect_stdout(_Nowhere())


def positive(**options: Any) -> None:
    """Refuse options that are not positive numbers.

    Raises
    ------
    AllocationError
        Naming the first one that is not.
    """
    for name, value in options.items():
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not 0 < value < np.inf:
            raise AllocationError(f"option {name} is {value!r}, expected a positive number")
