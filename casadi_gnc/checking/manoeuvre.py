"""Does a law that shifts its errors by what saturation cost keep its funnel in its first manoeuvre?

Where a command is cut, an auxiliary system moves the error that the law regulates. Once the missing
effort stays above what unloads it, it grows without bound and steers the signal *to* the funnel's
wall, though the clipped command alone would brake in time. No theorem has a condition against that,
so the manoeuvre is simulated: one signal starts as in the mission, everything else at its target.
Against whole flights the edge comes out within 2 % of the force (Tao, Zhang 2019: 9.9 N against
9.8 N).
"""

from __future__ import annotations

from collections.abc import Iterator

import casadi as ca
import numpy as np

from casadi_gnc.checks import Check
from casadi_gnc.missions.linear_plant import target_state
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.recording import funnel_signals
from casadi_gnc.missions.rehearsing import rehearsal
from casadi_gnc.missions.scheme import Funnel, Scheme

#: A signal is moved directly by what changes its rate by so much.
_SPEED = 0.1
#: Part of its narrowing that a funnel has left when the manoeuvre is over.
_LEFT = 0.1


def auxiliary(mission: Mission, scheme: Scheme, signal: str) -> Iterator[Check]:
    """Yield the largest share of a signal's funnel in its manoeuvre under the auxiliary system."""
    for funnel in mission.funnels:
        if funnel.signal == signal:
            yield Check(
                f"funnel.auxiliary.{signal}",
                flown_use(mission, scheme, funnel),
                1.0,
                "-",
                "fail",
                "The system against saturation outgrows what unloads it and steers the signal out of its funnel.",
                "Bound what it counts, clip only, or raise the limit of the effort.",
                "manoeuvre of this signal alone, simulated until its funnel has narrowed by nine tenths",
            )


def flown_use(mission: Mission, scheme: Scheme, funnel: Funnel) -> float:
    """Return the largest share of a funnel in the manoeuvre of its signal alone, flown while the funnel narrows.

    All other regulated signals start at their targets; loads, limits, law and integrator are the mission's.
    """
    plant, alone = mission.truth, target_state(mission)
    signal = plant.state.place(funnel.signal)
    x = ca.SX.sym("x", plant.state.size)
    rate = ca.SX(plant.rate(0.0, x, ca.DM.zeros(plant.inputs.size), ca.DM.zeros(plant.noise.size)))[signal]
    slope = ca.Function("slope", [x], [ca.jacobian(rate, x)])(np.array(mission.start))
    # The signal itself, and whatever moves it directly: its speed.
    kept = np.abs(np.array(ca.DM(slope))).max(axis=0) > _SPEED
    kept[signal] = True
    for name in mission.target:
        rows = plant.state.place(name)
        if kept[rows].any():
            alone[rows] = np.array(mission.start)[rows]
    h = mission.timing.sample_period
    narrowing = float(np.log(1 / _LEFT) / np.array(ca.DM(funnel.bounds.decay)).min())
    duration = min(mission.timing.duration, h * np.ceil(narrowing / h))
    begun = {name: list(alone[plant.state.place(name)]) for name in plant.state.names}
    flown = rehearsal(mission, scheme)
    record = flown.record(begun, float(duration))
    if record is None:
        return float("inf")
    use = record[:, flown.row.place(funnel_signals(mission, funnel).names[-1])]
    return float(use.max()) if np.isfinite(use).all() else float("inf")
