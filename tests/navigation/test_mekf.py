"""Truth: the distribution that errors of a right filter have, and what a filter must not be led astray by."""

import math

import casadi as ca
import numpy as np
import pytest
from filter_flights import COMPASS, GYRO, HOLD, SUN, TRACKER, filter_of, fly
from scipy.stats import chi2

from casadi_gnc.errors import LawError
from casadi_gnc.mechanics import quaternions
from casadi_gnc.mechanics.sensors import Gyro, StarTracker

SETS = {"tracker": (TRACKER,), "field and sun": (COMPASS, SUN), "all": (TRACKER, COMPASS, SUN)}


def starts(flights: int, angle: float, bias: float) -> tuple[np.ndarray, np.ndarray]:
    """Return turns and biases of normal size, (3, flights) each."""
    rng = np.random.default_rng(4)
    return angle * rng.standard_normal((3, flights)), bias * rng.standard_normal((3, flights))


def inside(nees: np.ndarray, confidence: float) -> bool:
    """Tell whether a mean of squared errors of six numbers lies in its band."""
    low, high = chi2.ppf([(1 - confidence) / 2, (1 + confidence) / 2], 6 * nees.size) / nees.size
    return low <= nees.mean() <= high


@pytest.mark.parametrize("name", SETS)
def test_the_filter_is_as_sure_as_it_may_be(name):
    """80 flights, at five times that are far apart: each in the band of 99.9 %."""
    mekf = filter_of(*SETS[name], attitude_deviation=0.2, bias_deviation=0.01)
    flown = fly(mekf, *starts(80, 0.2, 0.01), 241)
    for k in (0, 60, 120, 180, 240):
        assert inside(flown.nees[k], 0.999), (k, flown.nees[k].mean())


@pytest.mark.slow
@pytest.mark.parametrize("name", SETS)
def test_the_filter_is_consistent_over_a_thousand_flights(name):
    """The 95 % band of 1000 flights, at the end of each: 5.79 to 6.22; and all times together within 3 %."""
    mekf = filter_of(*SETS[name], attitude_deviation=0.2, bias_deviation=0.01)
    flown = fly(mekf, *starts(1000, 0.2, 0.01), 151)
    assert inside(flown.nees[-1], 0.95), flown.nees[-1].mean()
    assert flown.nees.mean() == pytest.approx(6, rel=0.03)


@pytest.mark.parametrize("name", ["field and sun", "all"])
def test_it_converges_from_thirty_degrees_and_one_degree_a_second(name):
    """Every flight of twenty, about every axis: within five of its own standard deviations after a minute."""
    axes = np.random.default_rng(2).standard_normal((2, 3, 20))
    turns, biases = (size * each / np.linalg.norm(each, axis=0) for size, each in zip((30.0, 1.0), axes, strict=True))
    flown = fly(filter_of(*SETS[name]), np.radians(turns), np.radians(biases), 601)
    assert flown.nees[-1].max() < 6 + 5 * math.sqrt(12)
    worst = np.degrees(np.linalg.norm(flown.errors[-1, :3], axis=0)).max()
    assert worst < (0.05 if name == "all" else 3.0)
    assert np.degrees(np.linalg.norm(flown.errors[-1, 3:], axis=0)).max() < 0.05


def stepped(mekf):
    """Return a sample of the filter, and its first memory, as functions of what is measured."""
    y, m = mekf.inputs.symbol("y"), mekf.memory.symbol("m")
    jump = ca.Function("jump", [y, m], [mekf.jump(0.0, y, m, HOLD)])
    return jump, ca.Function("start", [y], [mekf.start(0.0, y)])


def told(mekf, attitude, valid: float = 1.0, rate=(0.0, 0.0, 0.0)) -> ca.DM:
    return mekf.inputs.pack(gyro=ca.DM(list(rate)), tracker=ca.DM(attitude), tracker_valid=ca.DM(valid))


STILL, TURNED = [1.0, 0.0, 0.0, 0.0], [math.cos(0.3), 0.0, math.sin(0.3), 0.0]


def test_a_wrong_attitude_is_left_out_until_it_stays():
    """One sample that is 34 degrees off moves nothing; after `patience` of them the filter believes it."""
    mekf = filter_of(TRACKER, patience=20)
    jump, start = stepped(mekf)
    m = start(told(mekf, STILL))
    for _ in range(100):
        m = jump(told(mekf, STILL), m)
    quiet, fooled = jump(told(mekf, STILL, valid=0.0), m), jump(told(mekf, TURNED), m)
    attitude = mekf.memory.place("attitude")
    assert np.array_equal(np.array(quiet)[attitude], np.array(fooled)[attitude])
    for _ in range(25):
        m = jump(told(mekf, TURNED), m)
    turn = quaternions.to_rotation_vector(quaternions.relative(m[attitude], ca.DM(TURNED)))
    assert float(ca.norm_2(turn)) < 1e-3


@pytest.mark.parametrize("attitude", [[0.0, 0, 0, 0], [2.0, 0, 0, 0]])
def test_what_is_no_attitude_is_left_out(attitude):
    mekf = filter_of(TRACKER)
    jump, start = stepped(mekf)
    m = jump(told(mekf, attitude), start(told(mekf, attitude)))
    assert np.allclose(np.array(m)[mekf.memory.place("attitude")].ravel(), STILL)
    assert np.isfinite(np.array(m)).all()


def test_the_first_sample_does_not_move_on():
    """The gyro's first reading counts from the second sample on."""
    mekf = filter_of(TRACKER)
    jump, start = stepped(mekf)
    first = told(mekf, TURNED, rate=(0.1, 0.0, 0.0))
    m = jump(first, start(first))
    attitude = mekf.memory.place("attitude")
    assert np.allclose(np.array(m)[attitude].ravel(), TURNED, atol=1e-15)
    later = jump(told(mekf, TURNED, valid=0.0, rate=(0.1, 0.0, 0.0)), m)
    turn = quaternions.to_rotation_vector(quaternions.relative(later[attitude], m[attitude]))
    assert np.allclose(np.array(turn).ravel(), [0.1 * HOLD, 0, 0], atol=1e-15)


def test_it_shows_its_bias_and_deviations():
    mekf = filter_of(TRACKER, attitude_deviation=0.3, bias_deviation=0.01)
    _, start = stepped(mekf)
    y = told(mekf, STILL)
    shown = mekf.show(0.0, y, start(y))
    assert set(shown) == set(mekf.outputs.names)
    assert np.allclose(np.array(ca.DM(shown["attitude_deviation"])), 0.3)
    assert np.allclose(np.array(ca.DM(shown["gyro_bias_deviation"])), 0.01)


@pytest.mark.parametrize(
    ("make", "expected"),
    [
        (lambda: filter_of(), "gyro alone; expected a star tracker"),
        (lambda: filter_of(StarTracker("eye", hold=HOLD, across=1e-5)), "eye: a deviation is 0 for the filter"),
        (lambda: filter_of(TRACKER, gate=0.0), "gate is 0 for the filter"),
        (lambda: type(filter_of(SUN))(GYRO, sun_sensors=(SUN,)), "sun_direction: the filter does not know where"),
        (lambda: type(filter_of(SUN))(GYRO, magnetometers=(COMPASS,)), "magnetic_field: the filter knows no field"),
        (lambda: type(filter_of(SUN))(Gyro("g", hold=HOLD), (TRACKER,)), "g: the angle random walk is 0 for"),
    ],
)
def test_filters_that_cannot_be(make, expected):
    with pytest.raises(LawError, match=expected):
        make()
