"""Least propellant under exact priorities and linear limits: a ladder of linear programs, each held by the next.

With levels of rows, the first the most important, errors of a level summed over its rows under the worst error of the
geometry,

    e_l(F) = max_v sum_{r in level l} |u - (A + D_v E) F|_r,        G F <= g,      lower <= F <= upper,

first e_1 is made least, then e_2 among the forces that leave e_1 there, and so on; at last the propellant

    p(F) = sum_i M1_i |F_i - Fs_i|

among the forces that leave all errors where they are. No weight trades one level for another. Where no forces keep the
limits, they are broken as little as can be (each in proportion to its own size), before all else, and the status says
so. Every value is held with `SLACK` of the largest effort, since a solver knows equality to its tolerance only.

**Certificate.** Each program is min c'x over K x <= k and a finite box. For any multipliers y <= 0,

    c'x >= k'y + sum_i min over the box of (c - K'y)_i x_i,

which we evaluate from the data: HiGHS is asked for y and believed in nothing. An answer carries, for each level and for
the propellant, the value of its own forces and how far above this bound it is.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from casadi_gnc.allocation.allocator import LARGEST
from casadi_gnc.allocation.answer import ACCURACIES, AllocationStatus, Answer, Level, saturation
from casadi_gnc.allocation.problem import AllocationProblem
from casadi_gnc.errors import AllocationError, offer
from casadi_gnc.mathematics.arrays import real_array

#: Of the largest effort, and of a limit's size: by how much a value that was found may be left by what comes after.
SLACK = 1e-9
#: Of the largest effort or propellant: a gap below is the linear programs' rounding.
ROUNDING = 1e-8
_TOLERANCE = 1e-10  # HiGHS takes none below


@dataclass(frozen=True, eq=False)
class Limit:
    """Bound a weighted sum of the forces: ``coefficients @ F <= most``.

    Parameters
    ----------
    coefficients : (N,), in units of the limit per force.
    most : in the unit of the limit.
    """

    coefficients: Any
    most: float


@dataclass(frozen=True, eq=False)
class _Solved:
    x: np.ndarray
    bound: float
    multipliers: np.ndarray
    iterations: int


class LeastPropellant:
    """Allocate command after command with least propellant, errors before it in the order of their levels.

    Parameters
    ----------
    problem : its change and accuracy weights are not looked at; M1 is the propellant per force.
    priorities : level of each row of effort, (R,), 0 the most important; one level if left out.
    limits : G and g.
    accuracy : "low", "mid" or "high": to which gap an answer counts as certified.

    Raises
    ------
    AllocationError
        Where a size is wrong, or nothing costs propellant.

    Examples
    --------
    >>> import numpy as np
    >>> problem = AllocationProblem(np.array([[1.0, 2.0]]), lower=0.0, upper=2.0, max_step=np.inf)
    >>> LeastPropellant(problem).solve([3.0]).forces.round(6).tolist()
    [0.0, 1.5]
    >>> LeastPropellant(problem, limits=[Limit([0.0, 1.0], 1.0)]).solve([3.0]).forces.round(6).tolist()
    [1.0, 1.0]
    """

    def __init__(
        self,
        problem: AllocationProblem,
        priorities: Sequence[int] | None = None,
        limits: Sequence[Limit] = (),
        *,
        accuracy: str = "mid",
    ) -> None:
        rows, count = problem.effectiveness.shape
        given = [0] * rows if priorities is None else list(priorities)
        if len(given) != rows or min(given) < 0:
            raise AllocationError(
                f"{len(given)} priorities for {rows} rows of effort; expected one whole number from 0 for each"
            )
        if not np.any(problem.effort_weights):
            raise AllocationError(
                "no force costs propellant: the effort weights are zero; give one a weight above zero"
            )
        self.problem, self._accuracy = problem, _relative(accuracy)
        self.previous = np.clip(np.zeros(count), problem.lower, problem.upper)
        self._levels = [np.flatnonzero(np.array(given) == level) for level in sorted(set(given))]
        reach = np.maximum(np.abs(problem.lower), np.abs(problem.upper))
        self._reach = np.where(reach > 0, reach, 1.0)
        self._full = problem.full_effort or 1.0
        self._spent = float(problem.effort_weights @ (self._reach + np.abs(problem.preferred))) or 1.0
        self._limits = np.array([_row(limit.coefficients, count) for limit in limits]).reshape(len(limits), count)
        self._most = np.array([float(limit.most) for limit in limits])
        size = np.maximum(np.abs(self._limits * self._reach).sum(axis=1), np.abs(self._most))
        self._size = np.where(size > 0, size, 1.0)
        self._build()

    def asking(self, accuracy: str) -> LeastPropellant:
        """Return one of the same data that certifies to another accuracy."""
        other = copy(self)
        other._accuracy = _relative(accuracy)
        return other

    @property
    def level_count(self) -> int:
        """Number of exact priorities."""
        return len(self._levels)

    @property
    def has_limits(self) -> bool:
        """Whether there are linear limits."""
        return bool(len(self._most))

    def _build(self) -> None:
        """Lay out x = (forces, errors, levels, propellant, breach), in units near one, and the inequalities."""
        from scipy import sparse

        problem = self.problem
        vertices, rows, count = problem.vertices.shape
        levels, errors = len(self._levels), vertices * rows
        self._at = np.cumsum([0, count, errors, levels, count, 1])
        effort = sparse.csr_matrix((problem.vertices * self._reach / self._full).reshape(errors, count))
        one, each = sparse.identity(errors), sparse.identity(count)
        sums = sparse.lil_matrix((vertices * levels, errors))
        for v in range(vertices):
            for place, members in enumerate(self._levels):
                sums[v * levels + place, v * rows + members] = 1.0
        which = sparse.csr_matrix(np.tile(np.eye(levels), (vertices, 1)))
        none = None
        blocks = [
            [effort, -one, none, none, none],
            [-effort, -one, none, none, none],
            [none, sums.tocsr(), -which, none, none],
            [each, none, none, -each, none],
            [-each, none, none, -each, none],
            [none, none, none, none, sparse.csr_matrix((0, 1))],
        ]
        if len(self._most):
            scaled = sparse.csr_matrix(self._limits * self._reach / self._size[:, None])
            blocks[-1] = [scaled, none, none, none, sparse.csr_matrix(-np.ones((len(self._most), 1)))]
        self._matrix: Any = sparse.bmat(blocks, format="csr")

    def solve(self, command: ArrayLike, previous: ArrayLike | None = None) -> Answer:
        """Return the allocation of a command (R,); the last forces are the previous ones by default.

        Raises
        ------
        AllocationError
            For a wrong shape. Numbers that are not finite give the status BAD_COMMAND.
        """
        problem = self.problem
        u = real_array("command", command, AllocationError)
        last = self.previous if previous is None else real_array("previous", previous, AllocationError)
        rows, count = problem.effectiveness.shape
        if u.shape != (rows,) or last.shape != (count,):
            raise AllocationError(
                f"command has shape {u.shape}, expected ({rows},); previous {last.shape}, expected ({count},)"
            )
        if not (np.all(np.abs(u) <= LARGEST) and np.all(np.abs(last) <= LARGEST)):
            kept = np.clip(np.where(np.abs(last) <= LARGEST, last, self.previous), problem.lower, problem.upper)
            return self._told(np.zeros(rows), kept, problem.box(kept), [], AllocationStatus.BAD_COMMAND)
        box = problem.box(last)
        solved = self._climb(u, box)
        if solved is None:
            return self._told(u, np.clip(last, *box), box, [], AllocationStatus.FAILED)
        return self._told(u, np.clip(solved[-1].x[:count] * self._reach, *box), box, solved, None)

    def _climb(self, u: np.ndarray, box: tuple[np.ndarray, np.ndarray]) -> list[_Solved] | None:
        """Return what each program found, in order: limits (where there are any), levels, propellant."""
        problem, at = self.problem, self._at
        target = np.tile(u / self._full, len(problem.vertices))
        wanted = problem.preferred / self._reach
        right = np.concatenate([target, -target, np.zeros(len(problem.vertices) * len(self._levels)), wanted, -wanted])
        right = np.concatenate([right, self._most / self._size])
        lower, upper = np.zeros(at[-1]), np.empty(at[-1])
        lower[: at[1]], upper[: at[1]] = box[0] / self._reach, box[1] / self._reach
        made = np.abs(problem.vertices * self._reach / self._full).reshape(at[2] - at[1], -1).sum(axis=1)
        upper[at[1] : at[2]] = np.abs(target) + made + 1.0
        upper[at[2] : at[3]] = upper[at[1] : at[2]].sum()
        upper[at[3] : at[4]] = 2.0 + np.abs(wanted)
        upper[at[4] :] = 3.0 if len(self._most) else 0.0
        found: list[_Solved] = []
        stages = [*([at[4]] if len(self._most) else []), *range(at[2], at[3])]
        for stage in stages:
            cost = np.zeros(at[-1])
            cost[stage] = 1.0
            one = _linear_program(cost, self._matrix, right, lower, upper)
            if one is None:
                return None
            found.append(one)
            upper[stage] = max(one.x[stage], 0.0) + SLACK
        cost = np.zeros(at[-1])
        cost[at[3] : at[4]] = problem.effort_weights * self._reach / self._spent
        one = _linear_program(cost, self._matrix, right, lower, upper)
        return None if one is None else [*found, one]

    def _told(
        self,
        u: np.ndarray,
        forces: np.ndarray,
        box: tuple[np.ndarray, np.ndarray],
        solved: list[_Solved],
        status: AllocationStatus | None,
    ) -> Answer:
        problem, vertices = self.problem, len(self.problem.vertices)
        missing = np.abs(problem.missing(forces, u))
        spent = float(problem.effort_weights @ np.abs(forces - problem.preferred))
        weights, gap = np.full(vertices, 1 / vertices), float("inf")
        stages = solved[-1 - len(self._levels) : -1]
        bounds = [one.bound for one in stages] or [-np.inf] * len(self._levels)  # nothing solved: nothing proved
        levels = []
        for members, bound in zip(self._levels, bounds, strict=True):
            error = float(missing[:, members].sum(axis=1).max())
            levels.append(Level(tuple(int(r) + 1 for r in members), error, error - bound * self._full))
        if solved:
            gap = spent - solved[-1].bound * self._spent
            first = self._multipliers_of_vertices(stages[0])
            weights = first / first.sum() if first.sum() > 0 else weights
        if status is None:
            status = self._judged(forces, levels, spent, gap)
        self.previous = forces.copy()
        return Answer(
            forces=forces,
            objective=spent,
            duality_gap=gap,
            vertex_weights=weights,
            worst_vertex=int(np.argmax(missing.sum(axis=1))),
            unallocated=u - problem.effectiveness @ forces,
            saturation=saturation(problem, forces, box),
            status=status,
            iterations=sum(one.iterations for one in solved),
            claimed=bool(solved),
            backend="linear programs",
            levels=tuple(levels),
        )

    def _multipliers_of_vertices(self, one: _Solved) -> np.ndarray:
        """Return the weights of the vertices in the first level's program, (V,), not normalised."""
        errors, levels = self._at[2] - self._at[1], len(self._levels)
        rows = one.multipliers[2 * errors : 2 * errors + len(self.problem.vertices) * levels]
        return -rows.reshape(-1, levels)[:, 0]

    def _judged(self, forces: np.ndarray, levels: list[Level], spent: float, gap: float) -> AllocationStatus:
        beyond = (self._limits @ forces - self._most) / self._size
        if np.max(beyond, initial=0.0) > ROUNDING:
            return AllocationStatus.LIMITS_BROKEN
        proved = [level.gap <= max(self._accuracy * level.error, ROUNDING * self._full) for level in levels]
        proved.append(gap <= max(self._accuracy * spent, ROUNDING * self._spent))
        return AllocationStatus.OPTIMAL if all(proved) else AllocationStatus.NOT_CERTIFIED


def _relative(accuracy: str) -> float:
    if accuracy not in ACCURACIES:
        raise AllocationError(f"accuracy {accuracy!r} is not known; {offer(accuracy, ACCURACIES)}")
    return ACCURACIES[accuracy][0]


def _row(coefficients: Any, count: int) -> np.ndarray:
    row = real_array("coefficients", coefficients, AllocationError)
    if row.shape != (count,) or not np.all(np.isfinite(row)):
        raise AllocationError(f"a limit has coefficients of shape {row.shape}, expected {count} finite numbers")
    return row


def _linear_program(
    cost: np.ndarray, matrix: Any, right: np.ndarray, lower: np.ndarray, upper: np.ndarray
) -> _Solved | None:
    """Return a minimiser and our own lower bound of the least value; None where HiGHS finds nothing."""
    from scipy.optimize import linprog

    options = {"primal_feasibility_tolerance": _TOLERANCE, "dual_feasibility_tolerance": _TOLERANCE}
    bounds = np.column_stack([lower, upper])
    found = linprog(cost, A_ub=matrix, b_ub=right, bounds=bounds, method="highs", options=options)
    if found.x is None or not np.all(np.isfinite(found.x)):
        return None
    y = np.minimum(np.asarray(found.ineqlin.marginals, dtype=float), 0.0)
    left = cost - matrix.T @ y
    bound = float(right @ y + np.minimum(left * lower, left * upper).sum())
    return _Solved(np.asarray(found.x), bound, y, int(found.nit))
