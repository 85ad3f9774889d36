"""Numbers of Huang and Duan (2019), doi:10.1109/ACCESS.2019.2949285, that no flight answers alone."""

from __future__ import annotations

from functools import cache
from itertools import product
from typing import Any

import numpy as np

import casadi_gnc
from casadi_gnc.allocation import AllocationProblem, solve
from casadi_gnc.allocation.attainable import attainable
from casadi_gnc.mechanics.actuator_faults import ActuatorFault
from casadi_gnc.mechanics.reaction_wheels import axes_as_points, corner_shifts
from casadi_gnc.missions.mission import Mission
from casadi_gnc.synthesis import Lmis, block_matrix

#: R_sc, Cbar and r_c0 as printed in section IV; entry (2,1) of R_sc is a misprint.
_ROTATION = np.array([[0.63708, 0.63708, -0.43388], [-0.87855, 0.61925, 0.78026], [0.76577, -0.45897, 0.45048]])
_MOUNTED = np.hstack([np.eye(3), np.full((3, 1), 1 / np.sqrt(3))])
_CENTRE = np.array([2.0, 2.0, 2.0])


def _configuration(error: Any = (0.0, 0.0, 0.0)) -> np.ndarray:
    """Return C of (4) and (7), (3, 4), where the mass centre is off by `error` [m]."""
    return np.array(axes_as_points(_ROTATION, _MOUNTED, _CENTRE + np.array(error)))


def _problem(**changes: Any) -> AllocationProblem:
    """Return the allocation of a torque on the wheels, without an uncertainty."""
    return AllocationProblem(_wheel_inertia() * _configuration(), **{"lower": -7.0, "upper": 7.0, **changes})


@cache
def _wheel_inertia() -> float:
    law: Any = casadi_gnc.load("huang2019/nominal").schemes[0].law
    return float(law.body.wheels.inertia)


# Geometry and authority.


def configuration_entry(row: int, column: int) -> float:
    """Return an entry of C_0 = R_sc (Cbar - r_c0), R_sc as printed; rows and columns from 1."""
    return float(_configuration()[row - 1, column - 1])


def uncertainty_entry(row: int, error_m: float) -> float:
    """Return an entry of the half width of Delta C, R_sc (e, e, e)', R_sc as printed; rows from 1."""
    return abs(float(corner_shifts(_ROTATION, [-error_m] * 3, [error_m] * 3)[-1][row - 1, 0]))


def effectiveness_rank() -> float:
    """Return the rank of C_0 J_w."""
    return float(np.linalg.matrix_rank(_problem().effectiveness))


def attainable_cube() -> float:
    """Return the half width of the largest cube of torques that the wheels make, [N m]."""
    return float(attainable(_problem(), np.ones(3)).nominal.box[0])


def _inverse(method: str) -> np.ndarray:
    """Return the matrix from torque to wheel accelerations, (4, 3), [rad/s^2 per N m], where no bound is met.

    "pinv" is the pseudo-inverse; "balanced" is that of accelerations that sum to zero, on which the
    mass centre has no influence: the limit of robust allocation for large h.
    """
    effectiveness = _problem().effectiveness
    if method == "pinv":
        return np.linalg.pinv(effectiveness)
    return np.linalg.inv(np.vstack([effectiveness, np.ones(4)]))[:, :3]


def largest_acceleration(method: str, torque_N_m: float) -> float:
    """Return the largest wheel acceleration, [rad/s^2], over all torques with that limit on each axis."""
    return float(torque_N_m * np.abs(_inverse(method)).sum(axis=1).max())


def mean_acceleration_bound(method: str, mean_torque_N_m: float) -> float:
    """Return what the mean norm of wheel accelerations is at most, [rad/s^2], for a mean norm of the torque.

    Holds where no bound is met. Robust allocation of any h costs less than the balanced accelerations
    do, which leave no error: so they bound its norm too.
    """
    return float(mean_torque_N_m * np.linalg.norm(_inverse(method), 2))


def torque_map_pole(error_m: float) -> float:
    """Return the least real part of the eigenvalues of C pinv(C_0) over the corners of the box of mass centres."""
    pinv = np.linalg.pinv(_configuration())
    corners = product((-error_m, error_m), repeat=3)
    return float(min(np.linalg.eigvals(_configuration(corner) @ pinv).real.min() for corner in corners))


def sdp_excess(error_m: float, accuracy_weight: float, samples: int) -> float:
    """Return by how much the optimum of (52) to (56) differs from that of (51), relative, at worst.

    (51) is solved as a quadratic program over the corners, (52) to (56) as linear matrix inequalities.
    """
    shifts = corner_shifts(_ROTATION, [-error_m] * 3, [error_m] * 3)
    coupling = np.full((1, 4), _wheel_inertia())
    problem = _problem(
        coupling=coupling, errors=shifts, effort_weight=1.0, change_weight=0.0, accuracy_weight=accuracy_weight
    )
    rng, worst = np.random.default_rng(1), 0.0
    for command in rng.uniform(-1, 1, (samples, 3)):
        cost = problem.objective(solve(problem, command).forces, command=command, previous=np.zeros(4))
        worst = max(worst, abs(_sdp_cost(problem, command) / cost - 1))
    return worst


def _sdp_cost(problem: AllocationProblem, command: np.ndarray) -> float:
    """Return the optimum of (52) to (56) at the corners, Y1 + Y2."""
    lmis = Lmis()
    x, effort, miss = lmis.rectangular("x", 4, 1), lmis.scalar("Y1"), lmis.scalar("Y2")
    lmis.psd(block_matrix([[np.eye(4), x], [effort]]), margin=0, name="(53)")
    for number, vertex in enumerate(problem.vertices):
        short = np.sqrt(float(problem.accuracy_weight)) * (command - vertex @ x)
        lmis.psd(block_matrix([[np.eye(3), short], [miss]]), margin=0, name=f"(54) at corner {number}")
    lmis.nonnegative(x - problem.lower, margin=0, name="(55)")
    lmis.nonnegative(problem.upper - x, margin=0, name="(56)")
    lmis.minimize(effort + miss)
    return lmis.solve().objective


# What the printed fault takes.


def _steady(problem: str) -> tuple[float, float]:
    """Return what axis 2 makes of its command once its faults have grown, and the least torque [N m] to be cancelled.

    The disturbance is taken to help against the bias as much as it can.
    """
    truth: Any = casadi_gnc.load(problem).truth
    own: list[ActuatorFault] = [fault for fault in truth.axis_faults.faults if fault.actuator == 2]
    share = float(np.prod([fault.effectiveness for fault in own]))
    disturbance = float(np.abs(np.array(truth.disturbance.amplitudes)[:, 1]).sum())
    return share, abs(sum(fault.bias for fault in own)) - disturbance


def static_torque(problem: str) -> float:
    """Return the least torque command on axis 2, [N m], that keeps the craft at rest under its faults."""
    share, left = _steady(problem)
    return left / share


def resting_mean(problem: str, from_s: float, until_s: float) -> float:
    """Return the least mean torque command from the start to `until_s` of a craft that rests after `from_s`.

    Nothing is asked of the time before: the turn may take as little as it likes.
    """
    return static_torque(problem) * (until_s - from_s) / until_s


def static_attitude(problem: str) -> float:
    """Return the least error of axis 2 at which the PD law commands what keeps the craft at rest."""
    law: Any = casadi_gnc.load(problem).scheme("pd_pinv").law
    return static_torque(problem) / float(law.attitude_gain)


# Flights.


def acceleration_ratio(problem: str) -> float:
    """Return the mean norm of wheel accelerations of robust allocation over that of the pseudo-inverse, same law."""
    mission = casadi_gnc.load(problem)
    robust, pinv = (_metrics(mission, name)["mean_acceleration"] for name in ("observers_robust", "observers_pinv"))
    return robust / pinv


def corners_lost(problem: str, scheme: str, error_m: float, threshold: float) -> float:
    """Return at how many of the eight corners of the box of mass centres the steady attitude exceeds a threshold."""
    lost = 0
    for corner in product((-error_m, error_m), repeat=3):
        mission = casadi_gnc.load(problem, {"truth.centre_of_mass_error_m": list(corner)})
        lost += not _metrics(mission, scheme)["steady_attitude"] <= threshold
    return float(lost)


def _metrics(mission: Mission, scheme: str) -> dict[str, Any]:
    flight = casadi_gnc.fly(mission.with_scheme(scheme), engine="vm", decimation=mission.timing.samples)
    return {name: np.nan if value is None else value for name, value in flight.metrics.items()}
