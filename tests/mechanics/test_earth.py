"""Truth: worked examples of Vallado and Meeus, and the exact geometry of two discs."""

import math

import casadi as ca
import numpy as np
import pytest

from casadi_gnc.errors import FlightError
from casadi_gnc.mechanics import earth
from casadi_gnc.mechanics.earth import Epoch


def dense(value) -> np.ndarray:
    return np.array(ca.DM(value)).ravel()


def test_sidereal_time_of_worked_examples():
    """Vallado, example 3-5, and Meeus, Astronomical Algorithms, example 12.b; to 1e-4 degrees of dropped terms."""
    for text, expected in (("1992-08-20T12:14:00", 152.578787886), ("1987-04-10T19:21:00", 128.7378734)):
        assert math.degrees(Epoch.of(text).sidereal_time(0.0)) % 360 == pytest.approx(expected, abs=1e-4)
    early, late = Epoch.of("2026-11-27T00:00:00"), Epoch.of("2026-11-28T06:00:00")
    assert math.sin(early.sidereal_time(108000.0) - late.sidereal_time(0.0)) == pytest.approx(0, abs=1e-7)


def test_the_sun_of_worked_examples():
    """Vallado, example 5-1 (astronomical units), and Meeus, example 25.a; the formulas are good for 0.01 degrees."""
    direction, distance = Epoch.of("2006-04-02T00:00:00").sun(0.0)
    found = dense(direction) * float(distance) / earth.ASTRONOMICAL_UNIT
    assert np.allclose(found, [0.9771945, 0.1924424, 0.0834308], atol=1.8e-4)
    direction, distance = Epoch.of("1992-10-13T00:00:00").sun(0.0)
    ascension, declination = math.radians(198.38083), math.radians(-7.78507)
    expected = [math.cos(declination) * f(ascension) for f in (math.cos, math.sin)] + [math.sin(declination)]
    assert math.degrees(np.linalg.norm(dense(direction) - expected)) < 0.01
    assert float(distance) / earth.ASTRONOMICAL_UNIT == pytest.approx(0.99766, abs=3e-4)


def test_the_sun_moves_on_during_a_flight():
    early, late = Epoch.of("2026-11-27T00:00:00"), Epoch.of("2026-12-27T00:00:00")
    month = 30 * 86400.0
    assert np.allclose(dense(early.sun(month)[0]), dense(late.sun(0.0)[0]), atol=1e-7)
    assert np.linalg.norm(dense(early.sun(month)[0])) == pytest.approx(1, abs=1e-9)


@pytest.mark.parametrize("text", ["soon", "2026-13-01", 5])
def test_no_epoch(text):
    with pytest.raises(FlightError, match=r'expected a date and time as "2026'):
        Epoch.of(text)


def test_epochs_know_their_zone_and_year():
    assert Epoch.of("2026-07-02T12:00:00+02:00") == Epoch.of("2026-07-02T10:00:00")
    assert Epoch.of("2026-01-01").year == 2026
    assert Epoch.of("2024-07-02").year == pytest.approx(2024.5, abs=1e-12)  # 183 of 366 days


def test_places_lie_on_the_ellipsoid():
    minor = earth.MAJOR_AXIS * (1 - earth.FLATTENING)
    for latitude in np.linspace(-math.pi / 2, math.pi / 2, 9):
        x, y, z = dense(earth.place(latitude, 0.7))
        assert (x * x + y * y) / earth.MAJOR_AXIS**2 + z * z / minor**2 == pytest.approx(1, abs=1e-14)
        up = dense(earth.place(latitude, 0.7, 1000.0)) - [x, y, z]
        assert np.linalg.norm(up) == pytest.approx(1000, abs=1e-5)
        assert math.asin(up[2] / 1000) == pytest.approx(latitude, abs=1e-6)


def covered(sun: float, planet: float, apart: float) -> float:
    """Return the share of a disc behind another, the lens of two circles."""
    if apart >= sun + planet:
        return 0.0
    if apart <= planet - sun:
        return 1.0
    a = sun**2 * math.acos((apart**2 + sun**2 - planet**2) / (2 * apart * sun))
    b = planet**2 * math.acos((apart**2 + planet**2 - sun**2) / (2 * apart * planet))
    c = math.sqrt((sun + planet - apart) * (apart + sun - planet) * (apart - sun + planet) * (apart + sun + planet))
    return (a + b - c / 2) / (math.pi * sun**2)


@pytest.mark.parametrize(("distance", "tolerance"), [(6.9e6, 1e-3), (42.164e6, 5e-3)])
def test_the_cone_shades_as_discs_cover_each_other(distance, tolerance):
    """The limb is taken as straight: within half a per cent of the sun from a geostationary place."""
    sun, width = ca.DM([1, 0, 0]), 0.00465
    planet = math.asin(earth.MAJOR_AXIS / distance)
    for apart in (*np.linspace(planet - 1.2 * width, planet + 1.2 * width, 25), 0.0, 1.0, 3.0):
        place = distance * ca.DM([-math.cos(apart), math.sin(apart), 0])
        seen = float(earth.sunlight(place, sun, width=width))
        assert seen == pytest.approx(1 - covered(width, planet, apart), abs=tolerance)
        behind = math.cos(apart) > 0 and distance * math.sin(apart) < earth.MAJOR_AXIS
        assert float(earth.sunlight(place, sun)) == (0.0 if behind else 1.0)
