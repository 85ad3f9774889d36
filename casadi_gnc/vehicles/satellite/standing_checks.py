"""How far torques that last hold a satellite off its reference, against the pointing that the mission wants of it.

==========  ==============================================================================================
symbol      meaning
==========  ==============================================================================================
T           attitude (MRP) that a torque of 1 N m about each axis holds the loop at, (3, 3), linearised
d(t)        torque from outside on the reference, (3,), [N m]
G, J_s, Om  axes of the wheels, (3, N), their inertias and speeds, (N,)
f(Om)       friction of the wheels, (N,), [N m]
s           G J_s Om, (3,), [N m s]: what the wheels store
n           what motions that turn nothing store, (N,), [N m s]: G n = 0
k, k_n, n_0 rates at which s is unloaded and n comes to n_0, of the rest speeds, [1/s]; 0 without [momentum]
==========  ==============================================================================================

On the reference s' = d - k s in inertial axes, from the momentum of the start less that of the body on the reference.
Motors share a torque out by the pseudo-inverse, so friction alone, and what [momentum] adds, changes the rest:

    J_s Om = G+ s + n,    n' = -(I - G+ G) (f(Om) + k_n (n - n_0)).

A manoeuvre that asks motors for more than they have leaves further motions in n, which friction slows as well. They
follow from the law and are not in it.

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
#: Wheels that cannot move against each other without turning the body.
_AXES = 3
_LEFT_OUT = "; without motions of the wheels against each other that a manoeuvre leaves"
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
        "4 |T (d + G f)|, T of the linear loop, d and f on the reference in the last tenth of the flight"
        + (_LEFT_OUT if has_idle_motions(craft) else ""),
    )


def has_idle_motions(craft: SatelliteCraft) -> bool:
    """Return whether wheels can move in ways that turn nothing and have friction that turns the body then."""
    return len(craft.wheel) > _AXES and has_friction(craft)


def has_friction(craft: SatelliteCraft) -> bool:
    """Return whether a wheel has friction."""
    return any(each.coulomb_N_m or each.viscous_N_m_s_per_rad for each in craft.wheel)


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
    torques, attitudes, rates = on_reference(craft, times)
    friction = np.zeros(3)
    if has_friction(craft):
        friction = friction_after(craft, times, stored_along(craft, times, torques, attitudes, rates[0]))
    return torques[times >= (1 - _LAST) * times[-1]] + friction


def friction_after(craft: SatelliteCraft, times: np.ndarray, stored: np.ndarray) -> np.ndarray:
    """Return G f(Om), (3,), [N m], at the last of K times that begin at 0, of wheels that store s, (3, K), [N m s]."""
    wheels, keys = part_tables.wheels(craft.wheel), craft.momentum
    axes, spin = (np.array(ca.DM(each)) for each in (wheels.axes, wheels.spin_inertia))
    spin, back = spin.ravel(), np.linalg.pinv(axes)
    speed = ca.SX.sym("speed", len(spin))
    friction = ca.Function("friction", [speed], [wheels.friction(speed)])
    first = np.array(craft.start()["wheel_speed"], dtype=float)
    shared, turnless = back @ stored, np.eye(len(spin)) - back @ axes
    rest = turnless @ (spin * np.array(keys.rest_speeds_rad_per_s or np.zeros(len(spin))))

    def slowed(t: float, n: np.ndarray) -> np.ndarray:
        along = np.array([np.interp(t, times, each) for each in shared])
        return -turnless @ (np.array(friction((along + n) / spin)).ravel() + keys.null_per_s * (n - rest))

    n = turnless @ (spin * first)
    if np.abs(turnless).max() > 1e-9:
        from scipy.integrate import solve_ivp  # a flight does without

        size = np.abs(shared).max() + np.abs(n).max() + np.abs(rest).max()
        n = solve_ivp(slowed, (0.0, times[-1]), n, method="LSODA", rtol=1e-4, atol=1e-6 * size + 1e-300).y[:, -1]
    return axes @ np.array(friction((shared[:, -1] + n) / spin)).ravel()


def stored_along(
    craft: SatelliteCraft, times: np.ndarray, torques: np.ndarray, attitudes: np.ndarray, rate: np.ndarray
) -> np.ndarray:
    """Return what the wheels store along the reference, (3, K), [N m s], body axes.

    Parameters
    ----------
    times : (K,), [s]. torques, attitudes : there, as `on_reference` tells. rate : of the reference at first, [rad/s].
    """
    wheels = part_tables.wheels(craft.wheel)
    start = {name: np.array(value, dtype=float) for name, value in craft.start().items()}
    axes = np.array(ca.DM(wheels.axes))
    store = axes * np.array(ca.DM(wheels.spin_inertia)).ravel()
    inertia = np.array(ca.DM(craft.belief().inertia)) + store @ axes.T
    first = np.array(quaternions.dcm(quaternions.from_mrp(ca.DM(start["mrp"]))))
    whole = first.T @ (inertia @ start["rate"] + store @ start["wheel_speed"])
    # By the trapezoidal rule, of s exp(k t).
    grown = np.exp(craft.momentum.unload_per_s * (times - times[-1]))[:, None]
    pushed = np.einsum("kij,ki->kj", attitudes, torques) * grown
    gained = np.cumsum(np.diff(times)[:, None] * (pushed[1:] + pushed[:-1]) / 2, axis=0)
    begun = (whole - attitudes[0].T @ inertia @ rate) * grown[0]
    stored = (begun + np.vstack([np.zeros(3), gained])) / grown
    return np.einsum("kij,kj->ik", attitudes, stored)
