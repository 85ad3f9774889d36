"""What is left of pointing where actuators make pulses and sensors are noisy, against what the mission wants of it.

==========  ==============================================================================================
symbol      meaning
==========  ==============================================================================================
x           regulated states and memory of the loop, linearised at its target, x' = M x + B F
e_i         impulse that thruster i has not delivered yet, [N s], abs(e_i) <= b_i/2, b_i its least bit
h           sample period, [s]
P           covariance of the errors of attitude and gyro bias on the reference, (6, 6)
==========  ==============================================================================================

Pulses that carry over differ from what is asked by F_i = (e_i before - e_i)/h. Of all sequences e_i the worst turns
the body, along each axis, by the sum of abs(g_i) b_i/2 over all samples and thrusters, g_i the answer of the loop to
one e_i: an upper bound of the limit cycle, as long as the loop is linear.

P follows from the random walks of the gyro and the deviations of what sees stars, the field and the sun, with its
periods, eclipses and drop-outs, by the filter's own equations along the reference.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from casadi_gnc.checking.linear import held, loop_at, spectral_radius
from casadi_gnc.checking.settling import settled_at_the_end
from casadi_gnc.checks import Check
from casadi_gnc.mechanics import earth, quaternions
from casadi_gnc.mechanics.orbits import Orbit
from casadi_gnc.missions.linear_plant import rows_of
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.scheme import Scheme
from casadi_gnc.navigation import Mekf

if TYPE_CHECKING:
    from .craft import SatelliteCraft

#: Samples after which the answer of a loop that is stable counts as over.
_LONGEST = 20_000
#: Share of its largest value below which an answer counts as over.
_OVER = 1e-7
#: Updates of the filter that are followed at most.
_UPDATES = 3_000
_DEGREE = 180 / math.pi


def wanted(mission: Mission) -> float | None:
    """Return the smallest pointing error [rad] within which a metric of the mission wants the flight to end."""
    units = {"pointing_error": 1.0, "pointing_error_deg": 1 / _DEGREE}
    found = [m.threshold * units[m.signal] for m in settled_at_the_end(mission) if m.signal in units]
    return min(found, default=None)


def checks(craft: SatelliteCraft, mission: Mission, scheme: Scheme, limit: float) -> Iterator[Check]:
    """Yield the limit cycle of pulses and the noise of sensors, against the pointing [rad] that the mission wants."""
    still, own = held(mission, scheme)
    # Where valves wait for their turn, impulses are not within half a least bit: nothing is promised.
    if scheme.actuation.modulation is not None and craft.valves is None and still.target:
        turned = limit_cycle(craft, still, own)
        if turned is not None:
            yield Check(
                "authority.pulse_limit_cycle",
                _DEGREE * turned,
                _DEGREE * limit,
                "deg",
                "warn",
                "Pulses of the least bit may keep the attitude moving by more than the flight should settle within.",
                "Shorten least_on_s and quantum_s, lower max_force_N, or sample faster.",
                "largest angle of the linear loop under any impulses within half a least bit of each thruster",
            )
    estimator = getattr(scheme.navigation, "estimator", None)
    if isinstance(estimator, Mekf):
        yield Check(
            "noise.knowledge",
            3 * _DEGREE * knowledge(craft, mission, estimator),
            _DEGREE * limit,
            "deg",
            "warn",
            "Three deviations of what the filter knows of the attitude exceed what the flight should settle within.",
            "Take better or more frequent sensors, or a gyro with less random walk.",
            "covariance of the filter along the reference, its worst axis in the last quarter of the flight",
        )


def limit_cycle(craft: SatelliteCraft, mission: Mission, scheme: Scheme) -> float | None:
    """Return the angle [rad] that pulses alone cannot exceed; None where the linear loop is not stable."""
    loop, rows = loop_at(mission, scheme, mission.timing.duration), rows_of(mission)
    place = mission.truth.state.place("mrp")
    angles = [i for i, row in enumerate(rows) if place.start <= row < place.stop]
    if not loop.exists or spectral_radius(loop.moving) >= 1:
        return None
    first = mission.truth.inputs.place("force").start
    # Of a thruster that makes no pulses the least bit is 0.
    bits = np.array([each.least_bit for each in craft.thruster])
    moved, push = loop.matrix, loop.pushed_by_actuators[:, first : first + len(bits)]
    x = -push / mission.timing.sample_period
    total, largest = np.abs(x[angles]), np.abs(x[angles]).max()
    x = moved @ x - x
    for _ in range(_LONGEST):
        now = np.abs(x[angles])
        total, largest = total + now, max(largest, float(now.max()))
        if now.max() < _OVER * largest:
            break
        x = moved @ x
    return float(4 * np.linalg.norm(total @ bits / 2))


def knowledge(craft: SatelliteCraft, mission: Mission, estimator: Mekf) -> float:
    """Return the largest standard deviation [rad] of the attitude about any axis in the last quarter of the flight."""
    aids = (*estimator.trackers, *estimator.magnetometers, *estimator.sun_sensors)
    h, arw, rrw = mission.timing.sample_period, estimator.gyro.angle_random_walk**2, estimator.gyro.bias_random_walk**2
    # What speaks several times in a step that is followed counts as often.
    step = max(min(max(aid.period, h) for aid in aids), mission.timing.duration / _UPDATES)
    times = np.arange(1, max(2, int(mission.timing.duration / step))) * step
    seen: Any = _along(craft, estimator, step).map(len(times))(times[None])
    turns, *rest = (np.array(ca.DM(each).full()) for each in seen)
    P, worst = np.diag([estimator.attitude_deviation**2] * 3 + [estimator.bias_deviation**2] * 3), 0.0
    for k, t in enumerate(times):
        turn = turns[:, 3 * k : 3 * k + 3]
        F = np.eye(6)
        F[:3, :3] = turn
        F[:3, 3:] = -step * np.eye(3)
        P = F @ P @ F.T + np.diag([arw * step + rrw * step**3 / 3] * 3 + [rrw * step] * 3)
        if t >= 0.75 * mission.timing.duration:
            worst = max(worst, float(np.linalg.eigvalsh(P[:3, :3])[-1]))
        information = np.zeros((3, 3))
        for aid, column in zip(aids, rest, strict=True):
            period = max(aid.period, h)
            due = math.floor(t / period + 1e-9) - math.floor((t - step) / period + 1e-9)
            information += (1 - aid.dropout) * due * column[:, 3 * k : 3 * k + 3]
        H = np.hstack([information, np.zeros((3, 3))])
        P = np.linalg.solve(np.eye(6) + P[:, :3] @ H, P)
        P = (P + P.T) / 2
    return math.sqrt(worst)


def _along(craft: SatelliteCraft, estimator: Mekf, step: float) -> ca.Function:
    """Return t -> how errors turn over a step, and what each sensor says of the attitude there, H' R^-1 H, (3, 3)."""
    t, reference = ca.SX.sym("t"), craft.pointed()
    position, velocity = (
        (ca.SX.zeros(3), ca.SX.zeros(3)) if craft.orbit is None else Orbit(craft.orbit.elements()).at(t)
    )
    wanted = reference.at(t, SimpleNamespace(position=position, velocity=velocity))
    attitude, rate = ca.SX(wanted.quaternion), ca.SX(wanted.rate)
    told: list[Any] = []
    for tracker in estimator.trackers:
        mounting = quaternions.dcm(ca.DM(list(tracker.mounting)))
        slow = ca.sumsqr(rate) <= tracker.max_rate**2 if tracker.max_rate < math.inf else 1.0
        weights = ca.diag(ca.DM([1 / deviation**2 for deviation in tracker.deviations]))
        told.append(ca.if_else(slow, 1.0, 0.0) * ca.mtimes([mounting.T, weights, mounting]))
    for one in estimator.magnetometers:
        assert estimator.field is not None
        field = quaternions.turned(attitude, estimator.field(t, position))
        told.append(-ca.mtimes(ca.skew(field), ca.skew(field)) / one.deviation**2)
    for one in estimator.sun_sensors:
        assert estimator.sun is not None
        inertial = estimator.sun(t)
        sun = quaternions.turned(attitude, inertial)
        inside = ca.dot(ca.DM(list(one.axis)), sun) >= math.cos(one.view)
        lit = ca.logic_and(inside, earth.sunlight(position, inertial) > 0.5)
        told.append(-ca.if_else(lit, 1.0, 0.0) * ca.mtimes(ca.skew(sun), ca.skew(sun)) / one.deviation**2)
    turn = quaternions.dcm(quaternions.from_rotation_vector(step * rate))
    return ca.Function("along", [t], [turn, *map(ca.densify, told)])
