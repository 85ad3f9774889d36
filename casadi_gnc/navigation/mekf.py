"""Attitude and gyro bias from a gyro and what sees stars, the field and the sun: a multiplicative Kalman filter.

==========  ==============================================================================  =====================
symbol      meaning                                                                         name in the code
==========  ==============================================================================  =====================
q           estimated attitude of the body from inertial, (4,)                              memory.attitude
b           estimated bias of the gyro, (3,), [rad/s]                                        memory.gyro_bias
a, e        errors left: true q = dq(a) q, (3,), [rad], body axes; true b = b + e
P           covariance of (a, e), (6, 6), kept as U D U'                                    factors
w           rate, the mean of the last and this reading less b, (3,), [rad/s]               rate
T           C(dq(w h)), how errors turn over a sample h
arw, rrw    random walks of the gyro's angle and bias                                       angle_random_walk, ...
==========  ==============================================================================  =====================

Over a sample, from a' = -w x a - e - noise and e' = noise,

    q = dq(w h) q,    F = [T, -(h - h^2/2 [w]x); 0, I],    Q = diag(arw^2 h + rrw^2 h^3/3, rrw^2 h).

Each measurement that is valid corrects (a, e) by scalars, with the slopes

    star tracker   z = 4 mrp(q_measured q^-1) in its own frame,   H = C_mounting
    unit vector    z = measured - C(q) known,                     H = [C(q) known]x

and then q = dq(a) q, b = b + e, a = e = 0. The turn dq(a) is made by MRPs a/4, which is a turn by a but for
abs(a)^3/48 and needs no trigonometry. A measurement that is further from the estimate than `gate` standard deviations
is
left out; after `patience` samples of which none fits, the filter goes on with its first covariance.

A tracker that is late is compared with the attitude of then: this one, turned back by what the gyro has told since.

A direction is linear in small errors only: what is left out is of the size of a^2/2, and is taken for further noise
of the variance (trace P_aa/2)^2, which vanishes as the filter settles (underweighting).

Source: Lefferts, Markley, Shuster (1982), doi:10.2514/3.56190; Markley (2003), doi:10.2514/2.5048;
underweighting: Zanetti, DeMars, Bishop, Journal of Guidance, Control, and Dynamics 33 (2010), 1670-1675.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import casadi as ca

from casadi_gnc.errors import LawError
from casadi_gnc.mathematics.exact import array, is_number
from casadi_gnc.mechanics import quaternions
from casadi_gnc.mechanics.sensor import Sensor
from casadi_gnc.mechanics.sensors import Gyro, Magnetometer, StarTracker, SunSensor
from casadi_gnc.navigation._navigation import Estimator
from casadi_gnc.navigation.square_root import Factors
from casadi_gnc.signals import Layout, Signal

_SIZE = 6
_POSITION = Signal("position", 3, "m")


@dataclass(frozen=True, eq=False)
class Mekf(Estimator):
    """Estimate attitude and gyro bias; the sensors given are what the software believes of them.

    Parameters
    ----------
    gyro : with its random walks.
    trackers, magnetometers, sun_sensors : each with its deviations, which are to hold what else is wrong too: of a
        magnetometer, the field's own model.
    field : function (t, position) -> (3,), [T], the field in the inertial frame as known on board.
    sun : function t -> (3,), unit vector to the sun in the inertial frame.
    attitude_deviation, bias_deviation : of the first estimate, each axis, [rad] and [rad/s].
    gate : standard deviations beyond which a measurement is left out.
    patience : samples with measurements that are all left out before the filter starts afresh.

    Raises
    ------
    LawError
        For a sensor without noise, or one whose direction nobody knows.
    """

    gyro: Gyro
    trackers: tuple[StarTracker, ...] = ()
    magnetometers: tuple[Magnetometer, ...] = ()
    sun_sensors: tuple[SunSensor, ...] = ()
    field: Callable[[Any, Any], Any] | None = None
    sun: Callable[[Any], Any] | None = None
    attitude_deviation: float = 0.6
    bias_deviation: float = 0.02
    gate: float = 6.0
    patience: int = 20

    def __post_init__(self) -> None:
        if not (self.trackers or self.magnetometers or self.sun_sensors):
            raise LawError("the filter has a gyro alone; expected a star tracker, a magnetometer or a sun sensor too")
        if self.magnetometers and self.field is None:
            raise LawError(f"{self.magnetometers[0].name}: the filter knows no field to compare with; give one")
        if self.sun_sensors and self.sun is None:
            raise LawError(f"{self.sun_sensors[0].name}: the filter does not know where the sun is; give an epoch")
        late = [each.name for each in (self.gyro, *self.magnetometers, *self.sun_sensors) if each.delay]
        if late:
            raise LawError(f"{late[0]} is late, which the filter bears of star trackers alone; leave its delay out")
        for name, value in self._noises():
            if is_number(value) and not (value > 0 and math.isfinite(value)):
                raise LawError(f"{name} is {value:g} for the filter, expected more than 0: what it takes for its noise")

    def _noises(self) -> list[tuple[str, Any]]:
        told = [(f"{self.gyro.name}: the angle random walk", self.gyro.angle_random_walk)]
        told += [(f"{each.name}: a deviation", one) for each in self.trackers for one in each.deviations]
        told += [(f"{each.name}: the deviation", each.deviation) for each in (*self.magnetometers, *self.sun_sensors)]
        told += [("attitude_deviation", self.attitude_deviation), ("bias_deviation", self.bias_deviation)]
        return [*told, ("gate", self.gate), ("patience", self.patience)]

    @property
    def inputs(self) -> Layout:
        """What the sensors measure, and the place where the field is asked for."""
        signals = [*self.gyro.measured.signals]
        for sensor in (*self.trackers, *self.magnetometers, *self.sun_sensors):
            signals += sensor.measured.signals
        return Layout((*signals, *((_POSITION,) if self.magnetometers else ())))

    @property
    def memory(self) -> Layout:
        """Estimate and its covariance, the last reading of the gyro, and how the filter goes."""
        return Layout(
            (
                Signal("attitude", 4, "-"),
                Signal("gyro_bias", 3, "rad/s"),
                Signal("covariance", _SIZE * (_SIZE + 1) // 2, ""),
                Signal("last_gyro", 3, "rad/s"),
                Signal("begun"),
                Signal("misfits"),
                *((Signal("turns", 4 * self._latest, "-"),) if self._latest else ()),
            )
        )

    @property
    def _latest(self) -> int:
        """Samples by which the latest tracker is late: so many turns are remembered, the last one first."""
        return max((each.delay for each in self.trackers), default=0)

    @property
    def outputs(self) -> Layout:
        """The bias, and the standard deviations that the filter gives itself."""
        return Layout(
            (
                Signal("gyro_bias_estimate", 3, "rad/s", "body"),
                Signal("attitude_deviation", 3, "rad", "body"),
                Signal("gyro_bias_deviation", 3, "rad/s", "body"),
            )
        )

    def _first(self) -> Factors:
        return Factors.diagonal([self.attitude_deviation**2] * 3 + [self.bias_deviation**2] * 3)

    def start(self, t: Any, y: Any) -> Any:
        """Return the first memory: the first tracker's attitude, or the inertial frame's where it has none; no bias."""
        now, attitude = self.inputs.split(y), ca.SX([1.0, 0.0, 0.0, 0.0])
        for tracker in reversed(self.trackers):
            seen = getattr(now, tracker.name)
            attitude = ca.if_else(_valid(now, tracker, seen), seen, attitude)
        return self.memory.pack(
            attitude=quaternions.normalised(attitude),
            gyro_bias=ca.DM.zeros(3),
            covariance=self._first().packed(),
            last_gyro=getattr(now, self.gyro.name),
            begun=ca.DM(0),
            misfits=ca.DM(0),
            **({"turns": ca.DM([1.0, 0.0, 0.0, 0.0] * self._latest)} if self._latest else {}),
        )

    def jump(self, t: Any, y: Any, m: Any, hold: float) -> Any:
        """Return the memory at this sample: moved on by the gyro, then corrected by what is valid."""
        now, memory = self.inputs.split(y), self.memory.split(m)
        gyro = getattr(now, self.gyro.name)
        moved, attitude, factors = self._moved(memory, gyro, hold * memory.begun)
        turns = ca.vertcat(moved, memory.turns[:-4]) if self._latest else ca.SX(0, 1)
        error: list[Any] = [ca.SX(0)] * _SIZE
        used, offered = ca.SX(0), ca.SX(0)
        for one in self._observations(t, now, attitude, turns):
            unsure = factors.variance(0) + factors.variance(1) + factors.variance(2)
            if one.is_direction:
                one = replace(one, variances=[variance + unsure * unsure / 4 for variance in one.variances])
            fits = ca.logic_and(one.valid, ca.sumsqr(one.difference) <= self.gate**2 * (unsure + sum(one.variances)))
            used, offered = ca.logic_or(used, fits), ca.logic_or(offered, one.valid)
            factors, error = _corrected(factors, error, one, fits)
        misfits = ca.if_else(used, 0.0, memory.misfits + offered)
        lost = misfits >= self.patience
        turn = quaternions.from_mrp(ca.vertcat(*error[:3]) / 4)
        return self.memory.pack(
            attitude=quaternions.normalised(quaternions.compose(turn, attitude)),
            gyro_bias=memory.gyro_bias + ca.vertcat(*error[3:]),
            covariance=ca.if_else(lost, self._first().packed(), factors.packed()),
            last_gyro=gyro,
            begun=ca.DM(1),
            misfits=ca.if_else(lost, 0.0, misfits),
            **({"turns": turns} if self._latest else {}),
        )

    def _moved(self, memory: Any, gyro: Any, h: Any) -> tuple[Any, Any, Factors]:
        """Return the turn of a time h [s], and attitude and covariance after it."""
        turn = ((memory.last_gyro + gyro) / 2 - memory.gyro_bias) * h
        # tan(x/4) = x/4 (1 + x^2/48 + ...): a turn by 0.1 rad is exact to 2e-9 rad.
        moved = quaternions.from_mrp(turn / 4 * (1 + ca.sumsqr(turn) / 48))
        attitude = quaternions.compose(moved, memory.attitude)
        transition = ca.SX.eye(_SIZE)
        transition[:3, :3] = quaternions.dcm(moved)
        transition[:3, 3:] = -h * (ca.DM.eye(3) - ca.skew(turn) / 2)
        arw, rrw = self.gyro.angle_random_walk**2, self.gyro.bias_random_walk**2
        noise = [arw * h + rrw * h * h * h / 3] * 3 + [rrw * h] * 3
        return moved, attitude, Factors.unpacked(memory.covariance, _SIZE).moved(transition, noise)

    def _observations(self, t: Any, now: Any, attitude: Any, turns: Any) -> list[_Observation]:
        """Return what the sensors say of the error, before any of it is used."""
        found = []
        for tracker in self.trackers:
            seen, mounting = getattr(now, tracker.name), array(tracker.mounting)
            then = attitude
            for i in range(tracker.delay):
                then = quaternions.compose(quaternions.conjugate(turns[4 * i : 4 * i + 4]), then)
            difference = 4 * quaternions.to_mrp(quaternions.relative(seen, then))
            variances = [deviation**2 for deviation in tracker.deviations]
            slope, turned = quaternions.dcm(mounting), quaternions.turned(mounting, difference)
            if tracker.delay:  # what is wrong now was wrong then, in the axes of then
                slope = ca.mtimes(slope, quaternions.dcm(quaternions.relative(then, attitude)))
            found.append(_Observation(slope, turned, variances, _valid(now, tracker, seen)))
        for magnetometer in self.magnetometers:
            assert self.field is not None
            known = self.field(t, now.position)
            strength = ca.sqrt(ca.sumsqr(known))
            expected, seen = quaternions.turned(attitude, known / strength), getattr(now, magnetometer.name)
            variance, valid = (magnetometer.deviation / strength) ** 2, _valid(now, magnetometer)
            found.append(_Observation(ca.skew(expected), seen / strength - expected, [variance] * 3, valid, True))
        for sensor in self.sun_sensors:
            assert self.sun is not None
            expected, seen = quaternions.turned(attitude, self.sun(t)), getattr(now, sensor.name)
            valid = _valid(now, sensor, seen)
            found.append(_Observation(ca.skew(expected), seen - expected, [sensor.deviation**2] * 3, valid, True))
        return found

    def estimate(self, t: Any, y: Any, m: Any) -> SimpleNamespace:
        """Return the attitude and the gyro's rate less its bias."""
        memory = self.memory.split(m)
        rate = getattr(self.inputs.split(y), self.gyro.name) - memory.gyro_bias
        return SimpleNamespace(quaternion=memory.attitude, rate=rate)

    def show(self, t: Any, y: Any, m: Any) -> dict[str, Any]:
        """Return the bias and the filter's own standard deviations."""
        memory = self.memory.split(m)
        factors = Factors.unpacked(memory.covariance, _SIZE)
        deviations = [ca.sqrt(factors.variance(i)) for i in range(_SIZE)]
        return {
            "gyro_bias_estimate": memory.gyro_bias,
            "attitude_deviation": ca.vertcat(*deviations[:3]),
            "gyro_bias_deviation": ca.vertcat(*deviations[3:]),
        }


@dataclass(frozen=True, eq=False)
class _Observation:
    """Three scalars linear in the error of attitude: difference = slope a + noise of these variances."""

    slope: Any
    difference: Any
    variances: list[Any]
    valid: Any
    is_direction: bool = False


def _corrected(factors: Factors, error: list[Any], one: _Observation, fits: Any) -> tuple[Factors, list[Any]]:
    """Return the factors and the error after an observation, if it fits."""
    for i in range(3):
        # With a row of zeros nothing changes, neither the estimate nor its covariance.
        row = [ca.if_else(fits, one.slope[i, k], 0.0) if _entry(one.slope, i, k) else ca.SX(0) for k in range(3)]
        factors, gain = factors.told(row + [ca.SX(0)] * 3, one.variances[i])
        left = ca.if_else(fits, one.difference[i], 0.0) - sum(h * e for h, e in zip(row, error[:3], strict=True))
        error = [e + k * left for e, k in zip(error, gain, strict=True)]
    return factors, error


def _entry(matrix: Any, i: int, k: int) -> bool:
    """Tell whether an entry of a matrix is other than the number 0."""
    return not ca.SX(matrix[i, k]).is_zero()


def _valid(now: Any, sensor: Sensor, unit: Any = None) -> Any:
    """Return whether a value may be used: told so, and, where it should be of unit length, nearly so."""
    told = getattr(now, f"{sensor.name}_valid") > 0.5 if sensor.is_partial else ca.SX(1)
    return told if unit is None else ca.logic_and(told, ca.fabs(ca.sumsqr(unit) - 1) < 0.1)
