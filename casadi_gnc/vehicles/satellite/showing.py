"""What pictures of a satellite's flight show: panels over time, and the craft in space."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import casadi as ca
import numpy as np

from casadi_gnc.mechanics.orbits import EARTH_J2, Orbit
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.panel import Panel
from casadi_gnc.missions.scene import Arrow, Direction, Jets, Scene, Spinners, Track

if TYPE_CHECKING:
    from .craft import SatelliteCraft

#: Seconds between points of the field along the orbit, one degree of which takes 15 s; and points at most.
_APART, _MOST_OF_TRACK = 60.0, 721


def panels(craft: SatelliteCraft, mission: Mission) -> tuple[Panel, ...]:
    """Return pointing, with what it should settle below, rate, torque, and what makes it."""
    from .pointing_checks import wanted  # with all that looks at loops, which flying does without

    limit = wanted(mission)
    level, label = (None, "") if limit is None else (math.degrees(limit), "settled below")
    shown = [
        Panel("lines", "pointing_error_deg", "pointing error", logarithmic=True, level=level, level_label=label),
        Panel("lines", "rate", "rate"),
        Panel("effort", "torque", "torque"),
    ]
    names = {"wheel_torque": "wheel torque", "force": "force", "dipole": "dipole"}
    shown += [Panel("actuators", name, text) for name, text in names.items() if name in mission.truth.inputs]
    if craft.wheel:
        shown.append(Panel("lines", "wheel_speed", "wheel speed"))
    return tuple(shown)


def scene(craft: SatelliteCraft, mission: Mission) -> Scene:
    """Return the body with its wheels and thrusters, the way down, to the sun and along the field."""
    inputs, sun = mission.truth.inputs, craft.surroundings().sun
    away = np.abs([each.position_m for each in craft.thruster]).max(axis=0) if craft.thruster else np.full(3, 0.5)
    down = [] if craft.orbit is None else [Arrow("position", "down", "reference", reversed=True)]
    return Scene(
        attitude="mrp",
        reference="inertial frame",
        size=[float(value) for value in np.maximum(2 * away, 0.3 * away.max())],
        jets=_jets(craft) if "force" in inputs else None,
        spinners=Spinners("wheel_speed", [each.axis for each in craft.wheel]) if craft.wheel else None,
        arrows=[Arrow("rate", "rate"), *down],
        tracks=_field_track(craft, mission.timing.duration),
        directions=[] if sun is None else [Direction("sun", np.array(ca.DM(sun(0.0))).ravel().tolist())],
    )


def _jets(craft: SatelliteCraft) -> Jets:
    """Return the thrusters about the centre of mass at rest."""
    centre = np.array(ca.DM(craft.at_rest()[1])).ravel()
    return Jets(
        "force",
        [(np.array(each.position_m) - centre).tolist() for each in craft.thruster],
        [each.direction for each in craft.thruster],
        [each.max_force_N for each in craft.thruster],
    )


def _field_track(craft: SatelliteCraft, duration: float) -> list[Track]:
    """Return the way of the magnetic field along the orbit, without what disturbs it but the Earth's oblateness."""
    field = craft.surroundings().field
    if craft.orbit is None or field is None:
        return []
    orbit, t = Orbit(craft.orbit.elements(), EARTH_J2 if craft.orbit.j2 else 0.0), ca.SX.sym("t")
    times = np.linspace(0.0, duration, min(_MOST_OF_TRACK, 2 + int(duration / _APART)))
    seen = ca.Function("seen", [t], [field(t, orbit.at(t)[0])]).map(len(times))
    fields = np.array(seen(times[None])).T
    directions = fields / np.linalg.norm(fields, axis=1)[:, None]
    return [Track("field", np.round(times, 3).tolist(), np.round(directions, 5).tolist())]
