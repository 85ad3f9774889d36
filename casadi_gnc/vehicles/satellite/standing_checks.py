"""How far torques that last hold a satellite off its reference, against the pointing that the mission wants of it.

==========  ==============================================================================================
symbol      meaning
==========  ==============================================================================================
T           attitude (MRP) that a torque of 1 N m about each axis holds the loop at, (3, 3), linearised
d(t)        torque from outside on the reference, (3,), [N m]
G, J_s, Om  axes of the wheels, (3, N), their inertias and speeds, (N,)
f(Om)       friction of the wheels, (N,), [N m]
s           G J_s Om, (3,), [N m s]: what the wheels store
k           rate at which it is unloaded, [1/s]
==========  ==============================================================================================

On the reference s' = d - k s in inertial axes, from the momentum of the start less that of the body on the reference.
Motors make up for friction, so the body feels G f(Om), and a law that knows of neither holds the attitude at the angle

    4 |T (d + G f(Om))|, small as it has to be.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

import casadi as ca
import numpy as np

from casadi_gnc.checking.linear import held, loop_at
from casadi_gnc.checks import Check
from casadi_gnc.mechanics import quaternions
from casadi_gnc.missions.linear_plant import rows_of
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.scheme import Scheme

from . import part_tables
from .budgets import on_reference

if TYPE_CHECKING:
    from .craft import SatelliteCraft

#: Part of the flight, at its end, that is looked at.
_LAST = 0.1
#: Times of the flight at which torques are taken.
_TIMES = 1_000
_DEGREE = 180 / math.pi


def checks(craft: SatelliteCraft, mission: Mission, scheme: Scheme, limit: float) -> Iterator[Check]:
    """Yield what torque from outside and friction of the wheels leave of pointing, against `limit` [rad]."""
    turned = attitude_per_torque(mission, scheme)
    if turned is None:
        return
    torques = torque_at_the_end(craft, mission)
    angle = float(4 * np.linalg.norm(torques @ turned.T, axis=1).max())
    if angle == 0.0:
        return
    # A torque that changes slowly enough counts as one that lasts; what swings may be faster.
    sure = held(mission, scheme)[0] is mission and not craft.environment.harmonic
    yield Check(
        "settling.pointing",
        _DEGREE * angle,
        _DEGREE * limit,
        "deg",
        "fail" if sure else "warn",
        "Torque from outside and friction of the wheels hold the attitude off by more than it should settle within.",
        "Raise the gains, let an integral or an observer take the torque, unload the wheels, or ask for less.",
        "4 |T (d + G f)|, T of the linear loop, d and f on the reference in the last tenth of the flight",
    )


def attitude_per_torque(mission: Mission, scheme: Scheme) -> np.ndarray | None:
    """Return T, (3, 3), [1/(N m)]; None where no torque can be held, or the law's torque has no slope."""
    still, own = held(mission, scheme)
    effort = own.actuation.effort
    if not still.target or "torque" not in effort:
        return None
    loop, place = loop_at(still, own, still.timing.duration), still.truth.state.place("mrp")
    if not loop.exists:
        return None
    angles = [i for i, row in enumerate(rows_of(still)) if place.start <= row < place.stop]
    turned = loop.held_by(loop.pushed_by_efforts[:, effort.place("torque")])[angles]
    return turned if np.isfinite(turned).all() else None


def torque_at_the_end(craft: SatelliteCraft, mission: Mission) -> np.ndarray:
    """Return d + G f(Om) in the last part of the flight, (K, 3), [N m], body axes; wheels as at the end."""
    times = np.linspace(0.0, mission.timing.duration, _TIMES + 1)
    torques = on_reference(craft, times)[0]
    return torques[times >= (1 - _LAST) * times[-1]] + (friction_after(craft, times) if craft.wheel else 0.0)


def friction_after(craft: SatelliteCraft, times: np.ndarray) -> np.ndarray:
    """Return G f(Om), (3,), [N m], at the last of `times`, which begin at 0; wheels come to their own speeds."""
    wheels, keys, remaining = part_tables.wheels(craft.wheel), craft.momentum, times[-1] - times
    axes = np.array(ca.DM(wheels.axes))
    store = axes * np.array(ca.DM(wheels.spin_inertia)).ravel()
    inertia = np.array(ca.DM(craft.belief().inertia)) + store @ axes.T
    start = {name: np.array(value) for name, value in craft.start().items()}
    first = np.array(quaternions.dcm(quaternions.from_mrp(ca.DM(start["mrp"]))))
    torques, attitudes, rates = on_reference(craft, times)
    whole = first.T @ (inertia @ start["rate"] + store @ start["wheel_speed"])
    # s' = d - k s in inertial axes, by the trapezoidal rule.
    kept = np.exp(-keys.unload_per_s * remaining)[:, None]
    pushed = np.einsum("kij,ki->kj", attitudes, torques) * kept
    gained = (np.diff(times)[:, None] * (pushed[1:] + pushed[:-1]) / 2).sum(axis=0)
    stored = attitudes[-1] @ ((whole - attitudes[0].T @ inertia @ rates[0]) * kept[0] + gained)
    rest = np.array(keys.rest_speeds_rad_per_s or [0.0] * axes.shape[1])
    idle = rest + (start["wheel_speed"] - rest) * math.exp(-keys.null_per_s * remaining[0])
    speeds = idle + np.linalg.pinv(store) @ (stored - store @ idle)
    return axes @ np.array(ca.DM(wheels.friction(ca.DM(speeds)))).ravel()
