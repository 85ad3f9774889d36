"""What every law must keep, whoever wrote it. A new law is tested by being in LAWS."""

import casadi as ca
import numpy as np
import pytest

from casadi_gnc.laws import LAWS, PerformanceFunnel, advance, gains_of
from casadi_gnc.rigid_body import RigidBody

BODY = RigidBody(ca.DM(np.diag([0.49019, 1.2089, 1.2916])), (0.0, 1.8e-4, -3.1e-4), 1.1e-3)
FUNNEL = PerformanceFunnel(ca.DM([0.4] * 3), ca.DM([5e-5] * 3), ca.DM([0.015] * 3), ca.DM([1.0] * 3), ca.DM([1.0] * 3))


def make(name: str, hold: float):
    law = LAWS[name]
    needs = {"funnel": FUNNEL} if name == "prescribed_performance" else {}
    gains = {key: 0.4 for key, declared in gains_of(law).items() if declared.metadata["size"] == 1}
    return law(body=BODY, hold=hold, **needs, **gains)


@pytest.fixture(params=sorted(LAWS))
def name(request):
    return request.param


@pytest.fixture(params=[0.0, 0.1], ids=["continuous", "sampled"])
def law(name, request):
    return make(name, request.param)


def values(expression) -> np.ndarray:
    return np.array(ca.DM(expression)).ravel()


def test_sizes_fit_the_layouts(law, rng):
    y = ca.DM(rng.uniform(-0.1, 0.1, law.inputs.size))
    m = law.start(0.0, y)
    wanted = law.command(0.0, y, m)
    assert ca.DM(m).shape == (law.memory.size, 1) or law.memory.size == 0
    assert wanted.shape == (3, 1)
    assert law.rate(0.0, y, m, wanted, wanted).shape[0] == law.memory.size
    assert set(law.show(0.0, y, m)) == set(law.outputs.names)


def test_first_estimate_is_zero(law, rng):
    y = ca.DM(rng.uniform(-0.1, 0.1, law.inputs.size))
    shown = law.show(0.0, y, law.start(0.0, y))
    if "disturbance_estimate" in shown:
        assert np.allclose(values(shown["disturbance_estimate"]), 0, atol=1e-15)


def test_at_rest_at_the_target_only_the_known_torque_is_asked_for(law):
    y = ca.DM.zeros(law.inputs.size)
    wanted = values(law.command(0.0, y, law.start(0.0, y)))
    feed_forward = -np.array(BODY.constant_torque) if law.memory.size else np.zeros(3)
    assert np.allclose(wanted, feed_forward, atol=1e-12)


def test_rate_is_damped(law):
    """The wanted torque opposes a pure rate beyond the model's own terms."""
    law_at = lambda w: values(law.command(0.0, y_of(law, w), law.start(0.0, y_of(law, np.zeros(3)))))  # noqa: E731
    rate = np.array([1e-3, -2e-3, 1.5e-3])
    assert (law_at(rate) - law_at(np.zeros(3))) @ rate < 0


def y_of(law, rate):
    parts = {"mrp": ca.DM.zeros(3), "rate": ca.DM(rate)}
    return law.inputs.pack(**{name: parts[name] for name in law.inputs.names})


def test_advance_is_the_rate_for_a_short_hold(name, rng):
    law = make(name, 1e-5)
    if not law.memory.size:
        return
    y, m = ca.DM(rng.uniform(-0.1, 0.1, law.inputs.size)), ca.DM(rng.uniform(-1e-2, 1e-2, law.memory.size))
    wanted = law.command(0.0, y, m)
    quotient = (values(advance(law, 0.0, y, m, wanted, 0.5 * wanted)) - values(m)) / 1e-5
    assert np.allclose(quotient, values(law.rate(0.0, y, m, wanted, 0.5 * wanted)), rtol=1e-3, atol=1e-8)


def test_everything_is_symbolic_and_differentiable_by_every_gain(name):
    law = LAWS[name]
    symbols = {key: ca.SX.sym(key) for key in gains_of(law)}
    needs = {"funnel": FUNNEL} if name == "prescribed_performance" else {}
    tuned = law(body=BODY, hold=0.1, **needs, **symbols)
    y, m = ca.SX.sym("y", tuned.inputs.size), tuned.memory.symbol("m")
    wanted = tuned.command(0.0, y, m)
    gradient = ca.jacobian(
        ca.vertcat(wanted, advance(tuned, 0.0, y, m, wanted, wanted / 2)), ca.vertcat(*symbols.values())
    )
    evaluate = ca.Function("gradient", [y, m, *symbols.values()], [gradient])
    at = evaluate(np.full(tuned.inputs.size, 0.01), np.full(tuned.memory.size, 0.01), *[0.4] * len(symbols))
    assert np.all(np.isfinite(np.array(at)))


def test_errata_say_what_they_are(name):
    assert all(len(sentence) > 20 for sentence in LAWS[name].errata.values())
    assert LAWS[name].__doc__


def test_gains_name_unit_and_meaning(name):
    for declared in gains_of(LAWS[name]).values():
        assert declared.metadata["unit"]
        assert declared.metadata["note"]
