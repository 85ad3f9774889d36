"""What smooth turns from one reference to the next ask of a satellite's wheels, and whether they are smooth.

A turn goes the short way between two attitudes that both move. Where these pass through 180 degrees from each other,
the short way becomes the other one. The attitude, not its rate, tells that.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

import casadi as ca
import numpy as np

from casadi_gnc.checks import Check
from casadi_gnc.navigation import Timeline

from .budgets import on_reference, reach, wheels_of

if TYPE_CHECKING:
    from .craft import SatelliteCraft

#: Points of a turn.
_POINTS = 101
#: Angle from one to the next [deg] that the rates there need not explain.
_JUMP = 1.0


def checks(craft: SatelliteCraft) -> Iterator[Check]:
    """Yield, of each turn from one reference to the next, whether it jumps, and what it asks of wheels."""
    pointed = craft.pointed()
    if not isinstance(pointed, Timeline):
        return
    for i, ((start, _), lasting) in enumerate(zip(pointed.steps, pointed.turns, strict=True), 1):
        if lasting == 0:
            continue
        times = np.linspace(start, start + lasting, _POINTS)
        _, attitudes, rates = on_reference(craft, times)
        yield _jump(i, times, attitudes, rates)
        if craft.wheel:
            yield from _asked_of_wheels(craft, i, times, rates)


def _asked_of_wheels(craft: SatelliteCraft, i: int, times: np.ndarray, rates: np.ndarray) -> Iterator[Check]:
    axes, torques, stored = wheels_of(craft)
    inertia = np.array(ca.DM(craft.belief().inertia))
    momentum = rates @ inertia
    torque = np.gradient(rates, times, axis=0) @ inertia + np.cross(rates, momentum)
    for what, asked, most, unit in (("torque", torque, torques, "N m"), ("momentum", momentum, stored, "N m s")):
        if not np.isfinite(most).all():
            continue
        size = np.linalg.norm(asked, axis=1)
        reached = [
            reach(axes, most, one / length) if length > 0 else math.inf for one, length in zip(asked, size, strict=True)
        ]
        worst = int(np.argmax(size / reached))
        yield Check(
            f"authority.turn_{i}_{what}",
            float(size[worst]),
            reached[worst],
            unit,
            "warn",
            f"The turn to reference {i} asks for more {what} than the wheels have about its axis: they lag.",
            "Raise turn_s, or take larger wheels.",
            "J w' + w x J w, or J w, along the turn, against the wheels' reach along it",
        )


def _jump(i: int, times: np.ndarray, attitudes: np.ndarray, rates: np.ndarray) -> Check:
    """Return whether the attitude of a turn moves from point to point as its rates say."""
    cosine = (np.einsum("kij,kij->k", attitudes[1:], attitudes[:-1]) - 1) / 2
    speeds = np.linalg.norm(rates, axis=1)
    explained = np.maximum(speeds[1:], speeds[:-1]) * np.diff(times)
    return Check(
        f"geometry.turn_{i}_jump",
        float(np.degrees(np.arccos(np.clip(cosine, -1, 1)) - explained).max(initial=0.0)),
        _JUMP,
        "deg",
        "fail",
        f"On the turn to reference {i} both pass through 180 degrees from each other: the attitude jumps.",
        "Begin the turn at another time, turn faster, or give a reference in between.",
        "largest angle from point to point beyond the rate there",
    )
