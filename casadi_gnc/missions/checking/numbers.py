"""Do the on-board computations survive single precision?"""

from __future__ import annotations

from collections.abc import Iterator

import casadi as ca
import numpy as np

from casadi_gnc.checks import Check
from casadi_gnc.missions import tapes
from casadi_gnc.missions.checking.linear import target_state
from casadi_gnc.missions.checking.noise import limits
from casadi_gnc.missions.mission import Mission, Scheme

#: Share of an effort's limit that rounding may move the command.
_SHARE = 0.01


def checks(mission: Mission, scheme: Scheme) -> Iterator[Check]:
    """Yield how far the rounding of measurements to float32 moves the command, as a share of the limits."""
    slope, y = command_slope(mission, scheme)
    start = ca.DM(mission.truth.measure(0.0, ca.DM(mission.start), ca.DM.zeros(mission.truth.noise.size)))
    largest = np.maximum(np.abs(y), np.abs(np.array(start).ravel()))
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


def command_slope(mission: Mission, scheme: Scheme) -> tuple[np.ndarray, np.ndarray]:
    """Return d(command)/d(measurement) at the target at the end of the flight, and that measurement."""
    plant, seen = mission.truth, mission.truth.measurement.symbol("y")
    y = ca.DM(plant.measure(0.0, ca.DM(target_state(mission)), ca.DM.zeros(plant.noise.size)))
    memory = ca.DM(scheme.law.start(ca.DM(0.0), tapes.law_inputs(mission, scheme, y)))
    end = ca.DM(mission.timing.duration)
    command = ca.SX(scheme.law.command(end, tapes.law_inputs(mission, scheme, seen), memory))
    slope = ca.Function("slope", [seen], [ca.jacobian(command, seen)])
    return np.array(ca.DM(slope(y)).full()), np.array(y).ravel()
