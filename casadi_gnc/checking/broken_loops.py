"""Cut the linearised loop of a mission where its actuators push, or where its sensors are read.

A cut at the efforts has the effort that the law commands on one side and what the actuators make of it on the other: a
factor there is an effectiveness that the flight software does not know, since observers and anti-windup are told what
was commanded. A cut at the measurements has what is measured on one side and what the law reads on the other.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np

from casadi_gnc.checking.linear import held, loop_at, moving_rows, moving_states
from casadi_gnc.checking.margins import BrokenLoop, Margins, common_gain, disk_of_all, margins
from casadi_gnc.checking.mass_centre import MassCentreBounds, mass_centre_bounds
from casadi_gnc.checking.sampling import settled
from casadi_gnc.errors import FlightError
from casadi_gnc.missions.linear_plant import names_of, unlimited
from casadi_gnc.missions.loop import Loop
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.scheme import Scheme
from casadi_gnc.signals import Layout


@dataclass(frozen=True, eq=False)
class SchemeMargins:
    """Hold the margins of one scheme.

    Parameters
    ----------
    scheme : its name.
    at_s : the time of the linearisation [s]: when funnels have stopped narrowing.
    channels : by name, such as "torque 1" or "mrp 3", the margins of that channel with all others closed.
    effort_low, effort_high : factors, one for all efforts, between which the loop stays stable: the true effectiveness
        over the believed one, or the believed mass and inertia over the true ones.
    disk_of_efforts : alpha that all efforts bear at once, each with a factor of its own.
    loop : the loop cut at all efforts, for pictures.
    mass_centre : how far off the centre of mass may be; None where it was not asked for.
    """

    scheme: str
    at_s: float
    channels: dict[str, Margins]
    effort_low: float
    effort_high: float
    disk_of_efforts: float
    loop: BrokenLoop
    mass_centre: MassCentreBounds | None = None


def scheme_margins(mission: Mission, scheme: Scheme, *, mass_centre: bool = False) -> SchemeMargins:
    """Return the margins of a scheme at its target, held still where it moves, sampled as it flies.

    Parameters
    ----------
    mission, scheme : what flies.
    mass_centre : whether the bounds of the mass centre are looked for; that takes seconds.

    Raises
    ------
    FlightError
        Where the mission has no target, the law no slope there, or the loop is not stable at it.
    """
    mission, scheme = held(mission, scheme)
    if not mission.target:
        raise FlightError(f"{mission.name} says no target at which its loop could be cut")
    at = settled(mission)
    efforts, sensors = cuts(mission, scheme, at)
    if not efforts.is_stable():
        raise FlightError(
            f"the loop of scheme {scheme.name!r} is not stable at its target, so it has no margins; "
            "`casadi-gnc check` says why"
        )
    channels = {}
    for loop, layout in ((efforts, scheme.actuation.effort), (sensors, read_by(mission, scheme))):
        for i, name in enumerate(names_of(layout)):
            cut = loop.channel(i)
            if np.any(cut.B) and np.any(cut.C):  # a channel that is read and moves something
                channels[name] = margins(cut)
    low, high = common_gain(efforts)
    bounds = mass_centre_bounds(mission, scheme) if mass_centre else None
    return SchemeMargins(scheme.name, at, channels, low, high, disk_of_all(efforts)[0], efforts, bounds)


def read_by(mission: Mission, scheme: Scheme) -> Layout:
    """Return the measured signals that a scheme reads."""
    known = {signal.name: signal for signal in mission.truth.measurement.signals}
    return Layout(tuple(known[name] for name in scheme.flown.inputs.names))


def cuts(mission: Mission, scheme: Scheme, t: float) -> tuple[BrokenLoop, BrokenLoop]:
    """Return the loop cut at every effort, and at every measurement that the law reads, linearised at a time [s]."""
    x0, m0 = loop_at(mission, scheme, t).target
    y0 = ca.DM(mission.truth.measure(t, ca.DM(x0), mission.quiet()))
    found: Any = _slopes(mission, scheme)(t, x0, m0, Loop(mission, scheme).seen(y0))
    A, B, C, memory, fed, commanded, through = (np.array(ca.DM(each).full()) for each in found)
    if not all(np.isfinite(each).all() for each in (A, B, C, memory, fed, commanded, through)):
        raise FlightError(
            f"the law of scheme {scheme.name!r} has no slope at its target, so nothing linear can be said of it"
        )
    period = mission.timing.sample_period if mission.timing.mode == "sampled" else 0.0
    none = np.zeros((len(A), len(memory)))
    at_efforts = BrokenLoop(
        np.block([[A, none], [fed @ C, memory]]),
        np.vstack([B, np.zeros((len(memory), B.shape[1]))]),
        np.hstack([through @ C, commanded]),
        np.zeros((B.shape[1], B.shape[1])),
        period,
    )
    at_sensors = BrokenLoop(
        np.block([[A, B @ commanded], [none.T, memory]]),
        np.vstack([B @ through, fed]),
        np.hstack([C, np.zeros((len(C), len(memory)))]),
        np.zeros((len(C), len(C))),
        period,
    )
    return _moving(at_efforts), _moving(at_sensors)


def _moving(loop: BrokenLoop) -> BrokenLoop:
    """Return the loop without states that stay what they are, whatever the others do."""
    kept = moving_rows(loop.closed(), bool(loop.period))
    return BrokenLoop(loop.A[np.ix_(kept, kept)], loop.B[kept], loop.C[:, kept], loop.D, loop.period)


@lru_cache(maxsize=16)
def _slopes(mission: Mission, scheme: Scheme) -> ca.Function:
    """Return (t, x, m, seen) -> slopes of the plant by state and effort, of what is read of it, and of the law."""
    loop = Loop(mission, scheme, averaged=True)
    s, quiet, sampled = loop.symbols(), mission.quiet(), mission.timing.mode == "sampled"
    y = loop.sensed(s.t, s.x, quiet)
    seen = ca.SX.sym("seen", loop.seen(y).numel())
    effort = ca.SX.sym("effort", scheme.actuation.effort.size)
    actuators = unlimited(mission, scheme, y, effort)
    x = (loop.held if sampled else loop.moved)(s.t, s.x, actuators, quiet)
    remembered, wanted = loop.commanded(s.t, seen, s.m)
    made = loop.made(y, unlimited(mission, scheme, y, wanted))
    later = (loop.advanced if sampled else loop.flowing)(s.t, seen, remembered, wanted, made)
    rows = moving_states(mission)
    slopes = [
        ca.jacobian(x[rows], s.x[rows]),
        ca.jacobian(x[rows], effort),
        ca.jacobian(loop.seen(y), s.x[rows]),
        ca.jacobian(later, s.m),
        ca.jacobian(later, seen),
        ca.jacobian(wanted, s.m),
        ca.jacobian(wanted, seen),
    ]
    at_rest = ca.substitute(slopes, [effort], [ca.SX.zeros(effort.numel())])
    return ca.Function("slopes", [s.t, s.x, s.m, seen], at_rest)
