"""Truth: shares known in closed form or by one integral, of limits with one region of failure and with several."""

import math

import numpy as np
import pytest
from scipy import integrate, stats

from casadi_gnc.campaigns.rare import line_sampling, subset_simulation, towards_failure
from casadi_gnc.errors import CampaignError


def linear(distance: float, dimensions: int):
    unit = np.ones(dimensions) / math.sqrt(dimensions)
    return lambda z: distance - z @ unit, stats.norm.sf(distance)


def parabolic(distance: float, curvature: float, dimensions: int):
    """Failure beyond distance + curvature/2 times a chi-square number of d - 1."""

    def part(x: float) -> float:
        return stats.norm.sf(distance + 0.5 * curvature * x) * stats.chi2.pdf(x, dimensions - 1)

    share = integrate.quad(part, 0, 200, epsabs=0, epsrel=1e-9, limit=200)[0]
    return lambda z: distance - z[:, -1] + 0.5 * curvature * (z[:, :-1] ** 2).sum(axis=1), share


def series(distances: tuple[float, ...]):
    """Failure of the first part to fail, parts independent."""
    ends = np.array(distances)
    share = -np.expm1(np.log1p(-stats.norm.sf(ends)).sum())
    return lambda z: (ends - z[:, : len(ends)]).min(axis=1), share


def both_sides(distance: float):
    return lambda z: distance - np.abs(z[:, 0]), 2 * stats.norm.sf(distance)


PROBLEMS = {
    "linear": (10, *linear(4.5, 10)),
    "linear in 30": (30, *linear(4.5, 30)),
    "parabolic": (5, *parabolic(4.0, 0.3, 5)),
    "series": (6, *series((4.5, 4.7, 5.0))),
    "both sides": (3, *both_sides(4.8)),
}


@pytest.mark.parametrize("name", PROBLEMS)
def test_subset_simulation_finds_the_share(name):
    """12 campaigns for 90 % bounds: 4 or more misses have a chance of 3 %, 6 or more of 5e-4 if the bounds hold.

    Shares are a few millionths; the mean of 12 is within 4 of its own deviations, and 5 % for the bias of few cases.
    """
    dimensions, margins, truth = PROBLEMS[name]
    assert truth < 1e-5
    found = [subset_simulation(margins, dimensions, seed) for seed in range(12)]
    assert sum(not each.share.low <= truth <= each.share.high for each in found) < 6
    ratios = np.array([each.share.value / truth for each in found])
    assert abs(ratios.mean() - 1) < 4 * ratios.std(ddof=1) / math.sqrt(12) + 0.05
    assert min(each.effective for each in found) > 5
    assert max(each.share.high / each.share.low for each in found) < 8
    assert all(each.flights < 80_000 for each in found)
    assert all(np.all(margins(each.failed) <= 0) for each in found)


LINES = {"linear": None, "linear in 30": None, "parabolic": None, "both sides": np.array([1.0, 0.0, 0.0])}


@pytest.mark.parametrize("name", LINES)
def test_line_sampling_finds_the_share(name):
    """As above, of 60 campaigns: 16 misses have a chance of 1e-4. Crossings are known to 1e-4, shares to 1e-3."""
    dimensions, margins, truth = PROBLEMS[name]
    found = [line_sampling(margins, dimensions, seed, direction=LINES[name]) for seed in range(60)]
    assert sum(not each.share.low * 0.999 <= truth <= each.share.high * 1.001 for each in found) < 16
    ratios = np.array([each.share.value / truth for each in found])
    assert abs(ratios.mean() - 1) < 4 * ratios.std(ddof=1) / math.sqrt(60) + 1e-3
    assert min(each.effective for each in found) > 30
    assert max(each.flights for each in found) < 4000


def test_a_direction_that_serves_badly_shows():
    """Three parts in series fail on three sides; along their middle few lines make up the share."""
    dimensions, margins, _ = PROBLEMS["series"]
    direction = np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])
    found = [line_sampling(margins, dimensions, seed, lines=400, direction=direction) for seed in range(10)]
    assert max(each.effective for each in found) < 10


def test_lines_keep_the_digits_of_tiny_shares():
    """1e-15 on either side of the middle, and nearly all."""
    for sign in (1.0, -1.0):
        found = line_sampling(lambda z, sign=sign: 7.9 - sign * z[:, 0], 2, 1, lines=5, direction=np.array([1.0, 0.0]))
        assert found.share.value == pytest.approx(stats.norm.sf(7.9), rel=2e-3)
    found = line_sampling(lambda z: -3.0 - z[:, 0], 2, 1, lines=5, direction=np.array([1.0, 0.0]))
    assert found.share.value == pytest.approx(stats.norm.cdf(3.0), rel=1e-5)
    band = line_sampling(lambda z: np.abs(z[:, 0] - 3.0) - 0.7, 2, 1, lines=5, direction=np.array([1.0, 0.0]))
    assert band.share.value == pytest.approx(stats.norm.sf(2.3) - stats.norm.sf(3.7), rel=1e-3)


def test_margins_that_only_pass_or_fail_serve_lines():
    found = line_sampling(lambda z: np.where(z[:, 0] > 4.0, -1.0, 1.0), 3, 1, direction=np.array([1.0, 0.0, 0.0]))
    assert found.share.value == pytest.approx(stats.norm.sf(4.0), rel=1e-3)
    found = line_sampling(lambda z: np.where(z[:, 0] > 4.0, -np.inf, np.inf), 3, 1, direction=np.array([2.0, 0.0, 0.0]))
    assert found.share.value == pytest.approx(stats.norm.sf(4.0), rel=1e-3)


def test_margins_in_steps_are_counted_right():
    """Margins of whole numbers: more than the part kept is at the edge, and none of it is lost."""
    found = subset_simulation(lambda z: np.ceil(2 * (4.0 - z[:, 0])), 3, 5)
    assert found.share.low <= stats.norm.sf(4.0) <= found.share.high


def test_shares_that_are_not_rare():
    found = subset_simulation(lambda z: 0.5 - z[:, 0], 2, 1)
    assert found.flights == 10_000
    assert abs(found.share.value - stats.norm.sf(0.5)) < 4 * math.sqrt(0.31 * 0.69 / 10_000)


def test_lines_that_do_not_fail_leave_an_upper_bound():
    found = line_sampling(lambda z: 1.0 + z[:, 0] ** 2, 2, 1, lines=50, direction=np.array([1.0, 0.0]))
    assert (found.share.value, found.share.low) == (0.0, 0.0)
    assert found.share.high == pytest.approx(1 - 0.05 ** (1 / 50))
    assert len(found.failed) == 0


def test_the_direction_is_that_of_the_nearest_failure():
    curved = np.array([3.0, -1.0, 2.0])

    def margins(z: np.ndarray) -> np.ndarray:
        return 20.0 - z @ curved - 0.3 * z[:, 0] ** 2

    nearest = towards_failure(margins, 3, rounds=20)
    assert abs(margins(nearest[None])[0]) < 1e-6
    others = np.random.default_rng(1).normal(size=(200_000, 3)) * 3
    failing = others[margins(others) <= 0]
    assert np.linalg.norm(failing, axis=1).min() > np.linalg.norm(nearest)


@pytest.mark.parametrize("sample", [subset_simulation, line_sampling])
def test_a_seed_flies_the_same_cases(sample):
    margins, _ = parabolic(4.0, 0.3, 5)
    seen = []

    def watched(z: np.ndarray) -> np.ndarray:
        seen.append(z.copy())
        return margins(z)

    first, again, other = (sample(watched, 5, seed) for seed in (3, 3, 4))
    assert first.share == again.share != other.share
    assert first.flights + again.flights + other.flights == sum(map(len, seen))


def test_what_cannot_be_sampled_is_told():
    def flat(z: np.ndarray) -> np.ndarray:
        return np.ones(len(z))

    for wrong, told in [
        (lambda: subset_simulation(flat, 2, 1, cases=100, runs=2), "20 levels led to no failure.*smallest margin is 1"),
        (lambda: subset_simulation(flat, 0, 1), "0 dimensions"),
        (lambda: subset_simulation(flat, 2, 1, cases=1001), "1001 cases of which 0.1"),
        (lambda: subset_simulation(flat, 2, 1, kept=0.0), "of which 0 are kept"),
        (lambda: subset_simulation(flat, 2, 1, runs=1), "1 runs"),
        (lambda: subset_simulation(lambda z: z, 2, 1), "shape .10000, 2. for 10000 cases"),
        (lambda: subset_simulation(lambda z: z[:, 0] * math.nan, 2, 1), "no number; let what cannot be flown"),
        (lambda: line_sampling(flat, 2, 1), "no slope"),
        (lambda: line_sampling(flat, 2, 1, direction=np.zeros(2)), "not zero"),
        (lambda: line_sampling(flat, 2, 1, direction=np.ones(3)), "3 numbers"),
        (lambda: line_sampling(flat, 2, 1, lines=1), "1 lines"),
    ]:
        with pytest.raises(CampaignError, match=told):
            wrong()
