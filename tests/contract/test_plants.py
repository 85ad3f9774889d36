"""What every plant must keep, whoever wrote it. A new plant is tested by being in a shipped mission."""

import casadi as ca
import numpy as np
import pytest
from shipped_missions import missions

PLANTS = {type(mission.truth).__name__: mission for mission in missions().values()}


@pytest.fixture(params=sorted(PLANTS))
def mission(request):
    return PLANTS[request.param]


def values(expression) -> np.ndarray:
    return np.array(ca.DM(expression)).ravel()


def test_columns_fit_the_layouts(mission):
    plant, x = mission.truth, ca.DM(mission.start)
    noise, actuators = ca.DM.zeros(plant.noise.size), ca.DM.zeros(plant.inputs.size)
    assert x.shape == (plant.state.size, 1)
    assert ca.DM(plant.measure(0.0, x, noise)).shape == (plant.measurement.size, 1)
    assert ca.DM(plant.rate(0.0, x, actuators, noise)).shape == (plant.state.size, 1)
    assert set(plant.show(0.0, x, actuators)) == set(plant.outputs.names)
    assert np.isfinite(values(plant.rate(0.0, x, actuators, noise))).all()


def test_every_signal_has_a_unit_and_every_measurement_a_limit(mission):
    plant = mission.truth
    for layout in (plant.state, plant.inputs, plant.outputs):
        for signal in layout.signals:
            assert signal.unit or signal.size == 1, signal
    for signal in plant.measurement.signals:
        assert 0 < signal.limit < np.inf, signal


def test_settling_changes_nothing_physical(mission, rng):
    """What the sensors see of a settled state moves the plant alike, and settling twice is settling once."""
    plant = mission.truth
    x = ca.DM(np.array(mission.start) * (1 + 0.1 * rng.uniform(-1, 1, plant.state.size)))
    once = values(plant.settle(x))
    assert np.allclose(values(plant.settle(ca.DM(once))), once, rtol=1e-14, atol=1e-300)


def test_noise_moves_only_what_it_is_said_to(mission):
    """Zero noise twice gives the same words, and every noise number does something."""
    plant, x = mission.truth, ca.DM(mission.start)
    noise = plant.noise.symbol("noise")
    if not plant.noise.size:
        return
    actuators = ca.DM.zeros(plant.inputs.size)
    everything = ca.vertcat(plant.measure(0.0, x, noise), plant.rate(0.0, x, actuators, noise))
    slope = ca.DM(ca.substitute(ca.jacobian(everything, noise), noise, 0.1))
    assert (np.abs(np.array(slope)).max(axis=0) > 0).all()


def test_target_names_states(mission):
    for name, goal in mission.target.items():
        assert mission.truth.state.signal(name).size == len(goal)
    assert mission.target, "a craft says what its laws regulate, so that check can linearise"
