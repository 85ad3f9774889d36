"""Truth: values that NCEI's calculator prints (version 1.2.1, IGRF-14), the dipole in closed form, Laplace."""

import math

import casadi as ca
import numpy as np
import pytest

from casadi_gnc.errors import FlightError
from casadi_gnc.mechanics import earth, geomagnetic
from casadi_gnc.mechanics.earth import Epoch
from casadi_gnc.mechanics.geomagnetic import GeomagneticField

#: Latitude, longitude [deg], height above the ellipsoid [km], year; north, east, down [nT].
PRINTED = [
    (-23.5, -43.7, 700, 2020.0, 13030.1, -4434.5, -10858.8),
    (-23.5, -43.7, 700, 2024.0, 12785.6, -4367.4, -11099.7),
    (47.9, 106.9, 3000, 2020.4137, 7247.7, -280.7, 14942.9),
    (47.9, 106.9, 3000, 2023.4137, 7234.1, -296.6, 14987.9),
    (-23.5, -43.7, 0.7, 2020.0, 16085.4, -6690.6, -15201.8),
    (47.9, 106.9, 1.3, 2026 + 151 / 365, 21568.1, -2104.8, 55327.5),
    (9.0, 38.7, 2.355, 2026 + 213 / 365, 35675.0, 1368.9, 2067.7),
]


def dense(value) -> np.ndarray:
    return np.array(ca.DM(value)).ravel()


@pytest.mark.parametrize(("latitude", "longitude", "height", "year", "north", "east", "down"), PRINTED)
def test_published_values_to_their_last_digit(latitude, longitude, height, year, north, east, down):
    latitude, longitude = math.radians(latitude), math.radians(longitude)
    place = earth.place(latitude, longitude, height * 1e3)
    b = dense(geomagnetic.synthesis(place, geomagnetic.coefficients(year))) * 1e9
    sl, cl, so, co = (f(a) for a in (latitude, longitude) for f in (math.sin, math.cos))
    local = np.array([[-sl * co, -sl * so, cl], [-so, co, 0], [-cl * co, -cl * so, -sl]])
    assert np.allclose(local @ b, [north, east, down], atol=0.0501)


def test_degree_one_is_a_dipole():
    """B = (3 u (m.u) - m) (a/r)^3 with m = -(g11, h11, g10): the magnet points south."""
    given = geomagnetic.coefficients(2026.9)
    moment = np.array([*given[1, 1], given[1, 0][0]]) * 1e-9
    for place in ([7e6, 0, 0], [1e6, -2e6, 6.8e6], [0, 0, 7e6], [0, 0, -7e6]):
        u = np.array(place) / np.linalg.norm(place)
        ratio = geomagnetic.RADIUS / np.linalg.norm(place)
        expected = (3 * u * (moment @ u) - moment) * ratio**3
        assert np.allclose(dense(geomagnetic.synthesis(ca.DM(place), given, 1)), expected, rtol=1e-13, atol=1e-20)


def test_no_source_and_no_curl_even_at_the_poles():
    r = ca.SX.sym("r", 3)
    b = geomagnetic.synthesis(r, geomagnetic.coefficients(2025.5))
    slope = ca.Function("slope", [r], [b, ca.jacobian(b, r)])
    for place in ([7e6, 1e5, 3e5], [-4e6, 5e6, 2e6], [0, 0, 6.6e6], [0, 0, -6.6e6]):
        field, gradient = (np.array(each) for each in slope(place))
        scale = np.linalg.norm(field) / 7e6
        assert np.all(np.isfinite(gradient))
        assert abs(np.trace(gradient)) < 1e-12 * scale
        assert np.allclose(gradient, gradient.T, atol=1e-12 * scale)


def test_the_field_turns_with_the_earth():
    """Half a sidereal day later the opposite place sees what this one saw."""
    field = GeomagneticField(Epoch.of("2026-11-27T00:00:00"), 6)
    place, half = np.array([5e6, -3e6, 4e6]), math.pi / earth.RATE
    turn = np.diag([-1, -1, 1])
    now, later = dense(field.at(0.0, ca.DM(place))), dense(field.at(half, ca.DM(turn @ place)))
    assert np.allclose(turn @ later, now, atol=1e-15)


def test_coefficients_meet_at_their_epochs():
    assert geomagnetic.coefficients(2020.0)[1, 0] == (-29403.41, 0.0)
    assert geomagnetic.coefficients(2025.0)[1, 1] == (-1410.3, 4545.5)
    assert geomagnetic.coefficients(2030.0)[1, 0][0] == pytest.approx(-29350.0 + 5 * 12.6)
    assert len(geomagnetic.coefficients(2026.0)) == 104


def test_fields_that_are_not_known():
    with pytest.raises(FlightError, match=r"year 2030\.99, it has 2020 to 2030"):
        GeomagneticField(Epoch.of("2030-12-28"))
    with pytest.raises(FlightError, match="degree is 14, expected 1"):
        GeomagneticField(Epoch.of("2026-01-01"), 14)
