"""Do the on-board computations survive single precision?"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from casadi_gnc.checking.linear import command_slope
from casadi_gnc.checking.noise import limits
from casadi_gnc.checks import Check
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.scheme import Scheme

#: Share of an effort's limit that rounding may move the command.
_SHARE = 0.01


def orbit(eccentricity: float, perigee: float, radius: float) -> Iterator[Check]:
    """Yield whether an orbit is one: perigee [m] above the radius [m] of the body, not a hyperbola."""
    yield Check(
        "numbers.perigee",
        perigee,
        radius,
        "m",
        "warn",
        "The orbit runs through the body that it is about.",
        "Correct position, velocity or semi-major axis; a factor of 10 is soon lost.",
        "perigee radius by two-body motion against the body's radius",
        at_least=True,
    )
    yield Check(
        "numbers.eccentricity",
        eccentricity,
        1.0,
        "-",
        "warn",
        "The craft is on no orbit but on a hyperbola.",
        "Correct position and velocity; a factor of 10 is soon lost.",
        "eccentricity by two-body motion",
    )


def _tolerances(mission: Mission) -> Iterator[Check]:
    """Yield how coarse float32 is for measured signals that a metric compares with a threshold."""
    layout = mission.truth.measurement
    start = np.array(mission.first_measurement()).ravel()
    asked = {m.signal: m.threshold for m in mission.metrics if m.threshold > 0 and m.signal in layout.names}
    for signal in dict.fromkeys(asked):
        finest = min(m.threshold for m in mission.metrics if m.signal == signal and m.threshold > 0)
        largest = max(np.abs(start[layout.place(signal)]).max(), finest)
        yield Check(
            f"numbers.resolution.{signal}",
            float(np.spacing(np.float32(largest))) / finest,
            _SHARE,
            "-",
            "note",
            "In float32 the signal itself is too coarse for the threshold that it is held against.",
            "Measure it relative to something near, or generate the law in double precision.",
            "unit in the last place of the largest value at the start, over the metric's threshold",
        )


def checks(mission: Mission, scheme: Scheme) -> Iterator[Check]:
    """Yield how fine measured signals are in float32, and what share of the limits their rounding moves the command."""
    yield from _tolerances(mission)
    slope, y = command_slope(mission, scheme)
    if not np.isfinite(slope).all():
        return
    largest = np.maximum(np.abs(y), np.abs(np.array(mission.first_measurement()).ravel()))
    ulp = np.spacing(largest.astype(np.float32)).astype(float)
    moved = np.abs(slope) @ (ulp / 2)
    yield Check(
        "numbers.float32",
        float((moved / limits(scheme)).max()),
        _SHARE,
        "-",
        "note",
        "Measurements rounded to float32 move the command by this share of its limit.",
        "Give the law relative quantities, or generate it in double precision.",
        "half a unit in the last place of every measured signal, at start or target, times the command's slope",
    )
