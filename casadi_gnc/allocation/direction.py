"""Keep the direction of a command that cannot be met: give up size, so that a saturated torque does not turn.

The largest s <= 1 with s u attainable by the nominal geometry is a linear program. Where no positive share is
attainable exactly (a stuck or always-on actuator, a lower bound above zero, a lost axis), the effort e = A F that turns
least from the command is taken, no longer than the command's projection on it where the bounds allow that.
tan(angle) = |e - (d'e) d| / d'e, d = u/|u|, is a ratio of a norm and a positive linear function; with G = t F,
t = 1/d'e, its least value is that of the quadratic program

    minimise |(I - d d') A G|^2   subject to   d'A G = 1,   t lower <= G <= t upper,   t >= 1/|u|

(A. Charnes, W. W. Cooper, 1962, doi:10.1002/nav.3800090303). Where it has no solution nothing can be made along the
command, and the forces are those of least error. In both cases the status says so.
"""

from __future__ import annotations

from dataclasses import replace
from importlib import import_module
from typing import Any

import numpy as np
import scipy.sparse as sp

from casadi_gnc.allocation.allocator import LARGEST, Allocator
from casadi_gnc.allocation.answer import AllocationStatus, Answer
from casadi_gnc.allocation.problem import AllocationProblem
from casadi_gnc.errors import AllocationError
from casadi_gnc.mathematics.arrays import real_array

_NOTHING = 1e-7  # shares below are the linear program's tolerance
_SIZE = 1e-9  # price of 1/size beside the square of tan(angle): of efforts in one direction the largest is taken


def largest_scale(problem: AllocationProblem, command: np.ndarray, previous: np.ndarray) -> float:
    """Return the largest s in [0, 1] for which A F = s u has forces inside the bounds.

    0 where not even the direction's start is attainable (bounds that force an effort elsewhere).
    """
    from scipy.optimize import linprog

    lower, upper = problem.box(previous)
    equality = np.hstack([problem.effectiveness, -np.asarray(command, dtype=float)[:, None]])
    scale = np.maximum(np.abs(equality).max(axis=1), 1e-300)  # rows of like size for the solver
    cost = np.zeros(problem.count + 1)
    cost[-1] = -1.0
    limits = [*zip(lower, upper, strict=True), (0.0, 1.0)]
    found = linprog(cost, A_eq=equality / scale[:, None], b_eq=np.zeros(len(equality)), bounds=limits, method="highs")
    return float(found.x[-1]) if found.status == 0 else 0.0


def along_direction(
    allocator: Allocator, command: np.ndarray, previous: np.ndarray | None = None
) -> tuple[Answer, float]:
    """Return the allocation of the part of a command whose direction is kept, and its share along the command.

    Where no positive share keeps the direction, the status is DIRECTION_TURNED and the effort has the least angle to
    the command that the bounds allow; where nothing can be made along the command it is DIRECTION_LOST, the share is
    0 and the forces are those of least error. For a problem of `by_priority` angles are those of its scaled rows.
    """
    last = allocator.previous if previous is None else real_array("previous", previous, AllocationError)
    problem, command = allocator.problem, real_array("command", command, AllocationError)
    if command.shape != (len(problem.effectiveness),) or last.shape != (problem.count,):
        return allocator.solve(command, last), 0.0  # which says what is wrong
    if not (np.all(np.abs(command) <= LARGEST) and np.all(np.abs(last) <= LARGEST)):
        return allocator.solve(command, last), 0.0
    share, wanted, status = largest_scale(problem, command, last), command, None
    size = float(np.linalg.norm(command))
    if share > _NOTHING or size == 0.0:
        wanted = share * command
    else:
        nearest = least_angle(problem, command, last)
        status = AllocationStatus.DIRECTION_LOST if nearest is None else AllocationStatus.DIRECTION_TURNED
        share = 0.0 if nearest is None else float(nearest @ command) / size**2
        wanted = command if nearest is None else nearest
    answer = allocator.solve(wanted, last)
    unallocated = command - problem.effectiveness @ answer.forces
    if status is not None and answer.status.is_certified:
        return replace(answer, unallocated=unallocated, status=status), share
    return replace(answer, unallocated=unallocated), share


def least_angle(problem: AllocationProblem, command: np.ndarray, previous: np.ndarray) -> np.ndarray | None:
    """Return the effort, (R,), with the least angle to a command, or None where none is below a right angle.

    Parameters
    ----------
    command : (R,), not zero. previous : (N,), forces of the last sample.
    """
    clarabel: Any = import_module("clarabel")  # its names are not known to type checkers

    lower, upper = problem.box(previous)
    reach = np.maximum(np.abs(lower), np.abs(upper))
    size = min(float(np.linalg.norm(command)), float(np.linalg.norm(problem.effectiveness * reach, 2)))
    if size <= 0:
        return None
    d = command / np.linalg.norm(command)
    unit = np.where(reach > 0, reach, 1.0)
    A, count = problem.effectiveness * unit / size, problem.count
    across = A - np.outer(d, d @ A)
    square = sp.block_diag([2 * across.T @ across, sp.csc_matrix((1, 1))], format="csc")
    price = np.append(np.zeros(count), _SIZE)
    low, high = (lower / unit)[:, None], (upper / unit)[:, None]
    rows = sp.csc_matrix(
        np.vstack(
            [
                np.append(d @ A, 0.0),
                np.hstack([-np.eye(count), low]),
                np.hstack([np.eye(count), -high]),
                np.append(np.zeros(count), -1.0),
            ]
        )
    )
    right = np.concatenate([[1.0], np.zeros(2 * count), [-1.0]])
    settings: Any = clarabel.DefaultSettings()
    settings.verbose, settings.tol_gap_abs, settings.tol_gap_rel, settings.tol_feas = False, 1e-11, 1e-11, 1e-11
    cones = [clarabel.ZeroConeT(1), clarabel.NonnegativeConeT(2 * count + 1)]
    found = clarabel.DefaultSolver(sp.triu(square, format="csc"), price, rows, right, cones, settings).solve()
    point = np.array(found.x)
    if "Solved" not in str(found.status) or not point[-1] > 0:
        return None
    forces = np.clip(unit * point[:-1] / point[-1], lower, upper)
    effort = problem.effectiveness @ forces
    if not float(d @ effort) > _NOTHING * size:
        return None
    with np.errstate(divide="ignore", invalid="ignore"):  # how small the forces may be made together
        smallest = np.where(forces > 0, lower / forces, np.where(forces < 0, upper / forces, 0.0))
    shrunk = max(float(np.max(smallest)), float(command @ effort) / float(effort @ effort))
    return min(shrunk, 1.0) * effort
