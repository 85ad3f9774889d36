"""The filter as flight C: the same steps in double, in single precision and on an emulated processor.

A flight of a minute, measured once by the truth in double: what differs is the filter's own arithmetic.
"""

from functools import cache

import casadi as ca
import numpy as np
import pytest
from filter_flights import COMPASS, HOLD, SUN, TRACKER, filter_of, fly
from packages import needs_target

import casadi_gnc as gnc
from casadi_gnc.delivery.vectors import read_vectors
from casadi_gnc.embedded import boards, targets
from casadi_gnc.mechanics import quaternions
from casadi_gnc.navigation import Mekf

SETS = {"tracker": (TRACKER,), "field and sun": (COMPASS, SUN), "all": (TRACKER, COMPASS, SUN)}
KEYS = {"attitude_deviation": 0.2, "bias_deviation": 0.01}


@cache
def measured(name: str) -> np.ndarray:
    """Return what a flight measured, (601, inputs): time first."""
    turn, bias = np.array([[0.1], [-0.15], [0.2]]), np.array([[0.01], [-0.005], [0.008]])
    rows = fly(filter_of(*SETS[name], **KEYS), turn, bias, 601).measured[:, :, 0]
    return np.hstack([HOLD * np.arange(601)[:, None], rows])


def package(name: str, real: str, folder) -> tuple[Mekf, np.ndarray]:
    """Generate the filter with its memory as state; return it and its outputs, step by step."""
    mekf = filter_of(*SETS[name], **KEYS)
    t, y, m = ca.SX.sym("t"), mekf.inputs.symbol("y"), mekf.memory.symbol("m")
    later = mekf.jump(t, y, m, HOLD)
    shown = mekf.show(t, y, later)
    told = [mekf.estimate(t, y, later).quaternion, *(shown[each] for each in mekf.outputs.names)]
    names = ["quaternion", *mekf.outputs.names]
    step = ca.Function("filter", [t, y, m], [*told, later], ["t", "y", "m"], [*names, "m_next"])
    rows = measured(name)
    first = np.array(ca.DM(mekf.start(0.0, ca.DM(rows[0, 1:])))).ravel().tolist()
    ports = {"m": {"initial": first}}
    gnc.generate(step, folder, real=real, state={"m": "m_next"}, ports=ports, vectors=rows, rate=1 / HOLD)
    _, words = read_vectors(folder, real)
    numbers = words.view({"float64": np.float64, "float32": np.float32}[real]).astype(float)
    return mekf, numbers


@pytest.mark.parametrize("name", ["all", pytest.param("field and sun", marks=pytest.mark.slow)])
def test_single_precision_survives(name, tmp_path):
    """The difference of the two estimates over the filter's own deviations, from the tenth second on.

    A unit quaternion in single precision has steps of 6e-8: of attitudes that are known to 2e-5 rad 3e-3 of a sigma. In
    the flight of all sensors, rounding the double filter's attitude alone from sample to sample gives 0.011, its bias
    alone 0.0009, its measurements alone 0.0005, its answer alone 0.0023.
    The bounds are about twice what this flight shows, 0.038 and 0.0023.
    """
    _, double = package(name, "float64", tmp_path / "double")
    _, single = package(name, "float32", tmp_path / "single")
    worst = {"attitude": 0.0, "bias": 0.0, "deviation": 0.0}
    for a, b in zip(double[100:], single[100:], strict=True):
        turn = quaternions.to_rotation_vector(quaternions.relative(ca.DM(a[:4]), quaternions.normalised(ca.DM(b[:4]))))
        worst["attitude"] = max(worst["attitude"], np.abs(np.array(turn).ravel() / a[7:10]).max())
        worst["bias"] = max(worst["bias"], np.abs((a[4:7] - b[4:7]) / a[10:13]).max())
        worst["deviation"] = max(worst["deviation"], np.abs(b[7:13] / a[7:13] - 1).max())
    assert worst["attitude"] < (4e-3 if name == "field and sun" else 5e-2)
    assert worst["bias"] < 5e-2
    assert worst["deviation"] < 1e-3


@pytest.mark.parametrize("name", [pytest.param(name, marks=needs_target("cortex-m7")) for name in SETS])
def test_a_step_takes_at_most_6000_instructions(name, tmp_path):
    """In double on a Cortex-M7, whatever is valid: nothing branches; and the words are the host's."""
    package(name, "float64", tmp_path)
    _, expected = read_vectors(tmp_path, "float64")
    found = targets.measure(tmp_path, "filter", boards.find("cortex-m7"))
    assert int((found.outputs != expected).sum()) == 0
    assert found.instructions.max() <= 6000
