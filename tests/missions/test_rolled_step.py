"""The integrator's step in pieces, as the C of a flight runs it, has the words of the step in one piece."""

import casadi as ca
import numpy as np
import pytest

import casadi_gnc
from casadi_gnc.mathematics.integrators import WEIGHTS
from casadi_gnc.missions.parameters import vary
from casadi_gnc.missions.tapes import tapes_of

CRAFTS = ["huang2019/wheel_faults", "huang2020/slew", "shi2020/docking", "sun2018/circular_orbit", "tao2019/case1"]


def called(tape, **columns):
    return [np.array(result).ravel() for result in tape.call([ca.DM(columns[name]) for name in tape.name_in()])]


def rolled(tapes, t, h, **columns):
    """Return x a step later, stage by stage, with the weights of the classical method."""
    x, moved, total, way = columns["x"], columns["x"], None, None
    for halves, weight in zip((0, 1, 1, 2), WEIGHTS, strict=True):
        if total is not None:
            (moved,) = called(tapes.point, state=x, slope=way, length=halves)
        at = {**columns, "t": t + halves * (h / 2), "middle": t + h / 2, "x": moved}
        slope, way = called(tapes.rate, **at)
        total = slope if total is None else called(tapes.weigh, total=total, slope=slope, weight=weight)[0]
    return called(tapes.join, state=x, total=total)[0]


@pytest.mark.parametrize("varying", [False, True])
@pytest.mark.parametrize("name", CRAFTS)
def test_four_stages_are_the_step(name, varying, rng):
    mission = casadi_gnc.load(name, strict=False).with_timing(mode="sampled")
    scheme, plant, derived = mission.schemes[0], mission.truth, np.zeros(0)
    if varying:
        varied = vary(mission, ["initial.*"], scheme.name)
        tapes = varied.tapes
        derived = called(tapes.configure, p=varied.parameters.nominal)[0]
    else:
        tapes = tapes_of(mission, scheme)
    h = mission.timing.sample_period / mission.timing.substeps
    for step in range(40):
        columns = {
            "x": np.array(mission.start) * (1 + 0.1 * rng.standard_normal(plant.state.size)),
            "told": 0.1 * rng.standard_normal(plant.inputs.size),
            "noise": rng.standard_normal(plant.noise.size),
            "derived": derived,
        }
        (whole,) = called(tapes.plant, t=7 * step * h, **columns)
        parts = rolled(tapes, 7 * step * h, h, **columns)
        assert (whole.view(np.uint64) == parts.view(np.uint64)).all()
    assert tapes.rate.n_instructions() < 0.5 * tapes.plant.n_instructions()
