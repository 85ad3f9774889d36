"""Truth: published tables, SciPy's own test of quantiles, and the share of many campaigns whose bounds hold."""

import math

import numpy as np
import pytest
from scipy import integrate, stats

from casadi_gnc.campaigns.statistics import factor, flights_for_limits, limits, normal_limits, percentile
from casadi_gnc.campaigns.statistics.tolerance import passed_over
from casadi_gnc.errors import CampaignError


@pytest.mark.parametrize(
    ("count", "share"), [(10, 0.5), (59, 0.95), (100, 0.5), (1000, 0.99), (4000, 0.9973), (7, 0.01)]
)
@pytest.mark.parametrize("confidence", [0.8, 0.9, 0.99])
def test_bounds_are_those_of_scipys_quantile_test(rng, count, share, confidence):
    values = rng.normal(size=count)
    expected = stats.quantile_test(values, p=share).confidence_interval(confidence)
    found = percentile(values, share, confidence)
    for ours, theirs in [(found.low, expected.low), (found.high, expected.high)]:
        assert (ours == theirs) if math.isfinite(ours) else math.isnan(theirs)
    assert found.value == values[found.place] == np.quantile(values, share, method="inverted_cdf")


def test_percentile_bounds_hold_as_often_as_they_say(rng):
    """Coverage of order statistics is exact: 1000 campaigns of 300 flights, at least 95 % less 3 deviations."""
    truth = stats.expon.ppf(0.9)
    held = [(found := percentile(rng.exponential(size=300), 0.9, 0.95)).low <= truth <= found.high for _ in range(1000)]
    assert np.mean(held) > 0.95 - 3 * math.sqrt(0.95 * 0.05 / 1000)


def test_percentiles_take_what_is_never_reached():
    found = percentile([1.0, 2.0, math.inf, math.inf, 3.0], 0.9)
    assert (found.value, found.high) == (math.inf, math.inf)
    assert percentile([5.0], 0.5).value == 5.0
    assert percentile([5.0], 0.5).low == -math.inf


#: Fewest flights, by Wilks: share, confidence, orders 1, 2, 3 of one limit; orders 1, 2 on both sides.
WILKS = {
    (0.95, 0.95): ((59, 93, 124), (93, 153)),
    (0.95, 0.99): ((90, 130, 165), (130, None)),
    (0.90, 0.90): ((22, 38, 52), (38, None)),
    (0.99, 0.95): ((299, 473, 628), (473, None)),
    (0.90, 0.95): ((29, 46, 61), (46, None)),
}


@pytest.mark.parametrize("case", WILKS)
def test_numbers_of_flights_are_the_published_ones(case):
    """Guba, Makai and Pal (2003), tables 1 and 2; both sides of order p are one side of order 2p."""
    one, both = WILKS[case]
    assert tuple(flights_for_limits(*case, order=order) for order in (1, 2, 3)) == one
    for order, expected in enumerate(both, 1):
        if expected is not None:
            assert flights_for_limits(*case, "both", order=order) == expected
    count = one[1]
    assert passed_over(count, *case) == 2
    assert passed_over(count - 1, *case) == 1
    assert passed_over(one[0] - 1, *case) == 0


def test_limits_are_order_statistics():
    values = np.arange(1.0, 94.0)
    assert limits(values, 0.95, 0.95) == (-math.inf, 92.0)
    assert limits(values, 0.95, 0.95, "lower") == (2.0, math.inf)
    assert limits(values, 0.95, 0.95, "both") == (1.0, 93.0)
    assert limits(values[:58], 0.95, 0.95) == (-math.inf, math.inf)
    assert limits(values[:92], 0.95, 0.95, "both") == (-math.inf, math.inf)


#: Share, confidence, and factors by number of flights. Montgomery and Runger, Applied Statistics and Probability for
#: Engineers (2018), table XII.
ONE_SIDED = {
    (0.90, 0.90): {2: 10.253, 10: 2.066, 50: 1.559, 100: 1.470},
    (0.95, 0.95): {2: 26.260, 3: 7.656, 10: 2.911, 30: 2.220, 100: 1.927},
    (0.99, 0.95): {2: 37.094, 10: 3.981, 25: 3.158, 100: 2.684},
    (0.99, 0.99): {2: 185.617, 10: 5.074, 40: 3.249, 100: 2.850},
}
#: Meeker, Hahn and Escobar, Statistical Intervals (2017), tables J.5a and J.5b.
TWO_SIDED = {
    (0.50, 0.50): {2: 1.243, 10: 0.735, 30: 0.694, 480: 0.676},
    (0.90, 0.99): {2: 155.569, 10: 3.617, 30: 2.394, 480: 1.780},
    (0.95, 0.95): {2: 36.519, 5: 5.077, 10: 3.393, 30: 2.555, 120: 2.206, 480: 2.073},
    (0.99, 0.90): {2: 23.423, 10: 3.958, 30: 3.173, 480: 2.691},
    (0.99, 0.99): {2: 234.877, 10: 5.610, 30: 3.742, 480: 2.787},
}
#: ISO 16269-6:2014, annex F: the fourth digit is rounded up.
ISO = {
    (0.90, 0.90): {2: 15.5124, 16: 2.2537, 100: 1.8232, 1000: 1.6947},
    (0.95, 0.95): {5: 5.0769, 26: 2.6188, 200: 2.1430, 1000: 2.0362},
    (0.99, 0.99): {3: 28.5857, 15: 4.6212, 70: 3.2284, 1000: 2.7184},
}


@pytest.mark.parametrize("case", ONE_SIDED)
def test_one_sided_factors_are_the_published_ones(case):
    found = {flights: round(factor(flights, *case), 3) for flights in ONE_SIDED[case]}
    assert found == ONE_SIDED[case]


@pytest.mark.parametrize("case", TWO_SIDED)
def test_two_sided_factors_are_the_published_ones(case):
    found = {flights: round(factor(flights, *case, "both"), 3) for flights in TWO_SIDED[case]}
    assert found == TWO_SIDED[case]


@pytest.mark.parametrize("case", ISO)
def test_two_sided_factors_are_those_of_the_standard(case):
    found = {flights: math.ceil(factor(flights, *case, "both") * 1e4) / 1e4 for flights in ISO[case]}
    assert found == ISO[case]


@pytest.mark.parametrize("flights", [2, 7, 40, 1000, 100_000])
def test_one_sided_factors_by_another_integral(flights):
    """Over the mean's error instead of the noncentral t; the quadrature is good to 1e-9."""
    k, freedom, share = factor(flights, 0.9973, 0.9), flights - 1, stats.norm.ppf(0.9973)
    spread = 1 / math.sqrt(flights)

    def held(x: float) -> float:
        return stats.norm.pdf(x, scale=spread) * stats.chi2.sf(freedom * (max(share - x, 0.0) / k) ** 2, freedom)

    chance = integrate.quad(held, -9 * spread, 9 * spread, epsabs=1e-11, epsrel=1e-11, points=[0.0], limit=400)[0]
    assert abs(chance - 0.9) < 1e-8


@pytest.mark.parametrize("side", ["upper", "lower", "both"])
def test_normal_limits_hold_as_often_as_they_say(rng, side):
    values = rng.normal(3.0, 2.0, size=(20_000, 20))
    k, mean, deviation = factor(20, 0.9, 0.95, side), values.mean(axis=1), values.std(axis=1, ddof=1)
    low = np.full(20_000, -np.inf) if side == "upper" else mean - k * deviation
    high = np.full(20_000, np.inf) if side == "lower" else mean + k * deviation
    held = stats.norm.cdf(high, 3.0, 2.0) - stats.norm.cdf(low, 3.0, 2.0) >= 0.9
    assert abs(np.mean(held) - 0.95) < 4 * math.sqrt(0.95 * 0.05 / 20_000)
    assert np.allclose(normal_limits(values[0], 0.9, 0.95, side), (low[0], high[0]))


def test_what_cannot_be_said_is_told():
    for wrong, told in [
        (lambda: percentile([1.0, math.nan, 2.0], 0.5), "1 of 3 values are no number, the first at place 1"),
        (lambda: percentile([], 0.5), "0 flights"),
        (lambda: percentile([1.0], 1.0), "share of 1"),
        (lambda: percentile([1.0], 0.5, 0.0), "confidence of 0"),
        (lambda: normal_limits([1.0, math.inf], 0.9, 0.9), "no finite number"),
        (lambda: normal_limits([1.0], 0.9, 0.9), "at least 2"),
        (lambda: factor(1, 0.9, 0.9), "1 flights"),
        (lambda: flights_for_limits(0.9, 0.9, order=0), "order 0"),
    ]:
        with pytest.raises(CampaignError, match=told):
            wrong()
