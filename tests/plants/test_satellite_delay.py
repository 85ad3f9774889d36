"""Sensors that are late: what they say was true that many samples ago, and the filter knows it."""

from typing import Any

import casadi as ca
import numpy as np
import pytest

import casadi_gnc
from casadi_gnc.errors import FlightError, LawError
from casadi_gnc.mechanics import quaternions
from casadi_gnc.mechanics.sensors import Gyro, StarTracker, Tachometers
from casadi_gnc.navigation import Mekf
from casadi_gnc.vehicles.satellite import Satellite, SatelliteCraft

PERIOD = 0.1
WHEELS: Any = [{"axis": axis, "max_torque_N_m": 0.02, "inertia_kg_m2": 1e-3} for axis in np.eye(3).tolist()]
SENSORS: Any = [
    {"kind": "star_tracker", "delay_samples": 3, "period_s": 0.2},
    {"kind": "gyro", "delay_samples": 1},
    {"kind": "tachometers"},
]


def test_what_is_measured_was_true_so_many_samples_ago(rng):
    """Ten states one after another, put into the plant by hand: each sensor tells the one that its delay says."""
    craft = SatelliteCraft(mass_kg=90.0, inertia_kg_m2=np.diag([9.0, 11.0, 7.0]).tolist(), wheel=WHEELS, sensor=SENSORS)
    plant = craft.plant().timed(PERIOD, PERIOD)
    assert isinstance(plant, Satellite)
    start = craft.start()
    assert set(start) == set(plant.state.names)
    x, told = ca.SX.sym("x", plant.state.size), ca.SX.sym("t")
    measure = ca.Function("measure", [told, x], [plant.measure(told, x, ca.DM.zeros(plant.noise.size))])
    settle = ca.Function("settle", [x], [plant.settle(x)])
    now: Any = ca.DM([value for name in plant.state.names for value in start[name]])
    states = [plant.state.split(now)]
    for k in range(10):
        y = plant.measurement.split(measure(k * PERIOD, now))
        looked = [states[max(0, k - late)] for late in (3, 1, 0)]
        right = quaternions.short_way(quaternions.from_mrp(looked[0].mrp))
        assert np.allclose(np.array(y.star_tracker), np.array(ca.DM(right)), rtol=0, atol=1e-15)
        assert np.array_equal(np.array(y.gyro), np.array(looked[1].rate))
        assert np.array_equal(np.array(y.wheel_speed), np.array(looked[2].wheel_speed))
        # Looks at samples 0, 2, 4 arrive three samples later; at the start the last one has come.
        assert float(y.star_tracker_valid) == (1 if k == 0 or (k - 3) % 2 == 0 else 0)
        for name, size in (("mrp", 0.3), ("rate", 0.1), ("wheel_speed", 50.0)):
            now[plant.state.place(name)] = rng.uniform(-size, size, 3)
        now = settle(now)
        states.append(plant.state.split(now))


def test_delays_that_cannot_be():
    with pytest.raises(FlightError, match="gyro: a delay of 51 samples, expected 0 to 50"):
        Gyro("gyro", delay=51)
    with pytest.raises(FlightError, match="wheels: a delay of -1 samples"):
        Tachometers("wheels", count=1, delay=-1)
    stars = StarTracker("stars", across=1e-5, about=1e-5)
    with pytest.raises(LawError, match="gyro is late, which the filter bears of star trackers alone"):
        Mekf(Gyro("gyro", angle_random_walk=1e-6, delay=1), (stars,))


@pytest.mark.slow
def test_the_filter_knows_how_late_its_tracker_is():
    """Compared with now, a tracker that is 0.3 s late would be wrong by 0.3 s of the orbit's rate, 0.019 degrees."""
    mission = casadi_gnc.load("satellites/earth_pointing", {"sensor.2.delay_samples": 3})
    flight = casadi_gnc.fly(mission, decimation=1)
    assert flight["pointing_error_deg"][flight.time > 500].max() < 0.008
