"""Robust allocation as a second-order cone program, solved by Clarabel.

With forces and effort in units of what the command needs,

    minimise x'diag(q)x/2 + c'x + t   subject to   |r_v|^2/2 <= t  for every vertex v,

where r_v is the scaled effort error at vertex v. The rotated cone becomes the ordinary one by
|(sqrt2 r_v, t - 1)| <= t + 1, and its multipliers give the vertex weights of the certificate.
Between samples only c and the right-hand side change, so the factorised set-up is reused.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from casadi_gnc.allocation.problem import AllocationProblem
from casadi_gnc.signals import Layout, Signal
from casadi_gnc.status import StepStatus

#: Duality gap, relative to the cost, above which an answer is reported as inexact.
TOLERANCE = 1e-6
#: Gap allowed whatever the cost, as a share of h |full effort|^2: 1e-5 of the effort, squared.
ROUNDING_FLOOR = 1e-10


class ConeAllocator:
    """Solve one allocation a sample; every answer is clipped into its box and certified."""

    report = Layout((Signal("duality_gap"), Signal("allocation_cost"), Signal("worst_vertex"), Signal("iterations")))

    def __init__(self, problem: AllocationProblem) -> None:
        self.problem = problem
        reach = np.maximum(np.abs(problem.lower), np.abs(problem.upper))
        self._reach = np.where(reach > 0, reach, 1.0)
        self._full = float(np.linalg.norm(problem.effectiveness * self._reach, 2)) or 1.0
        # The optimum of an attainable command is some 1e-5 of the full effort's cost: a unit of a
        # hundredth of the effort puts it near 1, where the solver's tolerances bite.
        self._effort = 1e-2 * self._full
        self._cost = 2 * problem.accuracy_weight * self._effort**2
        self._quadratic = 2 * (problem.effort_weight + problem.change_weight) * self._reach**2 / self._cost
        self._solver = self._set_up(len(self._reach))

    def _set_up(self, count: int) -> Any:
        from importlib import import_module

        from scipy import sparse

        clarabel: Any = import_module("clarabel")  # lazily, and it tells type checkers nothing
        rows, vertices = self.problem.effectiveness.shape[0], self.problem.vertices
        blocks = [np.hstack([np.eye(count), np.zeros((count, 1))]), np.hstack([-np.eye(count), np.zeros((count, 1))])]
        for vertex in vertices:
            block = np.zeros((rows + 2, count + 1))
            block[0, count] = block[rows + 1, count] = -1.0
            block[1 : rows + 1, :count] = np.sqrt(2) * vertex * self._reach / self._effort
            blocks.append(block)
        cones = [clarabel.NonnegativeConeT(2 * count)] + [clarabel.SecondOrderConeT(rows + 2)] * len(vertices)
        settings = clarabel.DefaultSettings()
        settings.verbose = False
        settings.presolve_enable = False
        settings.tol_gap_abs, settings.tol_gap_rel, settings.tol_feas = 1e-12, 1e-9, 1e-9
        quadratic = sparse.csc_matrix(np.diag(np.append(self._quadratic, 0.0)))
        lhs = sparse.csc_matrix(np.vstack(blocks))
        self._rhs = np.zeros(sum(len(block) for block in blocks))
        return clarabel.DefaultSolver(quadratic, np.zeros(count + 1), lhs, self._rhs, cones, settings)

    def solve(
        self, command: np.ndarray, previous: np.ndarray, lower: np.ndarray, upper: np.ndarray
    ) -> tuple[np.ndarray, StepStatus, np.ndarray]:
        """Return forces (N,) inside the box, status bits, and the numbers of `report`.

        A failed solve keeps the previous forces, moved into the box.
        """
        problem, count = self.problem, len(lower)
        rows, vertices = len(command), len(problem.vertices)
        # Forces in units of what the command needs: a small command is as well scaled as a large one.
        share = max(np.linalg.norm(command) / self._full, float(np.max(np.abs(lower) / self._reach)), 0.1)
        unit = share * self._reach
        linear = np.append(-2 * problem.change_weight * previous * self._reach / (self._cost * share), 1.0)
        rhs = self._rhs
        rhs[:count], rhs[count : 2 * count] = upper / unit, -lower / unit
        cone = rhs[2 * count :].reshape(vertices, rows + 2)
        cone[:, 0], cone[:, 1:-1], cone[:, -1] = 1.0, np.sqrt(2) * command / (self._effort * share), -1.0
        self._solver.update(q=linear, b=rhs)
        solution = self._solver.solve()
        forces = np.clip(np.array(solution.x[:count]) * unit, lower, upper)
        if not np.all(np.isfinite(forces)):
            forces = np.clip(previous, lower, upper)
            cost = problem.objective(forces, command, previous)
            return forces, StepStatus.ALLOCATION_FAILED, np.array([cost, cost, 0.0, float(solution.iterations)])
        multipliers = np.array(solution.z[2 * count :]).reshape(vertices, rows + 2)
        weights = multipliers[:, 0] + multipliers[:, -1]
        gap = problem.gap(forces, weights, command, previous, lower, upper)
        cost = problem.objective(forces, command, previous)
        floor = ROUNDING_FLOOR * problem.accuracy_weight * self._full**2
        status = StepStatus(0) if gap <= TOLERANCE * cost + floor else StepStatus.ALLOCATION_INEXACT
        worst = int(np.argmax(problem.vertex_costs(forces, command)))
        return forces, status, np.array([gap, cost, float(worst), float(solution.iterations)])
