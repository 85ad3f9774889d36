"""Truth: indices of two standard functions in closed form, SciPy's own estimators, correlations known exactly."""

import math

import numpy as np
import pytest
from scipy import stats

from casadi_gnc.campaigns import Grid, Independent, LatinHypercube, PickFreeze, Sobol
from casadi_gnc.campaigns.statistics import first_order, indices, rank_correlations
from casadi_gnc.errors import CampaignError


def ishigami(u: np.ndarray) -> np.ndarray:
    """Ishigami and Homma (1990), a = 7, b = 0.1; inputs uniform from -pi to pi."""
    x = math.pi * (2 * u - 1)
    return np.sin(x[:, 0]) + 7 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])


def ishigami_indices() -> tuple[np.ndarray, np.ndarray]:
    """By integration: V1 = (1 + b pi^4/5)^2/2, V2 = a^2/8, V13 = 8 b^2 pi^8/225."""
    one, two, both = 0.5 * (1 + 0.1 * math.pi**4 / 5) ** 2, 49 / 8, 8 * 0.01 * math.pi**8 / 225
    return np.array([one, two, 0.0]) / (one + two + both), np.array([one + both, two, both]) / (one + two + both)


A = np.array([0.0, 1.0, 4.5, 9.0, 99.0, 99.0])


def sobol_g(u: np.ndarray) -> np.ndarray:
    """Saltelli and Sobol (1995): the product of (|4u - 2| + a)/(1 + a)."""
    return np.prod((np.abs(4 * u - 2) + A) / (1 + A), axis=1)


def sobol_g_indices() -> tuple[np.ndarray, np.ndarray]:
    parts = 1 / (3 * (1 + A) ** 2)
    whole = np.prod(1 + parts)
    return parts / (whole - 1), parts * whole / (1 + parts) / (whole - 1)


FUNCTIONS = {"ishigami": (ishigami, ishigami_indices()), "sobol g": (sobol_g, sobol_g_indices())}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_indices_are_inside_their_bounds(name):
    """40 campaigns of 512 blocks; bounds of 95 % miss 5 %, and up to twice what a binomial law allows at 1e-4.

    Twice, since bounds of one campaign miss together.
    """
    function, truth = FUNCTIONS[name]
    size = len(truth[0])
    plan = PickFreeze(Independent(2 * size), (1,) * size)
    missed = 0
    for seed in range(40):
        found = indices(function(plan.points(seed, 0, 512 * plan.block)), size, 0.95, resamples=300, seed=seed)
        for estimates, values in [(found.first, truth[0]), (found.total, truth[1])]:
            missed += sum(not each.low <= value <= each.high for each, value in zip(estimates, values, strict=True))
    assert 0 < missed < 2 * stats.binom.isf(1e-4, 80 * size, 0.05)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_sobol_points_are_far_closer(name):
    function, truth = FUNCTIONS[name]
    size = len(truth[0])
    plan = PickFreeze(Sobol(2 * size), (1,) * size)
    found = indices(function(plan.points(3, 0, 4096 * plan.block)), size, 0.95, resamples=200)
    for estimates, values in [(found.first, truth[0]), (found.total, truth[1])]:
        for each, value in zip(estimates, values, strict=True):
            assert each.low <= value <= each.high
            assert abs(each.value - value) < 0.01


def test_indices_are_scipys():
    """The same flights through `scipy.stats.sobol_indices`: its first-order and total estimators are the same."""
    plan = PickFreeze(Sobol(6), (1, 1, 1))
    blocks = ishigami(plan.points(1, 0, 256 * 5)).reshape(256, 5)
    # Both take the outputs less their mean; SciPy pools A and B for the variance as we do.
    given = {"f_A": blocks[:, :1].T, "f_B": blocks[:, 1:2].T, "f_AB": blocks[:, 2:].T[:, None, :]}
    expected = stats.sobol_indices(func=given, n=256)
    found = indices(blocks.ravel(), 3, resamples=10)
    assert np.allclose([each.value for each in found.first], np.ravel(expected.first_order), atol=1e-12)
    assert np.allclose([each.value for each in found.total], np.ravel(expected.total_order), atol=1e-12)


def test_groups_count_as_one():
    """Inputs 1 and 3 of Ishigami's function together explain all but input 2's part, with no interaction left."""
    first, _ = ishigami_indices()
    plan = PickFreeze(Sobol(6), (2, 1))
    found = indices(ishigami(plan.points(2, 0, 2048 * 4)[:, [0, 2, 1]]), 2, 0.95)
    for each in (found.first[0], found.total[0]):
        assert each.low <= 1 - first[1] <= each.high
        assert abs(each.value - 1 + first[1]) < 0.01


def test_noise_is_no_input(rng):
    """With the same noise in a block, noise adds to the variance and to no input's part of it."""
    plan = PickFreeze(Sobol(4), (1, 1))
    noise = 2 * rng.normal(size=4096)[plan.noise_numbers(0, 4096 * 4)]
    points = plan.points(6, 0, 4096 * 4)
    found = indices(points @ np.array([math.sqrt(12), 0.0]) + noise, 2, 0.99)
    for each, value in zip([*found.first, *found.total], (0.2, 0.0, 0.2, 0.0), strict=True):
        assert each.low - 1e-12 <= value <= each.high + 1e-12
        assert abs(each.value - value) < 0.02


def test_bounds_depend_on_the_seed_alone():
    plan = PickFreeze(Independent(6), (1, 1, 1))
    outputs = ishigami(plan.points(0, 0, 50 * 5))
    assert indices(outputs, 3, seed=1) == indices(outputs, 3, seed=1)
    assert indices(outputs, 3, seed=1) != indices(outputs, 3, seed=2)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_first_order_indices_from_any_flights_are_inside_their_bounds(name):
    """60 campaigns of 1000 flights; misses as above."""
    function, truth = FUNCTIONS[name]
    missed = 0
    for seed in range(60):
        points = Independent(len(truth[0])).points(seed, 0, 1000)
        found = first_order(points, function(points), 0.95)
        missed += sum(not each.low <= value <= each.high for each, value in zip(found, truth[0], strict=True))
    bounds = 60 * len(truth[0])
    assert 0 < missed < 2 * stats.binom.isf(1e-4, bounds, 0.05)


@pytest.mark.parametrize("plan", [LatinHypercube(3, 4096), Sobol(3)], ids=["latin", "sobol"])
def test_first_order_indices_of_even_plans(plan):
    points = plan.points(5, 0, 4096)
    for each, value in zip(first_order(points, ishigami(points), 0.99), ishigami_indices()[0], strict=True):
        assert each.low <= value <= each.high
        assert abs(each.value - value) < 0.03


def test_sobol_neighbours_do_not_mislead():
    """Of a Sobol plan bounds must hold at every size, of a function that no input drives alone."""
    for flights in (64, 256, 1000, 8192):
        points = Sobol(3).points(1, 0, flights)
        for each in first_order(points, np.prod(points - 0.5, axis=1), 0.95):
            assert each.low <= 0.0 <= each.high


def test_first_order_indices_of_choices(rng):
    """Of a sum of a coin, a die and noise: variances 1/4, 35/12 and 1."""
    inputs = np.stack([rng.integers(0, 2, 3000), rng.integers(1, 7, 3000), rng.normal(size=3000)], axis=1)
    found = first_order(inputs, inputs.sum(axis=1), 0.99)
    for each, variance in zip(found, (1 / 4, 35 / 12, 1.0), strict=True):
        assert each.low <= variance / (1 / 4 + 35 / 12 + 1) <= each.high


def test_equal_inputs_are_put_in_random_order():
    """On a grid flights that follow each other share other inputs too, and would share a cell."""
    points = Grid((45, 10, 9)).points(0, 0, 4050)
    found = first_order(points, points @ np.array([1.0, 2.0, 0.0]))
    for each, value in zip(found, (0.2, 0.8, 0.0), strict=True):
        assert abs(each.value - value) < 0.02


def test_rank_correlations_are_scipys(rng):
    inputs = np.round(rng.normal(size=(200, 3)), 1)
    output = inputs[:, 0] - 0.3 * inputs[:, 1] ** 3 + rng.normal(size=200)
    output[:5] = math.inf
    for each, column in zip(rank_correlations(inputs, output), inputs.T, strict=True):
        assert abs(each.value - stats.spearmanr(column, output).statistic) < 1e-12


def test_rank_correlations_are_inside_their_bounds(rng):
    """Of bivariate normal numbers Spearman's is 6/pi asin(r/2); 600 campaigns of 100, 90 % within 4 deviations."""
    truth, held = 6 / math.pi * math.asin(0.6 / 2), 0
    for _ in range(600):
        first, other = rng.normal(size=(2, 100))
        found = rank_correlations(first, 0.6 * first + 0.8 * other, 0.9)[0]
        held += found.low <= truth <= found.high
    assert abs(held / 600 - 0.9) < 4 * math.sqrt(0.9 * 0.1 / 600)


def test_edges():
    rising = np.arange(10.0)
    assert rank_correlations(rising, np.exp(rising))[0].value == 1.0
    assert rank_correlations(rising, -rising)[0].low == -1.0
    assert math.isnan(rank_correlations(np.ones(10), rising)[0].value)
    assert math.isnan(first_order(rising, np.ones(10))[0].value)


def test_what_cannot_be_said_is_told():
    rising = np.arange(10.0)
    for wrong, told in [
        (lambda: rank_correlations(rising[:3], rising[:3]), "3 flights; this takes at least 4"),
        (lambda: rank_correlations(np.ones((9, 2)), rising), "shape .9, 2. for 10 flights"),
        (lambda: first_order(rising[:9], rising[:9]), "at least 10"),
        (lambda: first_order(rising, np.append(rising[1:], math.inf)), "no finite number"),
        (lambda: indices(rising, 2), "blocks of 4"),
        (lambda: indices(rising[:4], 2), "at least two"),
        (lambda: indices(np.ones(8), 2), "never change"),
    ]:
        with pytest.raises(CampaignError, match=told):
            wrong()
