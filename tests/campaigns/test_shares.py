"""Truth: SciPy's binomial test, a share known in closed form in 1000 campaigns, and counting by brute force."""

import math

import numpy as np
import pytest
from scipy import stats

from casadi_gnc.campaigns import Direction, Independent, Normal
from casadi_gnc.campaigns.statistics import Verdict, bounds_at_all_times, flights_needed, judge, share_bounds
from casadi_gnc.errors import CampaignError


@pytest.mark.parametrize(("passed", "flights"), [(0, 1), (1, 1), (0, 59), (851, 852), (500, 1000), (9973, 10_000)])
@pytest.mark.parametrize("confidence", [0.5, 0.9, 0.999])
def test_bounds_are_those_of_clopper_and_pearson(passed, flights, confidence):
    expected = stats.binomtest(passed, flights).proportion_ci(confidence, "exact")
    found = share_bounds(passed, flights, confidence)
    assert np.allclose([found.low, found.high], [expected.low, expected.high], rtol=1e-9, atol=0)
    assert found.value == passed / flights


def test_a_share_known_in_closed_form_is_inside_its_bounds():
    """Of a direction uniform on the sphere the height is uniform: the share above 0.8 is 0.1; 2000 flights a campaign.

    The bounds hold in at least 95 %.
    """
    held = 0
    for seed in range(1000):
        heights = Direction().at(Independent(2).points(seed, 0, 2000))[:, 2]
        found = share_bounds(int(np.count_nonzero(heights > 0.8)), 2000, 0.95)
        held += found.low <= 0.1 <= found.high
    assert 930 <= held <= 970


def test_verdicts_are_wrong_no_more_often_than_they_may_be():
    """Where just the required share passes either verdict is wrong: each in at most 10 % plus 3 deviations."""
    verdicts = []
    for seed in range(1000):
        values = Normal(0.0, 1.0).at(Independent(1).points(seed, 0, 1500))
        verdicts.append(judge(int(np.count_nonzero(values < stats.norm.ppf(0.99))), 1500, 0.99, 0.9).verdict)
    allowed = 100 + 3 * math.sqrt(1000 * 0.1 * 0.9)
    assert 0 < verdicts.count(Verdict.MET) < allowed
    assert 0 < verdicts.count(Verdict.NOT_MET) < allowed


def test_verdicts():
    found = judge(100, 100, 0.95, 0.95)
    assert (found.verdict, found.more_if_all_pass, found.more_at_this_rate) == (Verdict.MET, 0, 0)
    found = judge(0, 3, 0.95, 0.95)
    assert (found.verdict, found.more_at_this_rate) == (Verdict.NOT_MET, 0)
    assert found.share.low == 0.0
    found = judge(40, 40, 0.95, 0.95)
    assert (found.verdict, found.more_if_all_pass, found.more_at_this_rate) == (Verdict.UNDECIDED, 19, 19)


@pytest.mark.parametrize(
    ("share", "confidence", "failed"), [(0.9, 0.9, 0), (0.95, 0.95, 2), (0.9973, 0.9, 1), (0.5, 0.6, 4)]
)
def test_flights_needed_by_counting(share, confidence, failed):
    """Met from the first n on for which so few failures have a chance of at most 1 - confidence."""
    count = failed + 1
    while stats.binom.cdf(failed, count, 1 - share) > 1 - confidence:
        count += 1
    assert flights_needed(share, confidence, failed) == count
    assert judge(count - failed, count, share, confidence).verdict is Verdict.MET
    before = judge(count - 1 - failed, count - 1, share, confidence)
    assert before.verdict is not Verdict.MET
    assert before.more_if_all_pass == 1


@pytest.mark.parametrize(("passed", "flights", "share"), [(97, 100, 0.95), (92, 100, 0.95), (1993, 2000, 0.9973)])
def test_more_flights_at_this_rate_decide(passed, flights, share):
    found = judge(passed, flights, share, 0.9)
    assert found.verdict is Verdict.UNDECIDED
    # Whole multiples of the campaign are decided from some number of it on; what is told lies just before.
    multiple = 2
    while judge(multiple * passed, multiple * flights, share, 0.9).verdict is Verdict.UNDECIDED:
        multiple += 1
    expected = Verdict.MET if passed / flights > share else Verdict.NOT_MET
    assert judge(multiple * passed, multiple * flights, share, 0.9).verdict is expected
    assert found.more_at_this_rate is not None
    assert (multiple - 2) * flights < found.more_at_this_rate <= (multiple - 1) * flights


def test_nothing_decides_at_the_share_itself():
    assert judge(95, 100, 0.95, 0.9).more_at_this_rate is None


def test_bounds_at_all_times_hold_whenever_one_stops(rng):
    """After every one of 2000 flights at once, in at least 90 %; fixed bounds are left by many more campaigns."""
    share, left, left_fixed = 0.9, 0, 0
    places = np.unique(np.geomspace(1, 2000, 60).astype(int))
    for _ in range(300):
        passed = np.cumsum(rng.random(2000) < share)[places - 1]
        all_times = [bounds_at_all_times(int(k), int(n), 0.9) for k, n in zip(passed, places, strict=True)]
        left += any(not each.low <= share <= each.high for each in all_times)
        fixed = [share_bounds(int(k), int(n), 0.9) for k, n in zip(passed, places, strict=True)]
        left_fixed += any(not each.low <= share <= each.high for each in fixed)
    assert left <= 30
    assert left_fixed > 60


@pytest.mark.parametrize(("passed", "flights"), [(0, 5), (5, 5), (1, 10**6), (10**6 - 1, 10**6), (300, 1000)])
def test_bounds_at_all_times_end_where_the_mixture_says(passed, flights):
    """B(k + 1/2, n - k + 1/2)/B(1/2, 1/2) over the likelihood is 1/(1 - confidence) at each end."""
    found = bounds_at_all_times(passed, flights, 0.9)
    assert found.low <= passed / flights <= found.high
    prior = stats.betabinom(flights, 0.5, 0.5)
    for end in (found.low, found.high):
        if 0.0 < end < 1.0:
            ratio = prior.logpmf(passed) - stats.binom.logpmf(passed, flights, end)
            assert abs(ratio - math.log(10)) < 1e-4
    assert (found.low == 0.0) == (passed == 0)
    assert (found.high == 1.0) == (passed == flights)


def test_judging_at_all_times_asks_for_more_flights():
    once, always = judge(900, 900, 0.9973, 0.9), judge(900, 900, 0.9973, 0.9, at_all_times=True)
    assert once.verdict is Verdict.MET
    assert always.verdict is Verdict.UNDECIDED
    assert (
        judge(900 + always.more_if_all_pass, 900 + always.more_if_all_pass, 0.9973, 0.9, at_all_times=True).verdict
        is Verdict.MET
    )


def test_what_cannot_be_judged_is_told():
    for wrong, told in [
        (lambda: share_bounds(3, 2), "3 of 2 flights"),
        (lambda: share_bounds(0, 0), "0 of 0 flights"),
        (lambda: judge(1, 2, 1.0, 0.9), "share of 1"),
        (lambda: judge(1, 2, 0.9, 90), "confidence of 90"),
        (lambda: flights_needed(0.9, 0.9, -1), "-1 flights"),
    ]:
        with pytest.raises(CampaignError, match=told):
            wrong()
