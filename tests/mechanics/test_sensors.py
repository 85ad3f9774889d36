"""Truth: standard deviations of ten thousand draws, Allan's law of a random walk, and the definition of each error."""

from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from casadi_gnc.errors import FlightError
from casadi_gnc.mechanics.sensor import Sensor
from casadi_gnc.mechanics.sensors import Gyro, Magnetometer, StarTracker, SunSensor, Tachometers

HOLD = 0.1
COUNT = 10000
TRUTH = {"quaternion": 4, "rate": 3, "magnetic_field": 3, "sun": 3, "sunlight": 1, "wheel_speed": 4}
QUIET = {
    "quaternion": [0.5, 0.5, -0.5, 0.5],
    "rate": [0.01, -0.02, 0.03],
    "magnetic_field": [2e-5, -1e-5, 3e-5],
    "sun": [0.6, 0, 0.8],
    "sunlight": [1.0],
    "wheel_speed": [100.0, -50.0, 7.3, 0.0],
}


def measured(sensor: Sensor, noise: np.ndarray, t: float = 0.0, **changes) -> dict[str, np.ndarray]:
    """Return what a sensor measures for each column of normal numbers."""
    at, own, drawn = ca.SX.sym("t"), sensor.state.symbol("own"), sensor.noise.symbol("drawn")
    symbols = {name: ca.SX.sym(name, size) for name, size in TRUTH.items()}
    told = sensor.measure(at, SimpleNamespace(**symbols), sensor.state.split(own), sensor.noise.split(drawn))
    assert list(told) == list(sensor.measured.names)
    function = ca.Function("measure", [at, own, drawn, *symbols.values()], [ca.vertcat(*map(ca.SX, told.values()))])
    start = [value for values in sensor.start().values() for value in values]
    truth = {**QUIET, **changes}
    found = np.array(function.map(noise.shape[1])(t, start, noise, *(truth[name] for name in symbols)))
    return sensor.measured.columns(found.T)


def still(sensor: Sensor, **given) -> dict[str, np.ndarray]:
    return measured(sensor, np.zeros((sensor.noise.size, 1)), **given)


def test_gyro_with_scale_misalignment_and_bias():
    gyro = Gyro("gyro", hold=HOLD, bias=(1e-3, 0, -2e-3), scale=(0.01, 0, -0.02), misalignment=(0.0, 0.0, 0.1))
    w = np.array(QUIET["rate"])
    turned = (np.eye(3) - 0.1 * np.array([[0, -1, 0], [1, 0, 0], [0, 0, 0]])) @ w
    assert np.allclose(still(gyro)["gyro"], (1 + np.array([0.01, 0, -0.02])) * turned + [1e-3, 0, -2e-3], atol=1e-16)
    assert gyro.measured.names == ("gyro",)
    assert gyro.measured.signal("gyro").limit == 10.0


def test_gyro_walks_as_its_densities_say(rng):
    """After K samples angle and bias have the deviations arw sqrt(T) and rrw sqrt(T): 1000 walks, five sigma."""
    gyro = Gyro("gyro", hold=HOLD, angle_random_walk=1e-4, bias_random_walk=1e-5)
    noise = rng.standard_normal((gyro.noise.size, COUNT))
    white = measured(gyro, noise)["gyro"] - np.array(QUIET["rate"])
    angle = (white.reshape(1000, 10, 3) * HOLD).sum(axis=1)
    assert np.allclose(angle.std(axis=0), 1e-4 * np.sqrt(10 * HOLD), rtol=5 / np.sqrt(2000))
    drawn = gyro.noise.split(noise)
    walk = gyro.rate(0.0, None, SimpleNamespace(gyro_walk=drawn.gyro_walk))["gyro_bias"].T * HOLD
    bias = walk.reshape(1000, 10, 3).sum(axis=1)
    assert np.allclose(bias.std(axis=0), 1e-5 * np.sqrt(10 * HOLD), rtol=5 / np.sqrt(2000))


def test_star_tracker_is_wrong_about_its_own_axes(rng):
    mounting = np.array([0.8, 0.6, 0.0, 0.0])
    tracker = StarTracker("star", hold=HOLD, mounting=tuple(mounting), across=1e-4, about=1e-3)
    found = measured(tracker, rng.standard_normal((3, COUNT)))["star"]
    assert np.all(found[:, 0] >= 0)
    body = Rotation.from_quat(QUIET["quaternion"], scalar_first=True)
    # scipy's turns are of vectors within a frame: B from N seen in B is inverse(true) times measured.
    errors = (body.inv() * Rotation.from_quat(found, scalar_first=True)).as_rotvec()
    own = Rotation.from_quat(mounting, scalar_first=True).inv().apply(errors)
    assert np.allclose(own.std(axis=0), [1e-4, 1e-4, 1e-3], rtol=5 / np.sqrt(2 * COUNT))
    assert np.allclose(np.linalg.norm(found, axis=1), 1, atol=1e-14)


def test_star_tracker_gives_up_while_fast():
    tracker = StarTracker("star", hold=HOLD, max_rate=0.05)
    assert still(tracker)["star_valid"] == 1
    assert still(tracker, rate=[0.03, 0.03, 0.03])["star_valid"] == 0
    assert "star_valid" not in StarTracker("star", hold=HOLD).measured


def test_values_come_at_multiples_of_the_period_and_drop_out(rng):
    """At every sample of an hour, times as a flight makes them in double and in single precision."""
    slow = Magnetometer("field", hold=HOLD, period=0.5)
    for real in (np.float64, np.float32):
        due = ca.Function("due", [t := ca.SX.sym("t")], [slow._due(t)])
        times = (np.arange(36000).astype(real) * real(HOLD)).astype(float)
        assert np.array_equal(np.array(due(times[None])).ravel(), (np.arange(36000) % 5 == 0).astype(float))
    lossy = Magnetometer("field", hold=HOLD, dropout=0.1)
    valid = measured(lossy, rng.standard_normal((lossy.noise.size, COUNT)))["field_valid"]
    assert valid.mean() == pytest.approx(0.9, abs=5 * np.sqrt(0.09 / COUNT))


def test_magnetometer_and_tachometers(rng):
    compass = Magnetometer("field", hold=HOLD, deviation=1e-7, bias=(1e-6, 0.0, 0.0))
    found = measured(compass, rng.standard_normal((3, COUNT)))["field"]
    assert np.allclose(found.mean(axis=0), np.add(QUIET["magnetic_field"], [1e-6, 0, 0]), atol=5e-9)
    assert np.allclose(found.std(axis=0), 1e-7, rtol=5 / np.sqrt(2 * COUNT))
    wheels = Tachometers("wheel_speed", hold=HOLD, count=4, quantum=0.5)
    assert np.array_equal(still(wheels)["wheel_speed"][0], [100.0, -50.0, 7.5, 0.0])
    assert wheels.measured.of_kind("wheel_speed")


def test_sun_sensor_sees_by_day_and_within_its_cone(rng):
    sensor = SunSensor("sunsensor", hold=HOLD, deviation=0.01, view=0.7)
    found = measured(sensor, rng.standard_normal((3, COUNT)))["sunsensor"]
    assert np.allclose(np.linalg.norm(found, axis=1), 1, atol=1e-14)
    across = found @ np.array([0.8, 0, -0.6])
    assert across.std() == pytest.approx(0.01, rel=5 / np.sqrt(2 * COUNT))
    assert still(sensor)["sunsensor_valid"] == 1  # 0.64 rad from the axis
    assert still(sensor, sunlight=[0.0])["sunsensor_valid"] == 0
    assert still(sensor, sun=[0.8, 0, 0.6])["sunsensor_valid"] == 0


@pytest.mark.parametrize(
    ("keys", "told"),
    [
        ({"hold": 0.1, "period": 0.25}, "every 0.25 s, expected a whole multiple of the sample period 0.1 s"),
        ({"hold": 0.1, "period": 0.05}, "every 0.05 s, expected a whole multiple"),
        ({"hold": 0.1, "dropout": 1.0}, "drop-out is 1, expected 0 to below 1"),
    ],
)
def test_sensors_that_cannot_be(keys, told):
    with pytest.raises(FlightError, match=f"^gyro: .*{told}"):
        Gyro("gyro", **keys)


def test_before_the_sample_period_is_known_nothing_walks():
    gyro = Gyro("gyro", angle_random_walk=1e-5, bias=(1e-3, 0.0, 0.0))
    assert np.allclose(measured(gyro, np.ones((6, 1)))["gyro"][0], np.add(QUIET["rate"], [1e-3, 0, 0]), atol=1e-17)
