"""Truth: textbook plates and spheres, and what a closed box feels."""

import math

import casadi as ca
import numpy as np
import pytest

from casadi_gnc.mechanics import earth
from casadi_gnc.mechanics.plates import PRESSURE, Atmosphere, Plate, air, light

ORIGIN = ca.DM.zeros(3)


def dense(value) -> np.ndarray:
    return np.array(ca.DM(value)).ravel()


def ball(count: int = 40, **keys) -> list[Plate]:
    """A sphere of 1 m as plates by rings; its areas sum up to the sphere's."""
    plates, step = [], math.pi / count
    for i in range(count):
        polar = (i + 0.5) * step
        ring = 2 * math.pi * (math.cos(i * step) - math.cos((i + 1) * step))
        for j in range(2 * count):
            around = j * math.pi / count
            n = [math.sin(polar) * math.cos(around), math.sin(polar) * math.sin(around), math.cos(polar)]
            plates.append(Plate(ring / (2 * count), n, n, **keys))
    return plates


def test_light_on_a_plate_by_what_it_does_with_it():
    """Head on: what is swallowed pushes once, mirrored twice, scattered five thirds."""
    sun = ca.DM([0, 0, 1])
    for keys, times in (({}, 1.0), ({"mirrored": 1.0}, 2.0), ({"scattered": 1.0}, 5 / 3)):
        force, _ = light([Plate(2.0, [0, 0, 1], [0, 0, 0], **keys)], ORIGIN, sun)
        assert np.allclose(dense(force), [0, 0, -2.0 * times * PRESSURE], rtol=1e-14)
    force, _ = light([Plate(2.0, [0, 0, -1], [0, 0, 0])], ORIGIN, sun)
    assert not dense(force).any()
    far, _ = light([Plate(2.0, [0, 0, 1], [0, 0, 0])], ORIGIN, sun, 0.5, 2 * earth.ASTRONOMICAL_UNIT)
    assert np.allclose(dense(far), [0, 0, -0.25 * PRESSURE], rtol=1e-14)
    assert abs(PRESSURE / 4.54e-6 - 1) < 1e-3


def test_spheres_feel_their_disc():
    """Light that is swallowed or mirrored pushes a sphere by P pi r^2; air by rho V^2/2 C_D pi r^2."""
    way = np.array([0.6, 0.0, 0.8])
    for keys in ({}, {"mirrored": 1.0}):
        force, torque = light(ball(**keys), ORIGIN, ca.DM(way))
        assert np.allclose(dense(force), -PRESSURE * math.pi * way, rtol=2e-3, atol=1e-9)
        assert np.allclose(dense(torque), 0, atol=1e-8)
    force, _ = air(ball(drag=2.2), ORIGIN, 1e-12, ca.DM(7500 * way))
    assert np.allclose(dense(force), -0.5e-12 * 7500**2 * 2.2 * math.pi * way, rtol=2e-3, atol=1e-8)


def test_torque_is_arm_times_force():
    plate = Plate(1.5, [1, 0, 0], [0.5, 0.2, -0.1])
    centre = ca.DM([0.1, 0.0, 0.05])
    force, torque = air([plate], centre, 1e-12, ca.DM([7000.0, 500.0, -300.0]))
    assert np.allclose(dense(torque), np.cross([0.4, 0.2, -0.15], dense(force)), rtol=1e-14)


def test_the_air_thins_and_turns_with_the_earth():
    model = Atmosphere(1e-12, 500e3, 65e3)
    for height, expected in ((500e3, 1e-12), (565e3, 1e-12 / math.e)):
        r = earth.MAJOR_AXIS + height
        density, flight = model.at(ca.DM([r, 0, 0]), ca.DM([0, earth.RATE * r, 0]))
        assert float(density) == pytest.approx(expected, rel=1e-12)
        assert np.allclose(dense(flight), 0, atol=1e-12)
