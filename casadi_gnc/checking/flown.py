"""The flight itself, without noise, on CasADi's machine: nothing is compiled, and what it shows is a fact.

Only where that takes a moment: sampled missions whose allocation is an expression, up to some samples.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

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
    moved = loop(t=t, **columns)
    state = ca.vertcat(*columns.values())
    step = ca.Function("step", [state, t], [ca.vertcat(*(moved[f"{name}_next"] for name in _COLUMNS))])
    times = np.arange(mission.timing.samples) * mission.timing.sample_period
    now, at = np.array(ca.vertcat(*(start[name] for name in _COLUMNS))).ravel(), np.zeros(1)
    states, later = np.empty((len(times), mission.truth.state.size)), np.empty_like(now)
    # In one piece of memory; CasADi's own chain of steps takes longer to build than to fly.
    memory, run = step.buffer()
    buffer: Any = memory  # CasADi's annotations ask for a size that its own wrapper counts
    view: Any = memoryview
    for place, column in enumerate((now, at)):
        buffer.set_arg(place, view(column))
    buffer.set_res(0, view(later))
    for k, time in enumerate(times):
        states[k], at[0] = now[: states.shape[1]], time
        run()
        now[:] = later
    return times, states
