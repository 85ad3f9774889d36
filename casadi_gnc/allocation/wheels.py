"""Reaction wheels as actuators, alone or beside thrusters.

The command of a wheel is its acceleration x_i [rad/s^2]; the effort is the torque on the body, -C J_w x, with
the spin axes in the columns of C (`casadi_gnc.mechanics.reaction_wheels`, the one convention). Speed limits
become bounds on the acceleration of the next sample, and a preferred acceleration in the null space brings
wheel speeds back without torque.

Source: Huang and Duan (2019), doi:10.1109/ACCESS.2019.2949285, with wheel axes as free vectors
(C = R Cbar): a spin axis has a direction and no place, so no mass centre enters.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import casadi as ca
import numpy as np
from scipy.linalg import null_space

from casadi_gnc.allocation.problem import AllocationProblem
from casadi_gnc.errors import AllocationError
from casadi_gnc.mathematics.arrays import real_array
from casadi_gnc.mechanics.reaction_wheels import WheelArray, acceleration_bounds


def wheel_problem(wheels: WheelArray, **other: object) -> AllocationProblem:
    """Return the allocation of torque on the body [N m] to wheel accelerations [rad/s^2].

    Parameters
    ----------
    wheels : with axes of length 1 and a largest acceleration.
    other : weights, as for `AllocationProblem`.

    Raises
    ------
    AllocationError
        For axes that are no unit vectors, or wheels without a largest acceleration.
    """
    axes = np.array(ca.DM(wheels.axes))
    if axes.shape[0] != 3 or not np.allclose(np.linalg.norm(axes, axis=0), 1, atol=1e-4):
        raise AllocationError(f"wheel axes have shape {axes.shape}, expected 3 rows and columns of length 1")
    if not np.isfinite(wheels.max_acceleration):
        raise AllocationError("the wheels have no largest acceleration; give max_acceleration")
    most, effectiveness = wheels.max_acceleration, np.array(ca.DM(wheels.effectiveness))
    return AllocationProblem(effectiveness, lower=-most, upper=most, **other)  # type: ignore[arg-type]


def at_speed(
    wheels: WheelArray, problem: AllocationProblem, speed: np.ndarray, period: float, *, desaturation: float = 0.0
) -> AllocationProblem:
    """Return the problem of one sample at given wheel speeds.

    Parameters
    ----------
    wheels : their largest speed counts.
    problem : of `wheel_problem`, perhaps with uncertainty or faults.
    speed : (N,), [rad/s].
    period : sample period, [s]: no wheel may pass its speed limit within it.
    desaturation : rate [1/s] at which speeds are brought to zero through the null space of the
        axes, where they make no torque; 0 leaves them.
    """
    speed = real_array("speed", speed, AllocationError)
    if speed.shape != (problem.count,) or not period > 0:
        raise AllocationError(f"speed has shape {speed.shape}, expected ({problem.count},); period {period} > 0")
    box = (ca.DM(problem.lower), ca.DM(problem.upper))
    reachable = acceleration_bounds(ca.DM(speed), wheels.max_speed, period, *box)
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
