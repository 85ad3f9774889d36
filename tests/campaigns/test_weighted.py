"""Truth: shares and percentiles of the normal law, in many campaigns; equal weights against the plain statistics."""

import math

import numpy as np
import pytest
from scipy import stats

from casadi_gnc.campaigns import Importance
from casadi_gnc.campaigns.statistics import (
    convergence,
    effective_flights,
    percentile,
    share_bounds,
    weighted_mean,
    weighted_percentile,
    weighted_share,
)
from casadi_gnc.errors import CampaignError
from casadi_gnc.mathematics import normal

PLAN = Importance((3.0, 4.0), 4.0)


def campaign(seed: int, flights: int) -> tuple[np.ndarray, np.ndarray]:
    """Return a metric that is standard normal, and the weights of a plan that prefers its upper end."""
    z = normal.quantile(PLAN.points(seed, 0, flights))
    return z @ np.array([0.6, 0.8]), PLAN.weights(seed, 0, flights)


def test_weighted_bounds_hold_nearly_as_often_as_they_say():
    """400 campaigns of 500 flights: 90 % within 4 deviations of counting and 2 % for normal theory."""
    truths = (stats.norm.sf(4), stats.norm.ppf(0.9999), 0.0)
    held = []
    for seed in range(400):
        values, weights = campaign(seed, 500)
        share, upper = weighted_share(values > 4, weights, 0.9), weighted_percentile(values, weights, 0.9999, 0.9)
        found = (share, upper, weighted_mean(values, weights, 0.9))
        held.append([each.low <= truth <= each.high for each, truth in zip(found, truths, strict=True)])
    assert np.all(np.abs(np.mean(held, axis=0) - 0.9) < 4 * math.sqrt(0.9 * 0.1 / 400) + 0.02)


def test_importance_is_worth_it():
    """500 flights tell a share of 3.2e-5 to 25 %; counted ones would see none."""
    values, weights = campaign(1, 500)
    found = weighted_share(values > 4, weights, 0.9)
    assert found.high / found.low < 1.6
    assert effective_flights(weights[values > 4]) > 50


def test_equal_weights_are_plain(rng):
    values, ones = rng.normal(size=1000), np.ones(1000)
    for share in (0.01, 0.5, 0.99):
        plain, weighed = percentile(values, share), weighted_percentile(values, ones, share)
        assert weighed.value == plain.value
        assert values[weighed.place] == plain.value
        ranks = [int(np.count_nonzero(values <= each)) for each in (plain.low, weighed.low, plain.high, weighed.high)]
        assert abs(ranks[0] - ranks[1]) <= 2
        assert abs(ranks[2] - ranks[3]) <= 2
    plain, weighed = share_bounds(100, 1000, 0.9), weighted_share(np.arange(1000) < 100, ones, 0.9)
    assert weighed.value == plain.value
    assert np.allclose([weighed.low, weighed.high], [plain.low, plain.high], rtol=0.02)
    assert effective_flights(ones) == 1000
    assert weighted_mean(values, ones).value == pytest.approx(values.mean(), abs=1e-15)


def test_none_chosen_leaves_an_upper_bound():
    found = weighted_share(np.zeros(100, dtype=bool), np.full(100, 0.5), 0.9)
    assert (found.value, found.low) == (0.0, 0.0)
    assert found.high == pytest.approx(0.5 * (1 - 0.05 ** (1 / 100)))
    assert effective_flights(np.array([])) == 0.0


def test_convergence_is_the_estimate_of_the_first_flights(rng):
    values = rng.normal(size=3000)
    found = convergence(3000, lambda n: percentile(values[:n], 0.9), first=50, steps=12)
    assert found.flights[0] == 50
    assert found.flights[-1] == 3000
    assert len(found.flights) == 12
    for n, value, low, high in zip(found.flights, found.value, found.low, found.high, strict=True):
        expected = percentile(values[:n], 0.9)
        assert (value, low, high) == (expected.value, expected.low, expected.high)
    assert convergence(1, lambda n: share_bounds(n, n)).flights.tolist() == [1]


def test_what_cannot_be_weighed_is_told():
    ones = np.ones(3)
    for wrong, told in [
        (lambda: weighted_share(ones > 0, np.ones(2)), "3 flights with 2 weights"),
        (lambda: weighted_percentile(ones, np.ones(2), 0.5), "3 values with 2 weights"),
        (lambda: weighted_mean(ones, np.ones(2)), "3 values with 2 weights"),
        (lambda: weighted_percentile(ones, np.array([1.0, 0.0, 1.0]), 0.5), "a weight of 0"),
        (lambda: convergence(0, lambda n: share_bounds(n, n)), "convergence of 0 flights"),
    ]:
        with pytest.raises(CampaignError, match=told):
            wrong()
