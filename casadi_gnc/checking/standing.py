"""What it takes to stand still at the target, over the flight: loads, and commands that bear them.

Of a plant at its target, x' = d(t) + G(t) F for the rows that the laws regulate. Faults are part of
both. A fault that passes makes G another for a while; what is asked of the actuators for good is
asked when G is what it is at the end.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np

from casadi_gnc.missions.linear_plant import rows_of, target_state
from casadi_gnc.missions.mission import Mission

#: Times of the flight at which loads are looked at.
TIMES = 200
#: Part of the last effectiveness by which it may differ and still count as that.
_SAME = 0.05


@lru_cache(maxsize=16)  # a mission, and those with its mass centre at the corners of a box
def loads(mission: Mission) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return times, (K,), d, (K, n), and G, (K, n, N), of the rows that actuators move at the end."""
    plant, rows = mission.truth, rows_of(mission)
    t, actuators = ca.SX.sym("t"), plant.inputs.symbol("actuators")
    x = ca.DM(target_state(mission))
    rate = ca.SX(plant.rate(t, x, actuators, ca.DM.zeros(plant.noise.size)))[rows]
    slope = ca.substitute(ca.jacobian(rate, actuators), actuators, 0)
    pushed = ca.Function("pushed", [t], [ca.substitute(rate, actuators, 0), ca.vec(slope)])
    times = np.linspace(0.0, mission.timing.duration, TIMES)
    found: Any = pushed.map(TIMES)(times)
    drift, gain = (np.array(ca.DM(each)).T for each in found)
    gain = gain.reshape(TIMES, slope.shape[1], slope.shape[0]).transpose(0, 2, 1)
    moved = np.abs(gain[-1]).max(axis=1) > 0
    return times, drift[:, moved], gain[:, moved]


def lasting(gain: np.ndarray) -> np.ndarray:
    """Return which times have the effectiveness of the end, (K,)."""
    size = np.abs(gain[-1]).max(axis=1)[:, None]
    return (np.abs(gain - gain[-1]) <= _SAME * size).all(axis=(1, 2))


def efforts(mission: Mission, slope: np.ndarray) -> np.ndarray:
    """Return the wanted efforts that bear the load, (K, R), through an allocation F = slope u."""
    _, drift, gain = loads(mission)
    turned = gain @ slope
    negligible = np.finfo(float).eps * max(turned.shape[1:])  # as NumPy's least squares have it
    return -np.einsum("krn,kn->kr", np.linalg.pinv(turned, rcond=negligible), drift)
