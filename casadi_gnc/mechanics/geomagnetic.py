"""The magnetic field of the Earth: the International Geomagnetic Reference Field, whole or its tilted dipole.

==========  ==========================================================================
symbol      meaning
==========  ==========================================================================
r           position from the Earth's centre, Earth-fixed, (3,), [m]
u           r/norm(r), its direction cosines x, y, z
a           reference radius, 6371.2 km
g, h        Schmidt semi-normalised coefficients of degree n and order m, [nT]
H(n, m)     Schmidt's function of z, divided by (x^2 + y^2)^(m/2)
==========  ==========================================================================

    V = a sum_n (a/norm(r))^(n+1) sum_m H(n, m)(z) (g c_m + h s_m),      c_m + i s_m = (x + i y)^m,      B = -grad V

Written by direction cosines (Pines 1973, doi:10.2514/3.50619) nothing is singular at the poles. The recursion of H and
its slope are those of Schmidt's functions,

    sqrt(n^2 - m^2) H(n, m) = (2 n - 1) z H(n-1, m) - sqrt((n-1)^2 - m^2) H(n-2, m)
    dH(n, m)/dz = sqrt((n - m)(n + m + 1)) H(n, m+1),  for m = 0 over sqrt(2).

Coefficients: 14th generation, `igrf14.txt` beside this file, from 2020 to 2030: between two epochs they move in a
straight line. The main field alone is modelled: currents of ionosphere and magnetosphere add tens of nT on a quiet day
and hundreds in a storm, the crust some more; the published uncertainty of the model is about 150 nT.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Any

import casadi as ca

from casadi_gnc.errors import FlightError
from casadi_gnc.mechanics.earth import Epoch

#: Reference radius [m] of the coefficients.
RADIUS = 6371.2e3
#: First and last year for which there are coefficients.
YEARS = (2020.0, 2030.0)
#: Highest degree of the model.
DEGREE = 13
_NANO = 1e-9

#: (g, h), [nT], by degree and order.
Coefficients = Mapping[tuple[int, int], tuple[float, float]]


@cache
def _published() -> dict[tuple[int, int], tuple[float, ...]]:
    """Return g and h in 2020, in 2025, and their change from 2025 on, by degree and order."""
    text = resources.files("casadi_gnc.mechanics").joinpath("igrf14.txt").read_text(encoding="utf-8")
    rows = [line.split() for line in text.splitlines() if line and not line.startswith("#")]
    return {(int(n), int(m)): tuple(float(value) for value in values) for n, m, *values in rows}


def coefficients(year: float) -> dict[tuple[int, int], tuple[float, float]]:
    """Return (g, h), [nT], by degree and order, in a year and its share; raise `FlightError` outside `YEARS`."""
    if not YEARS[0] <= year <= YEARS[1]:
        raise FlightError(
            f"the field model IGRF-14 is asked for the year {year:.2f}, it has {YEARS[0]:g} to {YEARS[1]:g}; "
            "give an epoch in these years"
        )
    past, later = (year - 2020.0) / 5, year - 2025.0
    found = {}
    for order, (g20, h20, g25, h25, g_change, h_change) in _published().items():
        if year < 2025:
            found[order] = (g20 + past * (g25 - g20), h20 + past * (h25 - h20))
        else:
            found[order] = (g25 + later * g_change, h25 + later * h_change)
    return found


def synthesis(position: Any, given: Coefficients, degree: int = DEGREE) -> Any:
    """Return B, (3,), [T], Earth-fixed.

    Parameters
    ----------
    position : r, (3,), [m], Earth-fixed.
    given : (g, h) by degree and order, [nT]; those that are left out are zero.
    degree : highest degree that is summed.
    """
    distance = ca.sqrt(ca.sumsqr(position))
    x, y, z = ca.vertsplit(position / distance)
    ratio = RADIUS / distance
    functions = _schmidt(z, degree)
    cosines, sines = [ca.SX(1)], [ca.SX(0)]
    for _ in range(degree):
        cosines.append(x * cosines[-1] - y * sines[-1])
        sines.append(x * sines[-1] + y * cosines[-2])
    # Slopes of V/a by x, y, z at a fixed |r|, and by |r|, each over the power of the ratio that all share.
    by_x: Any = 0
    by_y: Any = 0
    by_z: Any = 0
    by_radius: Any = 0
    power = ratio * ratio
    for n in range(1, degree + 1):
        x_n: Any = 0
        y_n: Any = 0
        z_n: Any = 0
        v_n: Any = 0
        for m in range(n + 1):
            g, h = given.get((n, m), (0.0, 0.0))
            if g == h == 0.0:
                continue
            wave = g * cosines[m] + h * sines[m]
            v_n += functions[n, m] * wave
            if m < n:
                z_n += math.sqrt((n - m) * (n + m + 1) / (2 if m == 0 else 1)) * functions[n, m + 1] * wave
            if m > 0:
                x_n += m * functions[n, m] * (g * cosines[m - 1] + h * sines[m - 1])
                y_n += m * functions[n, m] * (h * cosines[m - 1] - g * sines[m - 1])
        power = power * ratio
        by_x, by_y, by_z = by_x + power * x_n, by_y + power * y_n, by_z + power * z_n
        by_radius += (n + 1) * power * v_n
    # grad V = (slope - u (u.slope) - u by_radius), the slope's part along u being none of the sphere's.
    outward = by_radius + x * by_x + y * by_y + z * by_z
    return _NANO * (ca.vertcat(x, y, z) * outward - ca.vertcat(by_x, by_y, by_z))


def _schmidt(z: Any, degree: int) -> dict[tuple[int, int], Any]:
    """Return H(n, m), by degree and order, for 0 <= m <= n."""
    found: dict[tuple[int, int], Any] = {(0, 0): ca.SX(1)}
    for m in range(degree + 1):
        if m > 0:
            found[m, m] = (1.0 if m == 1 else math.sqrt((2 * m - 1) / (2 * m))) * found[m - 1, m - 1]
        for n in range(max(m + 1, 1), degree + 1):
            before = math.sqrt((n - 1) ** 2 - m * m) * found[n - 2, m] if n - 2 >= m else 0
            found[n, m] = ((2 * n - 1) * z * found[n - 1, m] - before) / math.sqrt(n * n - m * m)
    return found


@dataclass(frozen=True)
class GeomagneticField:
    """Give the field at places and times of a flight.

    Parameters
    ----------
    epoch : when t = 0 is; its year chooses the coefficients, which stay for the flight.
    degree : highest degree, 1 (the tilted dipole) to 13 (all).
    """

    epoch: Epoch
    degree: int = DEGREE

    def __post_init__(self) -> None:
        if self.degree not in range(1, DEGREE + 1):
            raise FlightError(f"the field's degree is {self.degree}, expected 1 (tilted dipole) to {DEGREE}")
        coefficients(self.epoch.year)

    @classmethod
    def dipole(cls, epoch: Epoch) -> GeomagneticField:
        """Return the tilted dipole alone: within a third of the field at 500 km, and its shape."""
        return cls(epoch, 1)

    def at(self, t: Any, position: Any) -> Any:
        """Return B, (3,), [T], inertial frame, at a place (3,), [m], inertial, t [s] after the epoch."""
        turn = self.epoch.to_earth(t)
        there = ca.mtimes(turn, position)
        return ca.mtimes(turn.T, synthesis(there, coefficients(self.epoch.year), self.degree))
