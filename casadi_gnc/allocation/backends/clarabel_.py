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

from casadi_gnc.allocation.backends import Capability, Found
from casadi_gnc.allocation.problem import AllocationProblem

CAPABILITIES = Capability.ROBUST | Capability.EXACT | Capability.SOCP
REQUIRES = ("clarabel",)


class _Cone:
    def __init__(self, problem: AllocationProblem, tolerance: float) -> None:
        self.problem = problem
        reach = np.maximum(np.abs(problem.lower), np.abs(problem.upper))
        self._reach = np.where(reach > 0, reach, 1.0)
        self._full = float(np.linalg.norm(problem.effectiveness * self._reach, 2)) or 1.0
        # The optimum of an attainable command is some 1e-5 of the full effort's cost: a unit of a
        # hundredth of the effort puts it near 1, where the solver's tolerances bite.
        self._effort = 1e-2 * self._full
        self._cost = 2 * problem.accuracy_weight * self._effort**2
        self._quadratic = 2 * (problem.effort_weight + problem.change_weight) * self._reach**2 / self._cost
        self._solver = self._set_up(len(self._reach), tolerance)

    def _set_up(self, count: int, tolerance: float) -> Any:
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
        settings.tol_gap_rel = settings.tol_feas = tolerance
        settings.tol_gap_abs = 1e-3 * tolerance
        quadratic = sparse.csc_matrix(np.diag(np.append(self._quadratic, 0.0)))
        lhs = sparse.csc_matrix(np.vstack(blocks))
        self._rhs = np.zeros(sum(len(block) for block in blocks))
        return clarabel.DefaultSolver(quadratic, np.zeros(count + 1), lhs, self._rhs, cones, settings)

    def find(self, command: np.ndarray, previous: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> Found:
        """Return Clarabel's forces and the vertex weights from its multipliers."""
        problem, count = self.problem, len(lower)
        rows, vertices = len(command), len(problem.vertices)
        # Forces in units of what the command needs: a small command is as well scaled as a large one.
        share = max(np.linalg.norm(command) / self._full, float(np.max(np.abs(lower) / self._reach)), 0.1)
        unit = share * self._reach
        pull = problem.effort_weight * problem.preferred + problem.change_weight * previous
        linear = np.append(-2 * pull * self._reach / (self._cost * share), 1.0)
        rhs = self._rhs
        rhs[:count], rhs[count : 2 * count] = upper / unit, -lower / unit
        cone = rhs[2 * count :].reshape(vertices, rows + 2)
        cone[:, 0], cone[:, 1:-1], cone[:, -1] = 1.0, np.sqrt(2) * command / (self._effort * share), -1.0
        self._solver.update(q=linear, b=rhs)
        solution = self._solver.solve()
        multipliers = np.array(solution.z[2 * count :]).reshape(vertices, rows + 2)
        return Found(
            forces=np.array(solution.x[:count]) * unit,
            weights=multipliers[:, 0] + multipliers[:, -1],
            iterations=int(solution.iterations),
            claimed=str(solution.status) == "Solved",
            seconds=float(solution.solve_time),
        )


def set_up(problem: AllocationProblem, *, tolerance: float = 1e-9) -> _Cone:
    """Return the cone program of a problem, factorised once; `tolerance` is Clarabel's own."""
    return _Cone(problem, tolerance)
