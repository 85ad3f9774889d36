"""The flight itself, without noise, on CasADi's machine: nothing is compiled, and what it shows is a fact.

Only where that takes a moment: sampled missions whose allocation is an expression, up to some samples.
"""

from __future__ import annotations

from functools import lru_cache

import casadi as ca
import numpy as np

from casadi_gnc.missions import functions
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.scheme import Scheme

#: Most samples that are flown here.
_SAMPLES = 20_000
_COLUMNS = ("x", "m", "actuators", "good")


def can_fly(mission: Mission, scheme: Scheme) -> bool:
    """Return whether `path` has an answer."""
    timing = mission.timing
    return timing.mode == "sampled" and scheme.actuation.is_symbolic and timing.samples <= _SAMPLES


@lru_cache(maxsize=8)
def path(mission: Mission, scheme: Scheme) -> tuple[np.ndarray, np.ndarray]:
    """Return times, (K,), and the plant's states at them, (K, n), of a mission that `can_fly`."""
    loop, start = functions.closed_loop_function(mission, scheme), functions.loop_start(mission, scheme)
    t, columns = ca.SX.sym("t"), {name: ca.SX.sym(name, start[name].numel()) for name in _COLUMNS}
    later = loop(t=t, **columns)
    state = ca.vertcat(*columns.values())
    step = ca.Function("step", [state, t], [ca.vertcat(*(later[f"{name}_next"] for name in _COLUMNS))])
    times = np.arange(mission.timing.samples) * mission.timing.sample_period
    begun = np.array(ca.vertcat(*(start[name] for name in _COLUMNS)))
    moved = np.array(step.mapaccum(len(times) - 1)(begun, times[None, :-1]))
    rows = mission.truth.state.size
    return times, np.vstack([begun[:rows].T, moved[:rows].T])
