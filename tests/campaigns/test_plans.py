"""Truth: what each plan promises, counted; and that rows depend on nothing but seed, plan and number of the case."""

import itertools
import math

import numpy as np
import pytest
from scipy import stats
from scipy.stats import qmc

from casadi_gnc.campaigns.designs import Corners, Grid, OneAtATime
from casadi_gnc.campaigns.draws import Purpose, uniforms, words
from casadi_gnc.campaigns.importance import Importance
from casadi_gnc.campaigns.permutation import permuted
from casadi_gnc.campaigns.pick_freeze import PickFreeze
from casadi_gnc.campaigns.plans import Independent, LatinHypercube, Sobol
from casadi_gnc.errors import CampaignError
from casadi_gnc.mathematics import noise, normal

PLANS = {
    "independent": Independent(5),
    "latin": LatinHypercube(5, 1000),
    "latin of a prime": LatinHypercube(3, 997),
    "sobol": Sobol(7),
    "corners": Corners(10),
    "grid": Grid((10, 1, 4, 25), ends=(0.1, 0.9)),
    "one at a time": OneAtATime(500, (0.0, 1.0)),
    "importance": Importance((1.0, 0.0, -2.0), 3.0),
    "importance of sobol": Importance((1.0, 0.0, -2.0), 3.0, left=0.2, base=Sobol(4)),
    "pick and freeze": PickFreeze(Sobol(10), (1, 3, 1)),
    "pick and freeze of latin": PickFreeze(LatinHypercube(10, 250), (1, 3, 1)),
}
SEED = 2**63 + 12345


@pytest.mark.parametrize("name", PLANS)
def test_any_split_gives_the_same_rows(name):
    plan = PLANS[name]
    count = min(plan.cases or 1000, 1000)
    whole, weights = plan.points(SEED, 0, count), plan.weights(SEED, 0, count)
    assert whole.shape == (count, plan.dimensions)
    assert weights.shape == (count,)
    for edges in ([0, 1, 2, 3, 500, 501, 777, count], [0, count // 2, count], [0, 64, 128, 999, count]):
        edges = sorted(min(edge, count) for edge in edges)
        parts = list(itertools.pairwise(edges))
        assert np.array_equal(np.concatenate([plan.points(SEED, a, b) for a, b in parts]), whole)
        assert np.array_equal(np.concatenate([plan.weights(SEED, a, b) for a, b in parts]), weights)
    alone = [plan.points(SEED, i, i + 1)[0] for i in range(0, count, 37)]
    assert np.array_equal(alone, whole[::37])


@pytest.mark.parametrize("name", ["independent", "latin", "sobol", "importance", "pick and freeze"])
def test_seeds_matter_and_points_are_inside(name):
    plan = PLANS[name]
    first, second = (plan.points(seed, 0, 500) for seed in (1, 2))
    assert first.min() > 0.0
    assert first.max() < 1.0
    assert not (first == second).any(axis=1).all()
    assert plan.points(2**64 - 1, 0, 3).shape == (3, plan.dimensions)


def test_draws_take_the_noise_generator_with_the_case_in_its_free_word():
    seed, case = 0xFEDCBA9876543210, 0x89ABCDEF
    expected = []
    for block in range(2):
        four = noise.philox((block, case, (int(Purpose.CELLS) << 24) | 7, 0xFFFFFFFF), (0x76543210, 0xFEDCBA98))
        expected += [four[0] << 32 | four[1], four[2] << 32 | four[3]]
    assert words(seed, Purpose.CELLS, np.array([case]), 3, part=7)[0].tolist() == expected[:3]
    found = uniforms(seed, Purpose.CELLS, np.array([case]), 3, part=7)[0]
    assert found.tolist() == [((word >> 12) * 2 + 1) / 2**53 for word in expected[:3]]


def test_independent_points_are_uniform_and_independent():
    """Kolmogorov-Smirnov at one in a million; correlations of n pairs stay below 5 of their deviations."""
    points = Independent(6).points(3, 0, 20_000)
    assert min(stats.kstest(column, "uniform").pvalue for column in points.T) > 1e-6
    across = np.corrcoef(np.hstack([points[:-1], points[1:]]).T) - np.eye(12)
    assert np.abs(across).max() < 5 / math.sqrt(20_000)


@pytest.mark.parametrize("size", [1, 2, 3, 7, 16, 17, 1000, 1024, 12345])
def test_permutations_are_permutations(size):
    for dimension in range(3):
        assert np.array_equal(np.sort(permuted(5, dimension, size, np.arange(size))), np.arange(size))


def test_permutations_are_as_random_as_they_need_be():
    """Pairs of neighbours land on all pairs of places alike: chi-square at one in a million."""
    for size in (4, 7, 12):
        seen = np.zeros((size, size))
        for seed in range(60):
            for dimension in range(10):
                a, b = permuted(seed, dimension, size, np.array([1, 2]))
                seen[a, b] += 1
        pairs = seen[~np.eye(size, dtype=bool)]
        assert np.diag(seen).sum() == 0
        assert stats.chisquare(pairs).pvalue > 1e-6, size


def test_the_largest_permutation_stays_inside():
    size = 2**32
    found = permuted(1, 0, size, np.arange(size - 5, size))
    assert len(set(found.tolist())) == 5
    assert found.max() < size


@pytest.mark.parametrize("cells", [1, 2, 10, 997, 4096])
def test_a_latin_hypercube_has_one_case_in_each_cell(cells):
    points = LatinHypercube(4, cells).points(9, 0, cells)
    for column in points.T:
        edges = np.arange(1, cells) / cells
        assert np.array_equal(np.sort(np.searchsorted(edges, column, side="right")), np.arange(cells))


def test_a_latin_hypercube_keeps_off_the_ends_however_many_cells():
    points = LatinHypercube(2, 2**32).points(1, 0, 5000)
    assert points.min() > 0.0
    assert points.max() < 1.0


def test_latin_dimensions_are_not_matched():
    """Correlation of permutations of n has the deviation 1/sqrt(n - 1); 5 of them. Places in cells are uniform."""
    points = LatinHypercube(8, 2000).points(4, 0, 2000)
    assert np.abs(np.corrcoef(points.T) - np.eye(8)).max() < 5 / math.sqrt(1999)
    assert stats.kstest((points * 2000 % 1.0).ravel(), "uniform").pvalue > 1e-6


def test_latin_means_of_sums_are_far_better():
    """A sum of d effects: of independent cases its mean has deviation sqrt(d/12n); cells leave sqrt(d/12)/n."""
    n, d = 256, 4
    means = [LatinHypercube(d, n).points(seed, 0, n).sum(axis=1).mean() - d / 2 for seed in range(60)]
    assert np.std(means) < 2 * math.sqrt(d / 12) / n


def test_sobol_points_are_balanced_and_beat_chance():
    """Each power of two of a scrambled (t, m, s) net has one point in each equal cell of every dimension."""
    points = Sobol(6).points(11, 0, 1024)
    for column in points.T:
        assert np.array_equal(np.sort((column * 1024).astype(int)), np.arange(1024))
    assert qmc.discrepancy(points) < 0.2 * qmc.discrepancy(Independent(6).points(11, 0, 1024))
    later = Sobol(6).points(11, 3 * 1024, 4 * 1024)
    assert np.array_equal(np.sort((later[:, 3] * 1024).astype(int)), np.arange(1024))


def test_sobol_points_are_scipys():
    engine = qmc.Sobol(3, bits=32, rng=np.random.Generator(np.random.PCG64(7)))
    assert np.array_equal(np.floor(Sobol(3).points(7, 0, 64) * 2.0**32), engine.random(64) * 2.0**32)


def test_corners_are_all_combinations():
    found = Corners(3, (0.0, 1.0)).points(0, 0, 8)
    assert found.tolist() == [list(map(float, each)) for each in itertools.product((0, 1), repeat=3)]
    ends = normal.quantile(Corners(2).points(0, 0, 4))
    assert np.allclose(np.abs(ends), 3.0, atol=1e-12)


def test_a_grid_is_all_combinations():
    found = Grid((2, 3)).points(0, 0, 6)
    assert np.allclose(found, list(itertools.product((0.25, 0.75), (1 / 6, 0.5, 5 / 6))))
    found = Grid((1, 3), ends=(0.0, 1.0)).points(0, 0, 3)
    assert found.tolist() == [[0.5, 0.0], [0.5, 0.5], [0.5, 1.0]]


def test_one_at_a_time_moves_one_at_a_time():
    found = OneAtATime(2, (0.1, 0.9)).points(0, 0, 5)
    assert found.tolist() == [[0.5, 0.5], [0.1, 0.5], [0.9, 0.5], [0.5, 0.1], [0.5, 0.9]]


def test_pick_freeze_blocks_share_what_they_should():
    plan = PickFreeze(Independent(6), (1, 2))
    a, b, first, second = plan.points(1, 40, 44)
    pair = Independent(6).points(1, 10, 11)[0]
    assert a.tolist() == pair[:3].tolist()
    assert b.tolist() == pair[3:].tolist()
    assert first.tolist() == [b[0], a[1], a[2]]
    assert second.tolist() == [a[0], b[1], b[2]]


def test_plans_that_compare_cases_fly_them_in_the_same_noise():
    assert Independent(2).noise_numbers(5, 8).tolist() == [5, 6, 7]
    assert PickFreeze(Independent(4), (1, 1)).noise_numbers(3, 9).tolist() == [0, 1, 1, 1, 1, 2]
    assert Corners(3).noise_numbers(0, 3).tolist() == [0, 0, 0]
    unlike = [name for name, plan in PLANS.items() if not plan.representative]
    assert unlike == ["corners", "grid", "one at a time", "pick and freeze", "pick and freeze of latin"]


def test_importance_weights_undo_the_preference():
    """Share beyond 4 deviations along a direction, 3.17e-5, from 20,000 cases, within 4 of its own deviations."""
    direction = (2.0, -1.0, 2.0)
    plan = Importance(direction, 4.0)
    z = normal.quantile(plan.points(6, 0, 20_000))
    weights = plan.weights(6, 0, 20_000)
    assert weights.min() > 0.0
    assert weights.max() <= 10.0
    beyond = z @ (np.array(direction) / 3) > 4.0
    for sample, truth in [(weights * beyond, stats.norm.sf(4.0)), (weights, 1.0), (weights * z[:, 1], 0.0)]:
        assert abs(sample.mean() - truth) < 4 * sample.std() / math.sqrt(len(sample))
    assert (weights * beyond).std() / math.sqrt(20_000) < 0.03 * stats.norm.sf(4.0)
    across = normal.quantile(plan.points(6, 0, 20_000)) @ np.array([1.0, 2.0, 0.0]) / math.sqrt(5)
    assert stats.kstest(across, "norm").pvalue > 1e-6


WRONG = {
    "no dimension": (lambda: Independent(0), "0 dimensions"),
    "no cell": (lambda: LatinHypercube(2, 0), "0 cases"),
    "too many cells": (lambda: LatinHypercube(2, 2**32 + 1), "4294967297 cases"),
    "too many corners": (lambda: Corners(33), "33 dimensions make more than"),
    "more corners than memory": (lambda: Corners(10**7), "10000000 dimensions make more than"),
    "corners the wrong way": (lambda: Corners(2, (0.9, 0.1)), "0.9 and 0.1"),
    "empty grid": (lambda: Grid((3, 0)), "0 values"),
    "large grid": (lambda: Grid((10**6, 10**6)), "1000000 x 1000000 make"),
    "no probability": (lambda: OneAtATime(2, (1.5,)), "1.5"),
    "no direction": (lambda: Importance((0.0, 0.0), 2.0), "not zero"),
    "far shift": (lambda: Importance((1.0,), 9.0), "9 deviations"),
    "nothing left": (lambda: Importance((1.0,), 2.0, left=0.0), "0 of the cases"),
    "base of another size": (lambda: Importance((1.0,), 2.0, base=Sobol(1)), "expected 2"),
    "many Sobol dimensions": (lambda: Sobol(30_000), "21201"),
    "base of no pairs": (lambda: PickFreeze(Sobol(3), (1, 1)), "expected 4"),
    "no groups": (lambda: PickFreeze(Sobol(3), ()), "one or more"),
    "negative seed": (lambda: Independent(1).points(-1, 0, 1), "seed is -1"),
    "beyond the plan": (lambda: Corners(2).points(0, 3, 5), "cases 3 to 4"),
}


@pytest.mark.parametrize("name", WRONG)
def test_bad_plans_are_told(name):
    make, told = WRONG[name]
    with pytest.raises(CampaignError, match=told):
        make()
