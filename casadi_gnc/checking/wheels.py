"""What only a craft on wheels needs checked: its frame, its wheels' speed, and the weight of its allocation."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from casadi_gnc.checking import authority, standing
from casadi_gnc.checking.allocation import ROUNDING, allocation_slope, least_real_parts
from casadi_gnc.checks import Check
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.scheme import Scheme

#: Accuracy weights that are tried.
WEIGHTS = 10.0 ** np.arange(0, 6.5, 0.5)


def wheel_speed(mission: Mission, scheme: Scheme, fastest: float) -> Iterator[Check]:
    """Yield the speed that bearing the load builds up, for wheels that have a limit [rad/s]."""
    if not np.isfinite(fastest):
        return
    yield Check(
        "authority.wheel_speed",
        largest_speed(mission, scheme),
        fastest,
        "rad/s",
        "fail",
        "Before the end a wheel is as fast as it may be and makes no more torque that way.",
        "Plan a desaturation before that, fly shorter, or take wheels that store more.",
        "speeds after standing still under disturbance and faults, any time of the flight",
    )


def largest_speed(mission: Mission, scheme: Scheme) -> float:
    """Return the largest wheel speed [rad/s] while the craft stands still at its target, any time of the flight."""
    slope, plant = allocation_slope(mission, scheme), mission.truth
    times, _, _ = standing.loads(mission)
    actuators = np.clip(standing.efforts(mission, slope) @ slope.T, scheme.actuation.lower, scheme.actuation.upper)
    x = standing.target_state(mission)
    (speed,) = plant.state.of_kind("wheel_speed")
    rows, quiet = plant.state.place(speed.name), np.zeros(plant.noise.size)
    made = np.array(
        [np.array(plant.rate(t, x, f, quiet)).ravel()[rows] for t, f in zip(times, actuators, strict=True)], dtype=float
    )
    steps = np.diff(times)[:, None] * (made[1:] + made[:-1]) / 2
    return float(np.abs(x[rows] + np.cumsum(steps, axis=0)).max())


def weight_window(
    mission: Mission,
    scheme: Scheme,
    with_weight: Callable[[float], Any],
    corners: list[Mission],
) -> Check:
    """Return whether one accuracy weight bears the errors that an allocation is told and the faults that it is not.

    Parameters
    ----------
    mission, scheme : with the faults; an allocation against errors of the mass centre.
    with_weight : the scheme's allocator with another accuracy weight.
    corners : the mission with the true mass centre at corners of the box that the allocation is told.
    """
    turned, borne = [], []
    for weight in WEIGHTS:
        other = replace(scheme, actuation=replace(scheme.actuation, allocator=with_weight(float(weight))))
        slope = allocation_slope(mission, other)
        if min(least_real_parts(mission, other, slope).values()) < -ROUNDING:
            turned.append(float(weight))
        if all(authority.allocated_demand(corner, other, slope) <= 1 for corner in corners):
            borne.append(float(weight))
    most = min(turned, default=float("inf"))
    least = min(borne, default=float("inf"))
    return Check(
        "allocation.weight_window",
        most / least if np.isfinite(least) else 0.0,
        1.0 + 1e-9,
        "-",
        "fail",
        f"Errors of the mass centre ask for an accuracy weight of {_told(least, 'more than all tried')}, but faults "
        f"turn efforts around from {_told(most, 'none')} on: no weight bears both.",
        "Tell the allocation of the faults, lower the errors, or raise the torque limits.",
        "least weight that turns an effort around over least weight with which every corner is held",
        at_least=True,
    )


def _told(weight: float, otherwise: str) -> str:
    return f"{weight:.3g}" if np.isfinite(weight) else otherwise
