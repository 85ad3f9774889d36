"""What can be said of the gains: the law's own conditions, and whether saturation feeds on itself."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from casadi_gnc.checking.linear import HELD, held, loop_at, spectral_radius
from casadi_gnc.checking.sampling import ROUNDING
from casadi_gnc.checks import Check
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.scheme import Scheme


def checks(mission: Mission, scheme: Scheme) -> Iterator[Check]:
    """Yield the conditions of the law's source, then the sign of its anti-windup loop."""
    yield from scheme.law.checks()
    still, own = held(mission, scheme)
    if not still.target or not scheme.law.memory.size:
        return
    loop = loop_at(still, own, 0.0)
    if not loop.exists:
        return
    memory = loop.memory_when_saturated
    if loop.sampled:
        value, limit, unit = spectral_radius(memory), 1 + ROUNDING, "-"
    else:
        value, limit, unit = float(np.linalg.eigvals(memory).real.max(initial=-np.inf)), ROUNDING, "1/s"
    yield Check(
        "gains.anti_windup",
        value,
        limit,
        unit,
        "fail",
        "While the actuators are at their limit the law's memory feeds itself: once saturated, always saturated.",
        "Turn the sign of the compensation, or let its decay exceed its gain.",
        "poles of the memory with measurement and achieved effort standing still"
        + (f"; {HELD}" if still is not mission else ""),
    )
