"""What every law must keep, whoever wrote it. A new law is tested by being in the registry and in a shipped mission."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from shipped_missions import flown_by

from casadi_gnc.laws import REGISTRY, advance, gains_of
from casadi_gnc.missions.loop import Loop

ATTITUDE = ("rate_damping", "attitude_pd", "detumble", "prescribed_performance")


def values(expression) -> np.ndarray:
    return np.array(ca.DM(expression)).ravel()


@pytest.fixture(params=sorted(REGISTRY.shipped()))
def name(request):
    return request.param


@pytest.fixture(params=[0.0, 0.01], ids=["continuous", "sampled"])
def law(name, request):
    return replace(flown_by()[name][1].law, hold=request.param)


@pytest.fixture
def y(name):
    """What the law measures at the start of its mission."""
    mission, scheme = flown_by()[name]
    quiet = ca.DM.zeros(mission.truth.noise.size)
    measured = ca.DM(mission.truth.measure(0.0, ca.DM(mission.start), quiet))
    seen = ca.DM(Loop(mission, scheme).seen(measured))
    if scheme.navigation is None:
        return seen
    return ca.DM(scheme.flown.read(0.0, seen, ca.DM(scheme.flown.start(0.0, seen))))


def test_sizes_fit_the_layouts(name, law, y):
    m = law.start(0.0, y)
    wanted = law.command(0.0, y, m)
    assert ca.DM(m).shape == (law.memory.size, 1) or law.memory.size == 0
    assert wanted.shape == (flown_by()[name][1].actuation.effort.size, 1)
    assert law.rate(0.0, y, m, wanted, wanted).shape[0] == law.memory.size
    assert ca.DM(law.jump(0.0, y, m)).shape[0] == law.memory.size
    assert set(law.show(0.0, y, m)) == set(law.outputs.names)
    for signal in law.outputs.signals:
        assert ca.vec(law.show(0.0, y, m)[signal.name]).numel() == signal.size


def test_first_estimate_is_zero(law, y):
    """Unless the source's start is kept as printed."""
    shown = law.show(0.0, y, law.start(0.0, y))
    if "disturbance_estimate" in shown and "observer_start" not in law.printed:
        scale = 1 + np.abs(values(law.command(0.0, y, law.start(0.0, y)))).max()
        assert np.allclose(values(shown["disturbance_estimate"]), 0, atol=1e-12 * scale)


def test_advance_is_the_rate_for_a_short_hold(name, y, rng):
    """A hold of 1e-6 s: quotient and rate agree to what the second derivative leaves."""
    _, scheme = flown_by()[name]
    law = replace(scheme.law, hold=1e-6)
    if not law.memory.size:
        return
    m = values(law.start(0.0, y)) * (1 + 1e-3 * rng.uniform(-1, 1, law.memory.size))
    wanted = law.command(0.0, y, ca.DM(m))
    achieved = 0.5 * wanted
    quotient = (values(advance(law, 0.0, y, ca.DM(m), wanted, achieved)) - m) / 1e-6
    rate = values(law.rate(0.0, y, ca.DM(m), wanted, achieved))
    rounding = 1e-15 * np.abs(m).max() / 1e-6  # of memory that is large beside its rate
    assert np.allclose(quotient, rate, rtol=1e-3, atol=1e-5 * np.abs(rate).max() + rounding)


def test_everything_is_symbolic_and_differentiable_by_every_gain(name, y):
    _, scheme = flown_by()[name]
    law = scheme.law
    given = {
        key: ca.DM(getattr(law, key))
        for key, declared in gains_of(type(law)).items()
        if "choices" not in declared.metadata and getattr(law, key) is not None
    }
    symbols = {key: ca.SX.sym(key, *value.shape) for key, value in given.items()}
    tuned = replace(law, hold=law.hold or 0.01, **symbols)
    seen, m = ca.SX.sym("y", tuned.inputs.size), tuned.memory.symbol("m")
    wanted = tuned.command(0.0, seen, m)
    everything = ca.vertcat(wanted, advance(tuned, 0.0, seen, m, wanted, wanted / 2))
    gains = ca.vertcat(*(ca.vec(symbol) for symbol in symbols.values()))
    evaluate = ca.Function("gradient", [seen, m, *symbols.values()], [ca.jacobian(everything, gains)])
    at = evaluate(y, ca.DM(values(law.start(0.0, y))), *given.values())
    assert np.all(np.isfinite(np.array(ca.DM(at))))


def test_errata_say_what_they_are(name):
    assert all(len(sentence) > 20 for sentence in REGISTRY.find(name).errata.values())
    assert REGISTRY.find(name).__doc__


def test_gains_name_unit_and_meaning(name):
    for declared in gains_of(REGISTRY.find(name)).values():
        assert declared.metadata["unit"] or "choices" in declared.metadata
        assert declared.metadata["note"]


def test_checks_tell_consequence_remedy_and_source(name):
    for check in flown_by()[name][1].law.checks():
        assert np.isfinite(check.limit)
        assert check.consequence.endswith(".")
        assert check.remedy.endswith(".")
        assert check.source


@pytest.mark.parametrize("attitude_law", ATTITUDE)
def test_at_rest_at_the_target_only_the_known_torque_is_asked_for(attitude_law):
    law = flown_by()[attitude_law][1].law
    y = ca.DM.zeros(law.inputs.size)
    wanted = values(law.command(0.0, y, law.start(0.0, y)))
    feed_forward = -np.array(law.body.constant_torque) if law.memory.size else np.zeros(3)
    assert np.allclose(wanted, feed_forward, atol=1e-12)


@pytest.mark.parametrize("attitude_law", [*ATTITUDE, "two_observer_attitude", "finite_time_fault_tolerant"])
def test_a_pure_rate_is_braked(attitude_law):
    """The wanted torque opposes a small rate beyond the model's own terms."""
    law = flown_by()[attitude_law][1].law
    rate = np.array([1e-3, -2e-3, 1.5e-3])

    def measured(w: np.ndarray) -> ca.DM:
        return law.inputs.pack(
            **{n: ca.DM(w) if n == "rate" else ca.DM.zeros(law.inputs.signal(n).size) for n in law.inputs.names}
        )

    memory = law.start(0.0, measured(np.zeros(3)))
    wanted = [values(law.command(0.0, measured(w), memory)) for w in (rate, np.zeros(3))]
    assert (wanted[0] - wanted[1]) @ rate < 0
