"""What can be attained: the paper's numbers, scaling laws, inclusion, units, limits and bad input."""

import json
from itertools import pairwise, product

import numpy as np
import pytest
from attainable_problems import huang, random_problem
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import lsq_linear

from casadi_gnc.allocation.attainable import attainable
from casadi_gnc.allocation.attainable_sets import SetKind, attainable_sets
from casadi_gnc.allocation.problem import AllocationProblem
from casadi_gnc.allocation.zonotope import Zonotope
from casadi_gnc.errors import AllocationError


def test_huang_2020():
    """An independent evaluation of the paper's torque box, to its printed digits."""
    found = attainable(huang(), 1.5e-3, units=("N m",) * 3)
    assert np.allclose(found.nominal.box, 5.16e-4, atol=0.5e-6)
    assert np.allclose(found.each_vertex.box, 4.93e-4, atol=0.5e-6)
    assert np.allclose(found.common_forces.box, 3.55e-4, atol=0.5e-6)
    axes = 1e-3 * np.array([[-1.762, 0.705], [-1.922, 1.144], [-1.157, 1.095]])
    assert np.allclose(found.nominal.lines, axes, atol=0.6e-6)
    assert found.nominal.sphere == pytest.approx(0.69e-3, abs=0.5e-5)
    assert found.shares()[SetKind.NOMINAL] == pytest.approx(0.344, abs=5e-4)
    assert "±0.0015 N m is not attainable" in found.sentences()[0]
    json.dumps(found.summary(), allow_nan=False)


def test_one_set_of_forces_is_zero_net_force():
    """A box of mass-centre errors with volume leaves only forces that cancel, however small the box."""
    problem = huang()
    tied = Zonotope.of_box(problem.effectiveness, problem.lower, problem.upper, np.asarray(problem.coupling))
    expected = tied.halfspaces
    for error in (1e-3, 5e-2):
        common = attainable_sets(huang(error))[2]
        assert np.isclose(common.box(np.ones(3)), expected.box(np.ones(3)), rtol=1e-9)
        assert np.isclose(common.sphere(), expected.sphere(), rtol=1e-9)


def test_corners_really_are_made():
    """At the largest box all corners can be made, one of them with 0.1 % more cannot: least squares says so."""
    problem = huang()
    for one, matrices in zip(
        attainable_sets(problem),
        ([problem.effectiveness], problem.vertices, [np.vstack(problem.vertices)]),
        strict=True,
    ):
        size = one.box(np.ones(3))
        missed = []
        for factor in (1.0, 1.001):
            residuals = []
            for corner in product((-1, 1), repeat=3):
                for matrix in matrices:
                    wanted = np.tile(np.array(corner) * size * factor, len(matrix) // 3)
                    answer = lsq_linear(
                        matrix / size, wanted / size, (problem.lower, problem.upper), method="bvls", tol=1e-14
                    )
                    residuals.append(np.sqrt(2 * answer.cost))
            missed.append(max(residuals))
        assert missed[0] < 1e-7 < 1e-5 < missed[1]


@settings(max_examples=25, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    rows=st.integers(1, 3),
    extra=st.integers(0, 3),
    low=st.sampled_from([-1, -0.7, 0.2]),
)
def test_each_set_holds_the_next(seed, rows, extra, low):
    problem = random_problem(np.random.default_rng(seed), rows, rows + 1 + extra, vertices=3, lowest=low)
    found = attainable(problem, samples=5, seed=seed)
    reaches = found.reaches
    assert [r.kind for r in reaches] == [
        SetKind.NOMINAL, SetKind.EACH_VERTEX, SetKind.SAMPLED, SetKind.COMMON_FORCES,
    ]  # fmt: skip
    for outer, inner in pairwise(reaches):
        assert inner.is_empty >= outer.is_empty
        if inner.is_empty:
            continue
        assert inner.sphere <= outer.sphere + 1e-9
        assert np.all(inner.box <= outer.box + 1e-9)
        for (a, b), (c, d) in zip(outer.lines, inner.lines, strict=True):
            assert np.isnan(c) or a - 1e-9 <= c <= d <= b + 1e-9


@pytest.mark.parametrize("factor", [1e-6, 1e5])
def test_scaling(factor, rng):
    """Forces, or arms, so many times larger reach so many times further, and errors scale with the arms."""
    problem = random_problem(rng, 3, 7)
    plain = attainable(problem, samples=3)
    data = {
        "effectiveness": problem.effectiveness,
        "coupling": problem.coupling,
        "errors": problem.errors,
        "lower": problem.lower,
        "upper": problem.upper,
    }
    for names in (("lower", "upper"), ("effectiveness", "errors")):
        larger = attainable(
            AllocationProblem(**{k: v * (factor if k in names else 1) for k, v in data.items()}), samples=3
        )
        for a, b in zip(plain.reaches, larger.reaches, strict=True):
            assert np.allclose(a.box * factor, b.box, rtol=1e-7, atol=1e-9 * factor)
            assert np.isclose(a.sphere * factor, b.sphere, rtol=1e-7)
            assert np.allclose(a.lines * factor, b.lines, rtol=1e-7, atol=1e-9 * factor, equal_nan=True)


def test_rotation_keeps_the_sphere(rng):
    problem = random_problem(rng, 3, 7)
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    turned = AllocationProblem(
        turn @ problem.effectiveness, problem.lower, problem.upper,
        errors=turn @ problem.errors, coupling=problem.coupling,
            )  # fmt: skip
    for a, b in zip(attainable_sets(problem), attainable_sets(turned), strict=True):
        assert np.isclose(a.sphere(), b.sphere(), rtol=1e-8, atol=1e-9)


def test_rate_bound_shrinks_to_one_sample():
    problem = AllocationProblem(np.eye(2), -1.0, 1.0, max_step=0.25)
    assert attainable(problem, previous=np.zeros(2)).nominal.box == pytest.approx([0.25, 0.25])
    assert attainable(problem).nominal.box == pytest.approx([1, 1])


def test_seed_decides():
    problem = huang(2e-2)
    a, b = (attainable(problem, samples=5, seed=3) for _ in range(2))
    assert a.summary() == b.summary()


def test_too_many_faces_leave_the_linear_programs(rng):
    problem = AllocationProblem(rng.normal(size=(6, 30)), -1.0, 1.0)
    one = attainable_sets(problem)[0]
    with pytest.raises(AllocationError, match="142506 candidate faces"):
        one.sphere()
    found = attainable(AllocationProblem(rng.normal(size=(6, 30)), -1.0, 1.0), directions=np.eye(6)[:1])
    assert found.nominal.box.min() > 0
    assert found.nominal.margins[0] > 0
    assert np.isnan(found.nominal.sphere)
    assert "candidate faces" in found.sentences()[-1]


def test_fewer_samples_are_said(monkeypatch):
    """Twelve thrusters in three dimensions have 66 pairs: work for 660 pairs is ten samples."""
    monkeypatch.setattr("casadi_gnc.allocation.attainable._MOST_WORK", 660)
    found = attainable(huang(), samples=50)
    assert found.samples == 10
    assert "10 samples of the uncertainty were tried instead of 50" in found.sentences()[-1]
    assert attainable(huang(), samples=0).sampled is None


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ({"wanted": [1, 2]}, "half-widths"),
        ({"wanted": -1.0}, "half-widths"),
        ({"wanted": 0.0}, "half-widths"),
        ({"wanted": np.nan}, "half-widths"),
        ({"directions": [[0, 0, 0]]}, "direction"),
        ({"directions": [[1, 0]]}, "direction"),
        ({"directions": [[1, 0, np.inf]]}, "direction"),
        ({"samples": -1}, "samples is -1"),
        ({"previous": [0.0]}, "previous has shape"),
    ],
)
def test_bad_input(arguments, says):
    with pytest.raises(AllocationError, match=says):
        attainable(huang(), **arguments)


def test_forces_and_torques_have_spheres_of_their_own():
    """Forces of at most 2 and 3 N, torques of at most 0.1 and 0.2 N m, by actuators that are shared.

    Each actuator of the first pair pushes along axis 1 and turns about axis 3 by an arm of 0.05 m, one this way and one
    that: alone, axis 1 makes 2 N with both and axis 3 0.05 m x 2 N = 0.1 N m.
    """
    matrix = np.array([[1.0, 1, 0, 0], [0, 0, 3, 0], [0.05, -0.05, 0, 0], [0, 0, 0, 0.2]])
    problem = AllocationProblem(matrix, lower=-1.0, upper=1.0)
    found = attainable(problem, units=("N", "N", "N m", "N m"))
    assert found.nominal.spheres == pytest.approx({"N": 2.0, "N m": 0.1}, rel=1e-12)
    assert np.isnan(found.nominal.sphere)
    told = found.nominal.along(found.directions)
    assert "spheres of 2 N, 0.1 N m; along the axes -2 to 2 N, -3 to 3 N, -0.1 to 0.1 N m, -0.2 to 0.2 N m" in told
    (alone,) = attainable(problem).nominal.spheres.values()  # nobody says that they differ
    # Both at once share the first pair: |f1| / 2 + |t3| / 0.1 <= 1, a plane at 1 / |(1/2, 10)| from zero.
    assert alone == pytest.approx(1 / np.hypot(0.5, 10.0), rel=1e-12)
    with pytest.raises(AllocationError, match="units has 1 entries, expected 4"):
        attainable(problem, units=("N",))


def test_the_largest_box_is_a_cube_of_each_kind():
    """Rows that do not touch each other: per kind the weakest axis, by hand, in whatever unit the torques are."""
    for torque_unit in (1.0, 1e3):
        problem = AllocationProblem(np.diag([1.0, 2.0, 10.0 * torque_unit, 30.0 * torque_unit]), -1.0, 1.0)
        found = attainable(problem, units=("N", "N", "N m", "N m"))
        assert found.nominal.box.tolist() == pytest.approx([1.0, 1.0, 10.0 * torque_unit, 10.0 * torque_unit])
    # Where one pair of actuators makes both, half of each is left of a corner.
    both = AllocationProblem([[1.0, 1.0], [5.0, -5.0]], -1.0, 1.0)
    assert attainable(both, units=("N", "N m")).nominal.box.tolist() == pytest.approx([1.0, 5.0])
    # A force that cannot be made at all leaves a box of torques.
    flat = AllocationProblem([[0.0, 0.0], [3.0, 0.0]], -1.0, 1.0)
    assert attainable(flat, units=("N", "N m")).nominal.box.tolist() == pytest.approx([0.0, 3.0])
