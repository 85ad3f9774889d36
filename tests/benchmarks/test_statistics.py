"""Statistics against closed forms and brute force."""

import numpy as np
import pytest

from casadi_gnc.benchmarks.statistics import (
    charged,
    compare_times,
    performance_profile,
    shifted_geometric_mean,
)

LIMIT, SHIFT = 1.0, 1e-5


def test_shifted_geometric_mean_has_its_closed_forms(rng):
    assert shifted_geometric_mean(np.full(7, 3.0), 0.5) == pytest.approx(3.0, rel=1e-14)  # of equal times, that time
    seconds = rng.uniform(1e-6, 1e-3, 50)
    assert shifted_geometric_mean(seconds, 0.0) == pytest.approx(np.prod(seconds) ** (1 / 50), rel=1e-12)
    # With a large shift it becomes the arithmetic mean, to first order in time over shift.
    assert shifted_geometric_mean(seconds, 10.0) == pytest.approx(seconds.mean(), rel=1e-4)
    assert np.isnan(shifted_geometric_mean(np.zeros(0), SHIFT))


def test_a_sample_is_charged_its_least_pass_or_the_limit():
    nan = float("nan")
    passes = np.array([[2e-3, 5e-3, nan, 2.0, nan], [1e-3, nan, nan, 3.0, 1e-3]])
    good = np.array([True, True, True, True, False])
    assert charged(passes, good, LIMIT).tolist() == [1e-3, 5e-3, 1.0, 1.0, 1.0]


def family(rng, factor, noise=0.05, samples=40, passes=5):
    """Times that differ from sample to sample, each pass disturbed upwards only."""
    base = np.random.default_rng(7).lognormal(np.log(1e-4), 0.5, samples)
    return factor * base * (1 + rng.exponential(noise, (passes, samples))), np.ones(samples, dtype=bool)


def ratio(one, other):
    return compare_times([one], [other], limit=LIMIT, shift=0.0, draws=200)


def test_ratios_are_found_with_an_interval_that_holds_them(rng):
    found = ratio(family(rng, 2.0), family(rng, 1.0))
    assert found.low <= 2.0 <= found.high
    assert found.value == pytest.approx(2.0, rel=0.05)
    assert found.is_notable
    inverse = ratio(family(rng, 1.0), family(rng, 2.0))
    assert inverse.is_notable
    assert inverse.value == pytest.approx(0.5, rel=0.05)


def test_those_that_do_not_differ_are_said_not_to(rng):
    assert not any(ratio(family(rng, 1.0), family(rng, 1.0)).is_notable for _ in range(20))
    close = ratio(family(rng, 1.1, noise=0.001), family(rng, 1.0, noise=0.001))
    assert close.differs
    assert not close.is_notable
    # A difference that hangs on few samples is not beyond doubt.
    passes, good = family(rng, 1.0)
    passes[:, :2] *= 1e3
    few = ratio((passes, good), family(rng, 1.0))
    assert few.value > 1.2
    assert not few.is_notable


def test_failures_decide_a_ranking(rng):
    quick, right = family(rng, 0.1), family(rng, 1.0)
    failing = quick[0], np.arange(40) % 2 == 0
    assert ratio(quick, right).value < 0.2
    assert ratio(failing, right).is_notable
    assert ratio(failing, right).value > 10


def test_profile_is_the_share_within_a_factor():
    times = {"a": np.array([1.0, 1.0, 4.0, 9.0]), "b": np.array([2.0, 0.5, 9.0, 9.0])}
    found = performance_profile(times, limit=9.0, factors=np.array([1.0, 2.0, 3.0]))
    # Ratios to the faster: a 1, 2, 1, failed; b 2, 1, failed, failed.
    assert found["a"].tolist() == [0.5, 0.75, 0.75]
    assert found["b"].tolist() == [0.25, 0.5, 0.5]
