"""What a satellite's wheels and coils have to hold: momentum over an orbit, slews, and what coils reach on average.

==========  ====================================================================================
symbol      meaning
==========  ====================================================================================
g_i, m_i    axes of the wheels, (3,), and what each makes or stores at most, [N m] or [N m s]
n           normals g_i x g_j of the faces of the body {sum g_i x_i, |x_i| <= m_i}
s(n)        sum m_i |g_i.n|/|n|, its support there
b           direction of the magnetic field, inertial, (3,)
==========  ====================================================================================

All wheels together reach, along a unit vector d, min s(n) |n|/|d.n| over the faces, and in the worst direction min s(n)
(Markley, Reynolds, Liu, Lebsock, Journal of Guidance, Control, and Dynamics 33 (2010), 1606-1614).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from casadi_gnc.checks import Check
from casadi_gnc.mechanics import quaternions
from casadi_gnc.mechanics.orbits import Orbit
from casadi_gnc.missions.mission import Mission
from casadi_gnc.navigation import Reference, Slew, Table, Timeline

from . import part_tables

if TYPE_CHECKING:
    from .craft import SatelliteCraft

#: Share of the wheels' momentum that an orbit may fill.
_FULL = 0.6
#: Points of an orbit at which torques and fields are taken.
_POINTS = 240
#: Least mean of sin^2 between the field and a direction, over an orbit, that coils can work with.
_SEEN = 0.1


def checks(craft: SatelliteCraft, mission: Mission) -> Iterator[Check]:
    """Yield momentum over an orbit, torque and momentum of slews, what coils reach, and whether tables last."""
    if craft.wheel:
        axes, torques, stored = wheels_of(craft)
        if craft.orbit is not None and np.isfinite(stored).all():
            yield _momentum(craft, mission, reach(axes, stored))
        yield from _slews(craft, axes, torques, stored)
    if craft.magnetorquer:
        yield _coils(craft, mission)
    yield from _tables(craft, mission)


def wheels_of(craft: SatelliteCraft) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return axes of the wheels, (3, N), their largest torques, (N,), [N m], and what they store, (N,), [N m s]."""
    return (
        np.array(part_tables.directions(craft.wheel, "axis")),
        np.array([float(each.max_torque_N_m) for each in craft.wheel]),
        np.array([float(each.spin_inertia) * float(each.max_speed) for each in craft.wheel]),
    )


def reach(axes: np.ndarray, most: np.ndarray, direction: np.ndarray | None = None) -> float:
    """Return how far wheels together reach along a direction, or in the worst one."""
    found = math.inf
    for i, j in itertools.combinations(range(axes.shape[1]), 2):
        normal = np.cross(axes[:, i], axes[:, j])
        length = float(np.linalg.norm(normal))
        if length < 1e-9:
            continue
        support = float(most @ np.abs(axes.T @ normal)) / length
        along = 1.0 if direction is None else abs(float(direction @ normal)) / length
        if along > 1e-12:
            found = min(found, support / along)
    return found


def on_reference(craft: SatelliteCraft, times: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return what a satellite on its reference is at K times [s], and what acts on it but its parts.

    Returns
    -------
    torques, attitudes, rates : from outside, (K, 3), [N m]; inertial -> body, (K, 3, 3); (K, 3), [rad/s]; body axes.
    """
    plant, t = craft.plant(), ca.SX.sym("t")
    place = (ca.SX.zeros(3), ca.SX.zeros(3)) if craft.orbit is None else Orbit(craft.orbit.elements()).at(t)
    around = SimpleNamespace(position=place[0], velocity=place[1])
    wanted = plant.reference.at(t, around)
    attitude: Any = ca.SX(wanted.quaternion)
    rest = {signal.name: ca.DM.zeros(signal.size) for signal in plant.assembly.state.signals}
    now = SimpleNamespace(mrp=quaternions.to_mrp(attitude), rate=ca.SX(wanted.rate), **vars(around), **rest)
    torque = plant.disturbance.at(t)
    if craft.orbit is not None:
        torque = torque + plant.surroundings.torque(now, plant.assembly.inertia(now))
    if plant.surroundings.plates:
        felt = plant.surroundings.felt(t, now)
        torque = torque + plant.surroundings.pushed(now, felt, plant.assembly.centre(now))[1]
    turning = quaternions.dcm(attitude).T  # the transpose, for Fortran's order is C's of that
    found: Any = ca.Function("there", [t], [torque, ca.vec(turning), ca.SX(wanted.rate)]).map(len(times))(times[None])
    torques, attitudes, rates = (np.array(ca.DM(each).full()).T for each in found)
    return torques, attitudes.reshape(-1, 3, 3), rates


def disturbance_over_orbit(craft: SatelliteCraft) -> tuple[np.ndarray, np.ndarray]:
    """Return times of one revolution, (K,), [s], and the momentum that torques from outside leave, (K, 3), inertial.

    The satellite is on its reference; what its parts do is left out.
    """
    assert craft.orbit is not None
    times = np.linspace(0, craft.orbit.elements().period, _POINTS + 1)
    torques, attitudes, _ = on_reference(craft, times)
    torques = np.einsum("kij,ki->kj", attitudes, torques)
    steps = np.diff(times)[:, None] * (torques[1:] + torques[:-1]) / 2
    return times, np.vstack([np.zeros(3), np.cumsum(steps, axis=0)])


def _momentum(craft: SatelliteCraft, mission: Mission, capacity: float) -> Check:
    _, stored = disturbance_over_orbit(craft)
    return Check(
        "authority.momentum_over_orbit",
        float(np.linalg.norm(stored, axis=1).max()),
        _FULL * capacity,
        "N m s",
        "warn",
        f"In one orbit torques from outside fill over {_FULL:.0%} of what the wheels store in the worst direction.",
        "Unload more than once an orbit, take larger wheels, or balance the plates about the centre of mass.",
        "largest momentum left by gravity, air, sunlight and disturbance on the reference within a revolution",
    )


def _slews(craft: SatelliteCraft, axes: np.ndarray, torques: np.ndarray, stored: np.ndarray) -> Iterator[Check]:
    inertia = np.array(ca.DM(craft.belief().inertia))
    for i, (_, slew) in enumerate(_steps(craft), 1):
        if not isinstance(slew, Slew) or slew.turn[1] == 0.0:
            continue
        turned = inertia @ np.array(slew.turn[0])
        direction = turned / np.linalg.norm(turned)
        fastest = slew.acceleration * slew.times[0]
        for what, asked, most, unit in (
            ("torque", slew.acceleration, torques, "N m"),
            ("momentum", fastest, stored, "N m s"),
        ):
            if np.isfinite(most).all():
                yield Check(
                    f"authority.slew_{i}_{what}",
                    float(asked * np.linalg.norm(turned)),
                    reach(axes, most, direction),
                    unit,
                    "warn",
                    f"The slew of reference {i} asks for more {what} than the wheels have about its axis: they lag.",
                    "Lower rate_limit_deg_per_s and acceleration_limit_deg_per_s2, or take larger wheels.",
                    "J times the slew's acceleration or largest rate, against the wheels' reach along it",
                )


def tables_of(craft: SatelliteCraft, duration: float) -> dict[int, tuple[float, float]]:
    """Return of each reference that is a table, by its place, its last time and until when it is needed, [s]."""
    steps = _steps(craft)
    ends = [*(start for start, _ in steps[1:]), duration]
    pairs = enumerate(zip(steps, ends, strict=True))
    return {i: (float(one.times[-1]), float(end)) for i, ((_, one), end) in pairs if isinstance(one, Table)}


def _tables(craft: SatelliteCraft, mission: Mission) -> Iterator[Check]:
    for i, (last, needed) in tables_of(craft, mission.timing.duration).items():
        yield Check(
            f"geometry.reference_{i + 1}_end",
            last,
            needed,
            "s",
            "fail",
            f"The table of reference {i + 1} ends before it is needed no more: the attitude stands from there on.",
            "Give later rows, or another [[reference]] from then on.",
            "last time of the table against the next reference, or the end of the flight",
            at_least=True,
        )


def _steps(craft: SatelliteCraft) -> list[tuple[float, Reference]]:
    """Return the references, each with the time from which it counts."""
    pointed = craft.pointed()
    return list(pointed.steps) if isinstance(pointed, Timeline) else [(0.0, pointed)]


def _coils(craft: SatelliteCraft, mission: Mission) -> Check:
    assert craft.orbit is not None
    field = craft.surroundings().field
    assert field is not None
    elements, t = craft.orbit.elements(), ca.SX.sym("t")
    seen = ca.Function("seen", [t], [field(t, Orbit(elements).at(t)[0])])
    until = min(elements.period, mission.timing.duration)
    fields = np.array(seen.map(_POINTS)(np.linspace(0, until, _POINTS)[None])).T
    directions = fields / np.linalg.norm(fields, axis=1)[:, None]
    across = np.eye(3) - directions.T @ directions / _POINTS
    return Check(
        "authority.dipole_over_orbit",
        float(np.linalg.eigvalsh(across)[0]),
        _SEEN,
        "-",
        "warn",
        "Coils make no torque along the field, which hardly turns over this orbit: about one axis they are weak.",
        "Incline the orbit, fly longer, or add wheels or thrusters.",
        "least mean of sin^2 of the angle between the field and an inertial direction, over a revolution or the flight",
        at_least=True,
    )
