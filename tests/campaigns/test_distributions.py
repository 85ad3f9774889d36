"""Truth: SciPy's distribution functions, moments known in closed form, the house's own attitude algebra."""

import itertools
import math

import casadi as ca
import numpy as np
import pytest
from scipy import stats
from scipy.spatial import transform

from casadi_gnc.campaigns.correlated import Correlated, factor
from casadi_gnc.campaigns.distributions import Choice, LogUniform, Normal, Uniform
from casadi_gnc.campaigns.orientations import Direction, Rotation
from casadi_gnc.campaigns.plans import Independent, LatinHypercube, Sobol
from casadi_gnc.errors import CampaignError
from casadi_gnc.mechanics import attitude

COVARIANCE = ((4.0, 1.2, -0.6), (1.2, 1.0, 0.3), (-0.6, 0.3, 0.5))
ALL = {
    "normal": Normal(1.0, 0.03, size=2),
    "truncated": Normal(1.0, 0.03, truncate=2.0, size=2),
    "uniform": Uniform(-0.05, 0.2),
    "log-uniform": LogUniform(1e-6, 1e3, size=3),
    "choice": Choice(((1.0,), (2.0,), (5.0,)), (1.0, 0.0, 3.0), size=2),
    "rows": Choice(((1.0, 2.0), (3.0, 4.0))),
    "correlated": Correlated((1.0, 2.0, 3.0), COVARIANCE),
    "sphere": Direction(2.0),
    "cone": Direction(0.1, 0.3, (1.0, -2.0, 0.5), 0.4),
    "any attitude": Rotation(),
    "turned": Rotation("quaternion_scalar_first", 0.1, 3.0, (0.5, 0.5, -0.5, 0.5)),
}


def sample(distribution, count: int = 20_000, seed: int = 8) -> np.ndarray:
    return distribution.at(Independent(distribution.dimensions).points(seed, 0, count))


@pytest.mark.parametrize("name", ALL)
def test_values_depend_on_their_own_point_alone(name):
    distribution = ALL[name]
    points = Sobol(distribution.dimensions).points(1, 0, 999)
    whole = distribution.at(points)
    assert whole.shape == (999, distribution.values)
    assert np.array_equal(np.concatenate([distribution.at(points[:7]), distribution.at(points[7:])]), whole)
    assert np.array_equal([distribution.at(point[None])[0] for point in points[::50]], whole[::50])
    assert np.array_equal(distribution.at(np.asfortranarray(points)), whole)


LAWS = {
    "normal": stats.norm(1.0, 0.03),
    "truncated": stats.truncnorm(-2, 2, 1.0, 0.03),
    "uniform": stats.uniform(-0.05, 0.25),
    "log-uniform": stats.loguniform(1e-6, 1e3),
}


@pytest.mark.parametrize("name", LAWS)
def test_values_are_quantiles(name):
    """Against SciPy's to 1e-12 of the spread; the tails to the last part in 1e10."""
    distribution = ALL[name]
    probabilities = np.concatenate([np.linspace(0, 1, 1001)[1:-1], [1e-12, 1 - 2.0**-40]])
    found = distribution.at(np.tile(probabilities[:, None], distribution.dimensions))[:, -1]
    assert np.allclose(found, LAWS[name].ppf(probabilities), rtol=1e-11, atol=1e-12)
    assert np.all(np.diff(found[:999]) > 0)


def test_ends_are_exact():
    ends = np.array([[0.0], [1.0]])
    assert Uniform(-0.1, 0.3).at(ends).ravel().tolist() == [-0.1, 0.3]
    assert LogUniform(0.1, 3e5).at(ends).ravel().tolist() == [0.1, 3e5]
    assert Normal(0.0, 1.0, truncate=2.5).at(ends).ravel().tolist() == [-2.5, 2.5]
    assert Choice(((1.0,), (2.0,), (3.0,)), (1.0, 1.0, 0.0)).at(ends).ravel().tolist() == [1.0, 2.0]
    with pytest.raises(CampaignError, match="no ends"):
        Normal(0.0, 1.0).at(ends)


def test_narrow_truncation_is_nearly_uniform():
    found = Normal(5.0, 2.0, truncate=1e-3).at(np.array([[0.25], [0.5], [0.75]])).ravel()
    assert np.allclose(found, [5 - 1e-3, 5, 5 + 1e-3], rtol=0, atol=1e-9)


def test_choices_come_as_often_as_weighed():
    distribution = Choice(((1.0,), (2.0,), (5.0,), (7.0,)), (1.0, 0.0, 3.0, 0.0))
    values, counts = np.unique(sample(distribution), return_counts=True)
    assert values.tolist() == [1.0, 5.0]
    assert stats.binomtest(int(counts[0]), 20_000, 0.25).pvalue > 1e-6
    edge = Choice(((1.0,), (2.0,)), (1.0, 3.0)).at(np.array([[0.25 - 2**-54], [0.25]]))
    assert edge.ravel().tolist() == [1.0, 2.0]


def test_a_latin_hypercube_takes_each_row_once():
    rows = tuple((float(i), -float(i)) for i in range(57))
    found = Choice(rows).at(LatinHypercube(1, 57).points(3, 0, 57))
    assert np.array_equal(np.sort(found[:, 0]), np.arange(57.0))
    assert np.array_equal(found[:, 1], -found[:, 0])


def test_correlated_numbers_have_their_covariance():
    """Each entry within 5 deviations of a sample covariance of 20,000, sqrt((c_ii c_jj + c_ij^2)/n)."""
    found = sample(ALL["correlated"])
    wanted, spread = np.array(COVARIANCE), np.diag(COVARIANCE)
    allowed = 5 * np.sqrt((np.outer(spread, spread) + wanted**2) / len(found))
    assert np.all(np.abs(np.cov(found.T) - wanted) < allowed)
    assert np.all(np.abs(found.mean(axis=0) - [1, 2, 3]) < 5 * np.sqrt(spread / len(found)))


@pytest.mark.parametrize("rank", [0, 1, 2, 4, 6])
def test_factors_of_singular_matrices(rng, rank):
    half = rng.normal(size=(6, rank)) * 10.0 ** rng.uniform(-3, 3, (6, 1))
    matrix = half @ half.T
    matrix = (matrix + matrix.T) / 2
    lower = np.array(factor(tuple(map(tuple, matrix))))
    assert np.abs(lower @ lower.T - matrix).max() <= 1e-13 * max(np.abs(matrix).max(), 1e-300)
    assert np.count_nonzero(np.abs(lower).max(axis=0)) <= max(rank, 0)


def test_numbers_that_are_copies_of_each_other_stay_so():
    found = sample(Correlated((0.0, 5.0), ((4.0, 4.0), (4.0, 4.0))), 100)
    assert np.array_equal(found[:, 0] + 5.0, found[:, 1])


def test_directions_are_uniform_on_the_sphere_and_in_the_cone():
    """The height over any axis is uniform, the angle around it too (Kolmogorov-Smirnov at one in a million)."""
    vectors = sample(Direction(2.0)) / 2.0
    assert np.allclose(np.linalg.norm(vectors, axis=1), 1.0, rtol=0, atol=1e-14)
    for axis in [(1, 0, 0), (0, 1, 0), (0, 0, 1), (0.6, 0.0, -0.8)]:
        assert stats.kstest(vectors @ np.array(axis), stats.uniform(-1, 2).cdf).pvalue > 1e-6
    cone = sample(ALL["cone"])
    lengths = np.linalg.norm(cone, axis=1)
    axis = np.array([1.0, -2.0, 0.5]) / math.hypot(1.0, -2.0, 0.5)
    cosine = cone @ axis / lengths
    assert stats.kstest(cosine, stats.uniform(math.cos(0.4), 1 - math.cos(0.4)).cdf).pvalue > 1e-6
    assert stats.kstest(lengths, stats.uniform(0.1, 0.2).cdf).pvalue > 1e-6
    first = np.cross(axis, [0, 0, 1])
    first /= np.linalg.norm(first)
    around = np.arctan2(cone @ np.cross(axis, first), cone @ first)
    assert stats.kstest(around, stats.uniform(-math.pi, 2 * math.pi).cdf).pvalue > 1e-6


def test_a_narrow_cone_keeps_its_digits():
    vectors = sample(Direction(about=(0.0, 0.0, 5.0), within_rad=1e-9), 1000)
    angles = np.hypot(vectors[:, 0], vectors[:, 1])
    assert 0.9e-9 < angles.max() <= 1e-9 * (1 + 1e-12)
    assert stats.kstest((angles / 1e-9) ** 2, "uniform").pvalue > 1e-6


def test_axes_that_are_parallel_to_the_frames():
    for axis in itertools.product((-1.0, 0.0, 3.0), repeat=3):
        if any(axis):
            found = Direction(about=axis, within_rad=1e-6).at(np.array([[0.3, 0.7]]))[0]
            assert np.allclose(found, np.array(axis) / np.linalg.norm(axis), atol=1e-6)


def test_attitudes_are_all_alike():
    """The angle of a uniform rotation has the density (1 - cos a)/pi, and its axis is uniform."""
    mrps = sample(Rotation())
    size = np.linalg.norm(mrps, axis=1)
    assert size.max() <= 1.0
    angle = 4 * np.arctan(size)
    assert stats.kstest(angle, lambda a: (a - np.sin(a)) / math.pi).pvalue > 1e-6
    for axis in np.eye(3):
        assert stats.kstest(mrps @ axis / size, stats.uniform(-1, 2).cdf).pvalue > 1e-6


def test_forms_tell_the_same_attitude():
    points = Independent(3).points(2, 0, 200)
    for deviation, nominal in [(None, None), (0.3, (0.1, -0.2, 0.3))]:
        mrps = Rotation("mrp", deviation, None, nominal).at(points)
        for form in ("quaternion_scalar_first", "quaternion_scalar_last"):
            given = None
            if nominal:
                vector = 2 * np.array(nominal) / (1 + np.dot(nominal, nominal))
                scalar = (1 - np.dot(nominal, nominal)) / (1 + np.dot(nominal, nominal))
                given = (scalar, *vector) if form.endswith("first") else (*vector, scalar)
            found = Rotation(form, deviation, None, given).at(points)
            found = found if form.endswith("last") else np.roll(found, -1, axis=1)
            assert np.allclose(np.linalg.norm(found, axis=1), 1.0, rtol=0, atol=1e-14)
            assert np.allclose(transform.Rotation.from_quat(found).as_mrp(), mrps, atol=1e-13)


def test_turned_attitudes_start_at_the_nominal_one():
    """C of the sample is C(turn) C(nominal), by the house's own dcm; the turn's angle is a folded normal number."""
    nominal = (0.3, -0.5, 0.6)
    points = Independent(3).points(4, 0, 3000)
    turned = Rotation("mrp", 0.2, 2.5, nominal).at(points)
    alone = Rotation("mrp", 0.2, 2.5).at(points)
    for whole, part in zip(turned[:50], alone[:50], strict=True):
        expected = ca.mtimes(attitude.dcm(ca.DM(part)), attitude.dcm(ca.DM(nominal)))
        assert np.allclose(np.array(attitude.dcm(ca.DM(whole))), np.array(expected), rtol=0, atol=1e-13)
    angle = 4 * np.arctan(np.linalg.norm(alone, axis=1)) / 0.2
    law = stats.truncnorm(-2.5, 2.5)
    assert stats.kstest(angle, lambda a: law.cdf(a) - law.cdf(-a)).pvalue > 1e-6
    assert np.linalg.norm(turned, axis=1).max() <= 1.0


WRONG = {
    "ragged rows": (lambda: Choice(((1.0,), (1.0, 2.0))), "alternatives of"),
    "no rows": (lambda: Choice(()), "alternatives of"),
    "few weights": (lambda: Choice(((1.0,), (2.0,)), (1.0,)), "1 weights for 2"),
    "no weight": (lambda: Choice(((1.0,), (2.0,)), (0.0, 0.0)), "2 weights"),
    "many rows at once": (lambda: Choice(((1.0, 2.0),), size=2), "one at a time"),
    "shapes": (lambda: Correlated((1.0,), ((1.0, 0.0), (0.0, 1.0))), "expected 1 of 1"),
    "ragged": (lambda: Correlated((1.0, 1.0), ((1.0,), (0.0, 1.0))), "expected 2 of 2"),
    "not symmetric": (lambda: Correlated((0.0, 0.0), ((1.0, 0.5), (0.4, 1.0))), "not symmetric.*0.1"),
    "indefinite": (lambda: Correlated((0.0, 0.0), ((1.0, 2.0), (2.0, 1.0))), "smallest eigenvalue is -1"),
    "no axis": (lambda: Direction(about=(0.0, 0.0, 0.0)), "axis"),
    "short attitude": (lambda: Rotation("mrp", 0.1, None, (1.0, 0.0)), "2 numbers; expected 3"),
    "long quaternion": (lambda: Rotation("quaternion_scalar_last", 0.1, None, (1.0, 0.0, 0.0, 1.0)), "length 1.414"),
}


@pytest.mark.parametrize("name", WRONG)
def test_bad_distributions_are_told(name):
    make, told = WRONG[name]
    with pytest.raises(CampaignError, match=told):
        make()
