"""Many flights side by side of a turning body with sensors and a filter: truth and filter as one step, mapped.

What is drawn comes from the house's generator, a seed for each flight, so that flight 17 is flight 17 however many fly.
"""

from dataclasses import dataclass
from types import SimpleNamespace

import casadi as ca
import numpy as np

from casadi_gnc.mathematics import noise
from casadi_gnc.mathematics.integrators import runge_kutta
from casadi_gnc.mechanics import quaternions
from casadi_gnc.mechanics.sensors import Gyro, Magnetometer, StarTracker, SunSensor
from casadi_gnc.navigation import Mekf
from casadi_gnc.navigation.square_root import Factors
from casadi_gnc.signals import Layout

HOLD = 0.1
#: 0.02 degrees per root hour and a bias that wanders by 0.2 degrees an hour in an hour; a tracker of 10 arc seconds.
GYRO = Gyro("gyro", hold=HOLD, angle_random_walk=6e-6, bias_random_walk=1.6e-8)
MOUNTING = (0.9, 0.3, -0.1, 0.3)
TRACKER = StarTracker(
    "tracker", hold=HOLD, period=0.5, dropout=0.05, mounting=MOUNTING, across=5e-5, about=3e-4, max_rate=0.05
)
COMPASS = Magnetometer("magnetic_field", hold=HOLD, period=1.0, deviation=3e-7)
SUN = SunSensor("sun_direction", hold=HOLD, deviation=0.01)


def turning(t):
    """A slow tumble, (3,), [rad/s]."""
    return ca.vertcat(0.01 * ca.sin(0.05 * t), 0.02 * ca.cos(0.031 * t), 0.005 + 0.01 * ca.sin(0.02 * t + 1))


def field(t, position):
    """A field that turns as on a polar orbit, but faster, (3,), [T]."""
    return 3e-5 * ca.vertcat(ca.cos(0.01 * t), 0.3, ca.sin(0.01 * t))


def sun(t):
    """The sun stands still."""
    return ca.DM([0.6, 0.0, 0.8])


def filter_of(*sensors, **keys) -> Mekf:
    """Return a filter on the gyro and these sensors."""
    kinds = {"trackers": StarTracker, "magnetometers": Magnetometer, "sun_sensors": SunSensor}
    own = {name: tuple(each for each in sensors if isinstance(each, kind)) for name, kind in kinds.items()}
    return Mekf(GYRO, **own, field=field, sun=sun, **keys)


def normal(seeds: range, steps: int, count: int) -> np.ndarray:
    """Return standard normal numbers, (steps, count, flights)."""
    blocks = noise.uniform_count(count) // 2
    counters = np.arange(blocks, dtype=np.uint64)[None, :], np.arange(steps, dtype=np.uint64)[:, None]
    found = np.empty((steps, 2 * blocks, len(seeds)))
    zero = np.zeros((steps, blocks), dtype=np.uint64)
    for i, seed in enumerate(seeds):
        words = noise.philox((counters[0] + zero, zero, counters[1] + zero, zero), (seed, 0))
        pairs = [(high >> np.uint64(5)) * 67108864.0 + (low >> np.uint64(6)) for high, low in (words[:2], words[2:])]
        u, v = ((pair + 1.0) / 9007199254740992.0 for pair in pairs)
        radius = np.sqrt(-2 * np.log(u))
        found[:, 0::2, i], found[:, 1::2, i] = radius * np.cos(2 * np.pi * v), radius * np.sin(2 * np.pi * v)
    return found[:, :count]


@dataclass
class Flown:
    """What became of the flights: (steps, flights) of normalised squared errors, (steps, 6, flights) of errors."""

    nees: np.ndarray
    errors: np.ndarray
    measured: np.ndarray
    memory: np.ndarray


def step_of(mekf: Mekf) -> tuple[ca.Function, ca.Function, int]:
    """Return a step and the start as functions, and how many normal numbers a step takes."""
    sensors = (mekf.gyro, *mekf.trackers, *mekf.magnetometers, *mekf.sun_sensors)
    drawn = sum((each.noise for each in sensors), Layout())
    t, q, b = ca.SX.sym("t"), ca.SX.sym("q", 4), ca.SX.sym("b", 3)
    n, m = drawn.symbol("n"), mekf.memory.symbol("m")
    truth = SimpleNamespace(
        quaternion=q,
        rate=turning(t),
        magnetic_field=quaternions.turned(q, field(t, None)),
        sun=quaternions.turned(q, sun(t)),
        sunlight=1.0,
    )
    own, numbers, told = SimpleNamespace(gyro_bias=b), drawn.split(n), {"position": ca.SX.zeros(3)}
    for each in sensors:
        told.update(each.measure(t, truth, own, numbers))
    y = ca.vertcat(*(told[name] for name in mekf.inputs.names))
    later = runge_kutta(lambda at, x: quaternions.rate(x, turning(at)), t, q, HOLD)
    drift = b + HOLD * mekf.gyro.rate(t, own, numbers)["gyro_bias"]
    jumped = mekf.jump(t, y, m, HOLD)
    memory, estimate = mekf.memory.split(jumped), mekf.estimate(t, y, jumped)
    turn = quaternions.to_rotation_vector(quaternions.relative(q, estimate.quaternion))
    error = ca.vertcat(turn, b - memory.gyro_bias)
    factors = Factors.unpacked(memory.covariance, 6)
    white = ca.solve(ca.vertcat(*(ca.horzcat(*row) for row in factors.u)), error)
    nees = ca.sum1(white**2 / ca.vertcat(*factors.d))
    out = [quaternions.normalised(later), drift, jumped, nees, error, y]
    return ca.Function("step", [t, q, b, m, n], out), ca.Function("start", [t, q, b, n], [mekf.start(t, y)]), drawn.size


def fly(mekf: Mekf, turns: np.ndarray, biases: np.ndarray, steps: int) -> Flown:
    """Fly from true turns [rad] away from the inertial frame, and true biases [rad/s], (3, flights) each."""
    step, start, count = step_of(mekf)
    flights = turns.shape[1]
    numbers = normal(range(1, flights + 1), steps, count)
    q = np.hstack([np.array(quaternions.from_rotation_vector(ca.DM(turn))) for turn in turns.T])
    b, m = biases, np.array(start.map(flights)(np.zeros((1, flights)), q, biases, numbers[0]))
    many, found = step.map(flights), []
    for k in range(steps):
        q, b, m, *told = (np.array(each) for each in many(np.full((1, flights), k * HOLD), q, b, m, numbers[k]))
        found.append(told)
    nees, errors, measured = (np.array(each) for each in zip(*found, strict=True))
    return Flown(nees[:, 0, :], errors, measured, m)
