"""Do the on-board computations survive single precision?"""

from __future__ import annotations

from collections.abc import Iterator

import casadi as ca
import numpy as np

from casadi_gnc.checks import Check
from casadi_gnc.missions.checking.linear import command_slope
from casadi_gnc.missions.checking.noise import limits
from casadi_gnc.missions.mission import Mission, Scheme

#: Share of an effort's limit that rounding may move the command.
_SHARE = 0.01


def checks(mission: Mission, scheme: Scheme) -> Iterator[Check]:
    """Yield how far the rounding of measurements to float32 moves the command, as a share of the limits."""
    slope, y = command_slope(mission, scheme)
    if not np.isfinite(slope).all():
        return
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
