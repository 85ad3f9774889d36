"""Reaction wheels as actuators, alone or beside thrusters.

The command of a wheel is its acceleration x_i [rad/s^2]; the effort is the torque C J_w x that
accelerates the body, with the spin axes in the columns of C. (The sign is the plant's: a wheel that
is spun up turns the body the other way, u = -C J_w x there.) Speed limits become bounds on the
acceleration of the next sample, and a preferred acceleration in the null space brings wheel speeds
back without torque.

Source: Huang and Duan (2019), doi:10.1109/ACCESS.2019.2949285, with wheel axes as free vectors
(C = R Cbar): a spin axis has a direction and no place, so no mass centre enters.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product

import casadi as ca
import numpy as np
from scipy.linalg import null_space

from casadi_gnc.allocation.problem import AllocationProblem
from casadi_gnc.errors import AllocationError
from casadi_gnc.mechanics.reaction_wheels import acceleration_bounds


@dataclass(frozen=True, eq=False)
class WheelSet:
    """Describe N wheels.

    Parameters
    ----------
    axes : C, (3, N), unit spin axes, body frame.
    inertia : J_w, of each wheel about its axis, [kg m^2].
    max_torque : of each motor, [N m].
    max_speed : [rad/s].
    """

    axes: np.ndarray
    inertia: float
    max_torque: float
    max_speed: float

    def __post_init__(self) -> None:
        axes = np.array(self.axes, dtype=float)
        if axes.ndim != 2 or axes.shape[0] != 3 or not np.allclose(np.linalg.norm(axes, axis=0), 1, atol=1e-4):
            raise AllocationError(f"wheel axes have shape {axes.shape}, expected 3 rows and columns of length 1")
        for name in ("inertia", "max_torque", "max_speed"):
            if not getattr(self, name) > 0:
                raise AllocationError(f"{name} is {getattr(self, name)}, expected a positive number")
        object.__setattr__(self, "axes", axes)

    def problem(self, **other: object) -> AllocationProblem:
        """Return the allocation of torque [N m] to wheel accelerations [rad/s^2]; `other` as weights."""
        largest = self.max_torque / self.inertia
        return AllocationProblem(self.axes * self.inertia, lower=-largest, upper=largest, **other)  # type: ignore[arg-type]

    def at_speed(
        self, problem: AllocationProblem, speed: np.ndarray, period: float, *, desaturation: float = 0.0
    ) -> AllocationProblem:
        """Return the problem of one sample at given wheel speeds.

        Parameters
        ----------
        problem : of `problem()`, perhaps with uncertainty or faults.
        speed : (N,), [rad/s].
        period : sample period, [s]: no wheel may pass its speed limit within it.
        desaturation : rate [1/s] at which speeds are brought to zero through the null space of the
            axes, where they make no torque; 0 leaves them.
        """
        speed = np.asarray(speed, dtype=float)
        if speed.shape != (problem.count,) or not period > 0:
            raise AllocationError(f"speed has shape {speed.shape}, expected ({problem.count},); period {period} > 0")
        box = (ca.DM(problem.lower), ca.DM(problem.upper))
        reachable = acceleration_bounds(ca.DM(speed), self.max_speed, period, *box)
        lower, upper = (np.array(bound).ravel() for bound in reachable)
        turning = problem.lower < problem.upper  # dead and stuck wheels take no part
        free, wanted = null_space(problem.effectiveness[:, turning]), np.zeros(problem.count)
        wanted[turning] = -desaturation * free @ (free.T @ speed[turning])
        return replace(problem, lower=lower, upper=upper, preferred=wanted)


def combine(*problems: AllocationProblem) -> AllocationProblem:
    """Return one problem that allocates the same effort to all actuators of several.

    The columns are put side by side in the given order; every error of one may meet every error of
    another, so the numbers of vertices multiply. Accuracy weights must agree.
    """
    first = problems[0]
    if len({len(p.effectiveness) for p in problems}) > 1 or len({p.accuracy_weight for p in problems}) > 1:
        raise AllocationError("problems to combine need the same rows of effort and the same accuracy_weight")
    joined = {
        name: np.concatenate([getattr(p, name) for p in problems])
        for name in ("lower", "upper", "effort_weight", "change_weight", "max_step", "preferred")
    }
    coupling = np.zeros((sum(len(p.coupling) for p in problems), sum(p.count for p in problems)))
    row = column = 0
    for p in problems:
        coupling[row : row + len(p.coupling), column : column + p.count] = p.coupling
        row, column = row + len(p.coupling), column + p.count
    return AllocationProblem(
        effectiveness=np.hstack([p.effectiveness for p in problems]),
        coupling=coupling,
        errors=np.array([np.hstack(corners) for corners in product(*(p.errors for p in problems))]),
        accuracy_weight=first.accuracy_weight,
        **joined,
    )
