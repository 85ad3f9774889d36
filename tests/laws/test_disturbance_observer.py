"""Truth: the closed form of a constant disturbance on p' = known + d."""

import casadi as ca
import numpy as np
import pytest

from casadi_gnc.laws import DisturbanceObserver
from casadi_gnc.mathematics import exact

KNOWN, DISTURBANCE, HOLD = 0.3, -0.7, 0.1


def estimates(observer: DisturbanceObserver, samples: int = 400, known: float = KNOWN) -> np.ndarray:
    """Run the observer beside the exact solution of the plant, z advanced exactly under held input."""
    p, z = 2.0, float(observer.start(2.0))
    gain, found = observer.gain, []
    for _ in range(samples):
        found.append(float(observer.estimate(z, p)))
        z += HOLD * exact.phi1(-gain * HOLD) * observer.rate(z, p, known)
        p += HOLD * (known + DISTURBANCE)
    return np.array(found)


@pytest.mark.parametrize("beta_h", [0.1, 0.5, 1.0, 2.0, 2.7, 5.0])
def test_sampled_estimate_converges_with_pole_exp_minus_beta_h(beta_h):
    found = estimates(DisturbanceObserver(beta_h / HOLD, HOLD))
    expected = DISTURBANCE * (1 - np.exp(-beta_h) ** np.arange(len(found)))
    assert np.allclose(found, expected, atol=1e-10)


@pytest.mark.parametrize("beta_h", [0.5, 1.0, 2.0, 2.7, 5.0])
def test_held_measurement_form_does_not_converge(beta_h):
    """With the continuous feed-through p' = known + d is seen beta h/(1 - e^(-beta h)) times too large."""
    continuous = DisturbanceObserver(beta_h / HOLD)
    found = estimates(continuous)
    wrong = (KNOWN + DISTURBANCE) * beta_h / (1 - np.exp(-beta_h)) - KNOWN
    assert abs(found[-1] - wrong) < 1e-9
    assert abs(found[-1] - DISTURBANCE) > 0.1 * abs(DISTURBANCE)


def test_factor_of_the_design_note():
    found = estimates(DisturbanceObserver(27.0), known=0.0)
    assert found[-1] / DISTURBANCE == pytest.approx(2.9, abs=0.02)


def test_continuous_observer_has_its_pole_at_minus_beta():
    z, p, d = (ca.SX.sym(name) for name in "zpd")
    observer = DisturbanceObserver(4.0)
    error_rate = observer.rate(z, p, KNOWN) + observer.through * (KNOWN + d)
    rate = ca.Function("rate", [z, p, d], [error_rate, observer.gain * (d - observer.estimate(z, p))])
    found, expected = rate(0.3, 0.7, -2.0)
    assert float(found) == pytest.approx(float(expected), abs=1e-14)


def test_feed_through_returns_to_beta_and_start_estimates_nothing():
    assert DisturbanceObserver(3.0, 1e-9).through == pytest.approx(3.0)
    observer = DisturbanceObserver(3.0, 0.1)
    assert observer.estimate(observer.start(5.0), 5.0) == 0
