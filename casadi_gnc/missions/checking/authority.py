"""Can the actuators make what the law may ask for, and hold what pushes from outside?"""

from __future__ import annotations

from collections.abc import Iterator

import casadi as ca
import numpy as np
from scipy.optimize import linprog

from casadi_gnc.checks import Check
from casadi_gnc.missions.checking.linear import rows_of, target_state
from casadi_gnc.missions.mission import Mission, Scheme

#: Times of the flight at which disturbances are looked at.
_TIMES = 200


def checks(mission: Mission, scheme: Scheme) -> Iterator[Check]:
    """Yield rank, conditioning, the share of the virtual-control box that is made, and the static demand."""
    matrix = believed(mission, scheme)
    strength = np.linalg.svd(scale(scheme) @ matrix, compute_uv=False)
    rank_gap = float(strength[-1] / strength[0]) if strength[0] > 0 else 0.0
    yield Check(
        "geometry.effectiveness",
        rank_gap,
        1e-6,
        "-",
        "fail",
        "Some effort cannot be made by any combination of the actuators.",
        "Add or turn an actuator.",
        "smallest over largest singular value of the effectiveness, rows scaled by their limits",
        at_least=True,
    )
    share = attainable_share(mission, scheme)
    yield Check(
        "authority.virtual_control",
        share,
        1.0,
        "-",
        "note",
        "The law may ask for efforts that the actuators cannot make; what is missing is then up to the allocation.",
        "Shrink the limits of the effort to that share, or feed back the achieved effort.",
        "largest multiple of the box of limits, every corner of which the actuators can make",
        at_least=True,
    )
    demand = static_demand(mission, scheme)
    if np.isfinite(demand):
        yield Check(
            "authority.static_demand",
            demand,
            1.0,
            "-",
            "fail",
            "At rest at the target the disturbance alone needs more than the actuators and limits give.",
            "Raise the limits, add actuators, or accept that the target is not held.",
            "least share of actuator bounds and limits that cancels the plant's acceleration at the target",
        )


def believed(mission: Mission, scheme: Scheme) -> np.ndarray:
    """Return the believed effectiveness at the first measurement, (R, N)."""
    quiet = ca.DM.zeros(mission.truth.noise.size)
    y = ca.DM(mission.truth.measure(0.0, ca.DM(mission.start), quiet))
    return np.array(ca.DM(scheme.actuation.matrix(mission.truth.measurement.split(y))).full())


def scale(scheme: Scheme) -> np.ndarray:
    """Return the matrix that scales efforts by their limits, (R, R)."""
    below, above = (np.abs(np.array(each)) for each in (scheme.actuation.limit_below, scheme.actuation.limit_above))
    return np.diag(1 / np.maximum(below, above))


def attainable_share(mission: Mission, scheme: Scheme) -> float:
    """Return the largest s such that all corners of s times the box of limits can be made."""
    matrix, actuation = believed(mission, scheme), scheme.actuation
    corners = np.stack(
        np.meshgrid(*zip(actuation.limit_below, actuation.limit_above, strict=True), indexing="ij"), axis=-1
    )
    shares = []
    for corner in np.unique(corners.reshape(-1, matrix.shape[0]), axis=0):
        # Variables: actuators, s; matrix F = s corner.
        found = linprog(
            np.r_[np.zeros(matrix.shape[1]), -1.0],
            A_eq=np.column_stack([matrix, -corner]),
            b_eq=np.zeros(len(corner)),
            bounds=[*zip(actuation.lower, actuation.upper, strict=True), (0, 1e6)],
        )
        shares.append(found.x[-1] if found.status == 0 else 0.0)
    return float(min(shares))


def static_demand(mission: Mission, scheme: Scheme) -> float:
    """Return the largest share, over the flight, of bounds and limits needed to stand still at the target."""
    if not mission.target:
        return float("nan")
    plant, rows = mission.truth, rows_of(mission)
    t, actuators = ca.SX.sym("t"), plant.inputs.symbol("actuators")
    x = ca.DM(target_state(mission))
    rate = ca.SX(plant.rate(t, x, actuators, ca.DM.zeros(plant.noise.size)))[rows]
    pushed = ca.Function("pushed", [t], [ca.substitute(rate, actuators, 0), ca.jacobian(rate, actuators)])
    times = np.linspace(0, mission.timing.duration, _TIMES)
    drift = np.array(pushed.map(_TIMES)(times)[0])
    gain = np.array(pushed(0.0)[1])
    moved = np.abs(gain).max(axis=1) > 0
    actuation, matrix = scheme.actuation, believed(mission, scheme)
    extremes = {int(k) for row in drift[moved] for k in (row.argmin(), row.argmax())}
    shares = []
    for k in extremes:
        # Variables: actuators, s; bounds and limits grow with s.
        n = matrix.shape[1]
        lower, upper = np.array(actuation.lower), np.array(actuation.upper)
        above, below = np.array(actuation.limit_above), np.array(actuation.limit_below)
        found = linprog(
            np.r_[np.zeros(n), 1.0],
            A_ub=np.vstack(
                [
                    np.column_stack([np.eye(n), -upper]),
                    np.column_stack([-np.eye(n), lower]),
                    np.column_stack([matrix, -above]),
                    np.column_stack([-matrix, below]),
                ]
            ),
            b_ub=np.zeros(2 * n + 2 * len(matrix)),
            A_eq=np.column_stack([gain[moved], np.zeros(int(moved.sum()))]),
            b_eq=-drift[moved, k],
            bounds=[(None, None)] * n + [(0, None)],
        )
        shares.append(found.x[-1] if found.status == 0 else float("inf"))
    return float(max(shares, default=float("nan")))
