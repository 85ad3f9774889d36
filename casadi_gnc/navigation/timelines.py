"""One reference after another, at once or by a smooth turn from the one to the other while both move.

==========  ==============================================================================
symbol      meaning
==========  ==============================================================================
q1, q2      quaternions of the reference before and after, both moving, (4,)
phi         rotation vector of q1 from q2, the short way, (3,), [rad]
x           time since the turn began over how long it lasts
s(x)        share of the turn that is done, 10 x^3 - 15 x^4 + 6 x^5
q           what is wanted: the turn by (1 - s) phi, after q2
==========  ==============================================================================

s is the polynomial of lowest degree whose rate and acceleration vanish at both ends, so q begins and ends with
attitude, rate and acceleration of what it comes from and goes to. Rate and acceleration in between follow by
differentiating q along those of q1 and q2. Where the two pass through 180 degrees from each other on the way, the short
way becomes the other one and q jumps.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import casadi as ca

from casadi_gnc.errors import LawError
from casadi_gnc.mechanics import quaternions
from casadi_gnc.navigation._navigation import Reference, Wanted
from casadi_gnc.signals import Layout


@dataclass(frozen=True, eq=False)
class Timeline(Reference):
    """Follow one reference after another, each from its own time on.

    Parameters
    ----------
    steps : (time [s], reference), times rising; the first counts from the start of the flight.
    turns : how long each takes to come from the one before, [s], 0: at once; none: all at once.

    Raises
    ------
    LawError
        For times that do not rise, and a turn that has nothing before it, or does not end before the next step.
    """

    steps: Sequence[tuple[float, Reference]]
    turns: Sequence[float] = ()

    def __post_init__(self) -> None:
        times, turns = [time for time, _ in self.steps], list(self.turns) or [0.0] * len(self.steps)
        if not times or any(not later > earlier for earlier, later in pairwise(times)):
            told = ", ".join(f"{time:g}" for time in times) or "no"
            raise LawError(f"references from {told} s on, expected one or more, with rising times")
        if len(turns) != len(times):
            raise LawError(f"{len(turns)} turns to {len(times)} references, expected one to each")
        if turns[0] != 0:
            raise LawError(f"a turn of {turns[0]:g} s to the first reference, which has none before it")
        for time, turn, following in zip(times, turns, [*times[1:], math.inf], strict=True):
            if not 0 <= turn <= following - time:
                told = f"a turn of {turn:g} s from {time:g} s on, expected 0 or more"
                raise LawError(told + (f", and an end before {following:g} s" if turn > 0 else ""))
        object.__setattr__(self, "turns", turns)

    @property
    def reads(self) -> Layout:
        """What any of them reads."""
        signals = {signal.name: signal for _, one in self.steps for signal in one.reads.signals}
        return Layout(tuple(signals.values()))

    def at(self, t: Any, known: Any) -> Wanted:
        """Return what is wanted at time t [s]."""
        found: Any = None
        before: Wanted | None = None
        for (time, one), turn in zip(self.steps, self.turns, strict=True):
            wanted = one.at(t, known)
            column = _column(wanted)
            if turn > 0 and before is not None:
                column = ca.if_else(t < time + turn, _column(_turning(before, wanted, t - time, turn)), column)
            found = column if found is None else ca.if_else(t >= time, column, found)
            before = wanted
        return Wanted(found[:4], found[4:7], found[7:])


def _column(wanted: Wanted) -> Any:
    return ca.vertcat(*(ca.SX(each) for each in (wanted.quaternion, wanted.rate, wanted.acceleration)))


def _turning(before: Wanted, after: Wanted, since: Any, lasting: float) -> Wanted:
    """Return what is wanted `since` [s] a turn began that takes `lasting` [s]."""
    moving = ca.logic_and(since > 0, since < lasting)  # elsewhere it is not looked at
    x = ca.if_else(moving, since / lasting, 0.0)
    share, speed = x**3 * (10 - 15 * x + 6 * x**2), 30 * (x * (1 - x)) ** 2 / lasting
    push = 60 * x * (1 - x) * (1 - 2 * x) / lasting**2

    q1, q2, w1, w2 = ca.SX.sym("q1", 4), ca.SX.sym("q2", 4), ca.SX.sym("w1", 3), ca.SX.sym("w2", 3)
    s, ds = ca.SX.sym("s"), ca.SX.sym("ds")
    pushed = ca.SX.sym("pushed", 7)  # the derivatives of w1, w2 and ds
    state = ca.vertcat(q1, q2, s, w1, w2, ds)
    along = ca.vertcat(quaternions.rate(q1, w1), quaternions.rate(q2, w2), ds, pushed)
    phi = quaternions.to_rotation_vector(quaternions.relative(q1, q2))
    q = quaternions.compose(quaternions.from_rotation_vector((1 - s) * phi), q2)
    dq = ca.jtimes(q, state, along)
    rate = 2 * (q[0] * dq[1:] - dq[0] * q[1:] - ca.cross(q[1:], dq[1:]))
    told = ca.vertcat(q, rate, ca.jtimes(rate, state, along))

    values = (before.quaternion, after.quaternion, share, before.rate, after.rate, speed)
    accelerations = (before.acceleration, after.acceleration, push)
    now = [ca.vertcat(*(ca.SX(each) for each in group)) for group in (values, accelerations)]
    found: Any = ca.substitute([told], [state, pushed], now)[0]
    return Wanted(found[:4], found[4:7], found[7:])
