"""Epochs, the turn of the Earth, and places on it; the sun as seen from there.

Frames: the inertial one is the mean equator and equinox of date taken as fixed (x to the equinox, z along the
Earth's axis), the Earth-fixed one is turned from it about z by Greenwich mean sidereal time. Left out are
precession (0.014 degrees a year), nutation (0.005 degrees), polar motion (0.1 arc seconds) and the difference of
UT1 and UTC (below a second, 0.004 degrees): what points a satellite within 0.02 degrees may use it.

========  ==========================================================================
symbol    meaning
========  ==========================================================================
days      from the epoch J2000, 2000-01-01 12:00, Julian date 2451545.0, [d]
theta     Greenwich mean sidereal time, [rad]
s         unit vector to the sun, (3,), inertial frame
========  ==========================================================================

Sources: sidereal time from Aoki and others (1982), the IAU 1982 formula without its terms in the square and the cube
of time, 3e-5 degrees by 2027; the sun from the Astronomical Almanac's low-precision formulas
(section C), to 0.01 degrees and 3e-4 of the distance from 1950 to 2050; the ellipsoid WGS 84.
"""

from __future__ import annotations

import datetime
import math
from dataclasses import dataclass
from typing import Any

import casadi as ca

from casadi_gnc.errors import FlightError
from casadi_gnc.mathematics import exact

#: Earth's rate [rad/s]: 1.00273790935 turns a day.
RATE = 2 * math.pi * 1.00273790935 / 86400
#: Astronomical unit [m].
ASTRONOMICAL_UNIT = 149597870700.0
#: Major axis [m] and flattening of the WGS 84 ellipsoid.
MAJOR_AXIS, FLATTENING = 6378137.0, 1 / 298.257223563
_DEGREE = math.pi / 180
_J2000 = datetime.datetime(2000, 1, 1, 12)


@dataclass(frozen=True)
class Epoch:
    """Say when t = 0 is.

    Parameters
    ----------
    days : from J2000, [d], UTC taken for universal time; `Epoch.of` makes it of a date.
    """

    days: float

    @classmethod
    def of(cls, text: str) -> Epoch:
        """Return the epoch of an ISO date and time, UTC: "2026-11-27T12:00:00"; raise `FlightError` for others."""
        try:
            moment = datetime.datetime.fromisoformat(text)
        except (TypeError, ValueError):
            raise FlightError(f'the epoch is {text!r}, expected a date and time as "2026-11-27T12:00:00"') from None
        if moment.tzinfo is not None:
            moment = moment.astimezone(datetime.UTC).replace(tzinfo=None)
        return cls((moment - _J2000) / datetime.timedelta(days=1))

    @property
    def year(self) -> float:
        """The epoch in years of the calendar, with the share of the year that has passed."""
        moment = _J2000 + datetime.timedelta(days=self.days)
        first, last = (datetime.datetime(moment.year + i, 1, 1) for i in (0, 1))
        return moment.year + (moment - first) / (last - first)

    def sidereal_time(self, t: Any) -> Any:
        """Return theta, [rad], t [s] after the epoch; its value at the epoch is reduced to one turn."""
        start = math.fmod(280.46061837 + 360.98564736629 * self.days, 360.0)
        return start * _DEGREE + RATE * t

    def to_earth(self, t: Any) -> Any:
        """Return the matrix, (3, 3), inertial -> Earth-fixed, t [s] after the epoch."""
        angle = self.sidereal_time(t)
        c, s = ca.cos(angle), ca.sin(angle)
        return ca.vertcat(ca.horzcat(c, s, 0), ca.horzcat(-s, c, 0), ca.horzcat(0, 0, 1))

    def sun(self, t: Any) -> tuple[Any, Any]:
        """Return s, (3,), and the distance to the sun [m], t [s] after the epoch."""
        # Numbers of the epoch are reduced before the flight's time is added, which float needs.
        days = t / 86400
        anomaly = (math.fmod(357.528 + 0.9856003 * self.days, 360) + 0.9856003 * days) * _DEGREE
        mean = (math.fmod(280.460 + 0.9856474 * self.days, 360) + 0.9856474 * days) * _DEGREE
        longitude = mean + (1.915 * ca.sin(anomaly) + 0.020 * ca.sin(2 * anomaly)) * _DEGREE
        cosine, sine = exact.cos_sin((23.439 - 4e-7 * self.days) * _DEGREE)
        distance = 1.00014 - 0.01671 * ca.cos(anomaly) - 0.00014 * ca.cos(2 * anomaly)
        c, s = ca.cos(longitude), ca.sin(longitude)
        return ca.vertcat(c, cosine * s, sine * s), distance * ASTRONOMICAL_UNIT


def place(latitude: Any, longitude: Any, height: Any = 0.0) -> Any:
    """Return a place on the Earth, (3,), [m], Earth-fixed.

    Parameters
    ----------
    latitude, longitude : geodetic, [rad], east positive.
    height : above the ellipsoid, [m].
    """
    square = FLATTENING * (2 - FLATTENING)
    (cosine, sine), (along, aside) = exact.cos_sin(latitude), exact.cos_sin(longitude)
    normal = MAJOR_AXIS / exact.sqrt(1 - square * sine * sine)
    across = (normal + height) * cosine
    return ca.vertcat(across * along, across * aside, (normal * (1 - square) + height) * sine)


def sunlight(position: Any, sun: Any, *, width: float | None = None, radius: float = MAJOR_AXIS) -> Any:
    """Return the share of the sun, 0 to 1, that a craft sees past the Earth.

    Parameters
    ----------
    position : of the craft from the Earth's centre, (3,), [m].
    sun : unit vector to the sun, (3,), same frame.
    width : None for a shadow that is a cylinder, 0 or 1; else the sun's angular radius [rad] (0.00465 at one
        astronomical unit), for a cone, whose penumbra shades as two discs cover each other.
    radius : of the Earth, a sphere, [m].
    """
    along = ca.dot(position, sun)
    across = ca.sqrt(ca.sumsqr(ca.cross(position, sun)))
    if width is None:
        return ca.if_else(ca.logic_and(along < 0, across < radius), 0.0, 1.0)
    distance = ca.sqrt(ca.sumsqr(position))
    sine = ca.if_else(radius < distance, radius / distance, 1.0)
    earth, apart = ca.asin(sine), ca.atan2(across, -along)
    return 1 - _covered(width, earth, apart)


def _covered(sun: float, earth: Any, apart: Any) -> Any:
    """Return the share of a small disc behind a large one; `apart` is the angle between their centres."""
    # The limb of the Earth is taken as straight across the sun: x is the place of the limb from the sun's centre,
    # in its radii, and the segment that it covers is (acos x - x sqrt(1 - x^2))/pi.
    x = (apart - earth) / sun
    inside = ca.fabs(x) < 1
    safe = ca.if_else(inside, x, 0.0)
    part = (ca.acos(safe) - safe * ca.sqrt(1 - safe * safe)) / math.pi
    return ca.if_else(inside, part, ca.if_else(x < 0, 1.0, 0.0))
