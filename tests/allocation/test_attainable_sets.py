"""Truth: shapes with known faces, brute-force vertex enumeration, duality.

The linear programs and the lists of faces are also two independent ways to the same numbers.
"""

import json

import numpy as np
import pytest
from attainable_problems import cube_distance, faces_of, hexadecachoron, random_problem, sliced_vertices

from casadi_gnc.allocation.attainable import attainable
from casadi_gnc.allocation.attainable_sets import attainable_sets
from casadi_gnc.allocation.problem import AllocationProblem

#: Both ways end at the feasibility tolerance of the linear program, 1e-10 of the full effort.
CLOSE = {"rtol": 1e-8, "atol": 1e-9}


@pytest.mark.parametrize("rows", [1, 2, 3, 4, 5, 6])
def test_orthogonal_generators_make_a_box(rows, rng):
    half = rng.uniform(1, 3, rows)
    found = attainable(AllocationProblem(np.diag(half), -1.0, 1.0), half)
    assert np.allclose(found.nominal.box, half, **CLOSE)
    assert np.isclose(found.nominal.sphere, half.min(), **CLOSE)
    assert np.allclose(found.nominal.lines, np.column_stack([-half, half]), **CLOSE)
    assert found.sampled is None
    for reach in (found.each_vertex, found.common_forces):
        assert np.allclose(reach.box, half, **CLOSE)


def test_octahedron():
    """|x| + |y| + |z| <= 2: cube 2/3, sphere 2/sqrt(3), axes 2."""
    found = attainable(hexadecachoron(), directions=np.vstack([np.eye(3), [1, 1, 0]])).common_forces
    assert np.allclose(found.box, 2 / 3, **CLOSE)
    assert np.isclose(found.sphere, 2 / np.sqrt(3), **CLOSE)
    assert np.allclose(found.margins, [2, 2, 2, 1], **CLOSE)


def test_parallel_and_zero_generators():
    """Thrusters in pairs along three axes, one without effect: a box of the sums of their lengths."""
    effectiveness = np.array([[1, -2, 0, 0, 0, 0], [0, 0, 3, 0, 0, 0], [0, 0, 0, 1, 1 + 1e-13, 0.0]])
    found = attainable(AllocationProblem(effectiveness, -1.0, 1.0), directions=np.eye(3)).nominal
    assert np.allclose(found.margins, [3, 3, 2], **CLOSE)
    assert np.isclose(found.sphere, 2, **CLOSE)


def test_rank_deficient():
    """Two actuators in three dimensions: a flat set holds no box and no sphere, but has margins in its plane."""
    problem = AllocationProblem(np.array([[1.0, 1], [1, -1], [0, 0]]), -1.0, 1.0)
    found = attainable(problem, directions=[[1, 0, 0], [0, 0, 1]]).nominal
    assert np.array_equal(found.box, np.zeros(3))
    assert found.sphere == 0
    assert np.allclose(found.lines, [[-2, 2], [0, 0]], **CLOSE)
    assert "boundary" in found.sentence()


def test_off_its_own_plane():
    """A stuck actuator lifts a flat set off the origin; the axis along the push meets it in one point."""
    problem = AllocationProblem(np.eye(3), [-1, -1, 0.5], [1, 1, 0.5])
    found = attainable(problem, directions=np.eye(3)).nominal
    assert np.allclose(found.box, -0.5, **CLOSE)
    assert np.isclose(found.sphere, -0.5, **CLOSE)
    assert np.isnan(found.lines[:2]).all()
    assert np.allclose(found.lines[2], 0.5, **CLOSE)


def test_actuators_that_cannot_be_shut():
    found = attainable(AllocationProblem(np.array([[1.0]]), 1.0, 2.0), 1.0, directions=[[1.0], [-1.0]], units=["N m"])
    assert found.nominal.box == pytest.approx([-1.0])
    assert found.nominal.sphere == pytest.approx(-1.0)
    assert np.allclose(found.nominal.lines, [[1, 2], [-2, -1]], **CLOSE)
    assert not found.nominal.holds_origin
    assert not found.nominal.is_empty
    assert "not even zero effort" in found.sentences()[0]
    assert "±1 N m" in found.sentences()[1]


def test_empty_intersections():
    """Vertices that push to opposite sides have nothing in common; nor have forces that cannot cancel."""
    problem = AllocationProblem(np.array([[1.0]]), 1.0, 2.0, coupling=[[1.0]], errors=[[[10.0]], [[-10.0]]])
    found = attainable(problem, 1.0)
    assert not found.nominal.is_empty
    for reach in (found.each_vertex, found.common_forces, found.sampled):
        assert reach is not None
        assert reach.is_empty
        assert np.isnan([*reach.box, reach.sphere, *reach.lines.ravel()]).all()
        assert "no effort at all" in reach.sentence()
        assert reach.summary()["box"] == [None]
    json.dumps(found.summary(), allow_nan=False)


def test_only_shut_thrusters_cancel():
    """Thrusters that all push the same way have net force zero only when shut: {0}, not empty."""
    problem = AllocationProblem(
        np.array([[1.0, -1, 0, 0], [0, 0, 1, -1]]), 0.0, 1.0, coupling=np.ones((1, 4)), errors=[[[0.1], [0]]]
    )  # fmt: skip
    found = attainable(problem).common_forces
    assert not found.is_empty
    assert np.array_equal(found.box, np.zeros(2))
    assert found.sphere == pytest.approx(0, abs=1e-12)
    assert np.allclose(found.lines, 0, atol=1e-9)


def test_the_middle_of_the_uncertainty_may_be_worse_than_its_vertices():
    """B runs from -1 to 1 through a nominal 0.5: at B = 0 nothing can be made, at the vertices 1 can."""
    problem = AllocationProblem([[0.5]], -1.0, 1.0, coupling=[[1.0]], errors=[[[-1.5]], [[0.5]]])
    found = attainable(problem)
    assert found.sampled is not None
    assert found.each_vertex.box == pytest.approx([0.5])
    assert 0 <= found.sampled.box[0] < 0.05
    assert found.sampled.sphere == pytest.approx(found.sampled.box[0])
    assert found.common_forces.box == pytest.approx([0.0])


@pytest.mark.parametrize("case", range(24))
def test_vertex_enumeration(case):
    """All three sets against the convex hull of every vertex; bounds shift the origin out in some cases."""
    rng = np.random.default_rng(case)
    rows, lifted = 1 + case % 4, 1 + case % 2
    problem = random_problem(
        rng, rows, rows + lifted + 2, lifted, vertices=3, lowest=(-1.0, -0.7, -0.3, -1.0, 0.2)[case % 5]
    )
    lower, upper, none = problem.lower, problem.upper, np.zeros((0, problem.count))
    clouds = [
        [sliced_vertices(problem.effectiveness, lower, upper, none)],
        [sliced_vertices(m, lower, upper, none) for m in (problem.effectiveness, *problem.vertices)],
        [sliced_vertices(problem.effectiveness, lower, upper, np.asarray(problem.coupling))],
    ]
    p, along = rng.uniform(0.5, 2, rows), rng.normal(size=rows)
    for one, points in zip(attainable_sets(problem), clouds, strict=True):
        if any(not len(cloud) for cloud in points):
            assert one.is_empty
            continue
        normals, offsets = (np.concatenate(part) for part in zip(*map(faces_of, points), strict=True))
        if one.is_empty:  # an intersection; any two of its parts may miss each other
            assert offsets.min() < 0
            continue
        if offsets.min() >= 0:
            assert np.isclose(one.sphere(), offsets.min(), **CLOSE)
        else:
            assert -one.sphere() >= max(map(cube_distance, points)) - 1e-9
            assert len(points) > 1 or np.isclose(-one.sphere(), cube_distance(points[0]), **CLOSE)
        size = (offsets / (np.abs(normals) @ p)).min()
        assert np.isclose(one.box(p), size, **CLOSE) if size >= 0 else one.box(p) <= size + 1e-9
        ahead = normals @ along
        least, largest = (offsets / ahead)[ahead < 0].max(), (offsets / ahead)[ahead > 0].min()
        expected = (least, largest) if least <= largest else (np.nan, np.nan)
        assert np.allclose(one.line(along), expected, **CLOSE, equal_nan=True)


@pytest.mark.parametrize("rows", [1, 2, 3, 4, 5, 6])
def test_linear_programs_agree_with_faces(rows, rng):
    problem = random_problem(rng, rows, rows + 4, lifted=2)
    for one in attainable_sets(problem):
        for part in one.parts:
            for along in rng.normal(size=(5, rows)):
                assert np.allclose(part.line(along), part.halfspaces.line(along), **CLOSE, equal_nan=True)


def test_no_normal_beats_the_faces(rng):
    """h(n)/(n.d) bounds the margin along d for every n, and the sphere; random normals never undercut the faces."""
    problem = random_problem(rng, 3, 8, size=0.0)
    (part,) = attainable_sets(problem)[0].parts
    normals = rng.normal(size=(20000, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    support = np.maximum(
        normals @ problem.effectiveness * problem.lower, normals @ problem.effectiveness * problem.upper
    )
    support = support.sum(axis=1)
    assert support.min() >= part.halfspaces.sphere() - 1e-12
    assert support.min() <= part.halfspaces.sphere() + 0.1  # dense enough to come near
    along = rng.normal(size=3)
    ahead = normals @ along > 1e-3
    assert (support[ahead] / (normals[ahead] @ along)).min() >= part.line(along)[1] - 1e-9


def test_distance_where_the_origin_is_outside():
    """A square about (3, 2): the cube about the origin meets its near corner (2, 1) at 2."""
    problem = AllocationProblem(np.eye(2), [2, 1], [4, 3])
    assert attainable_sets(problem)[0].box(np.ones(2)) == pytest.approx(-2)
    assert attainable_sets(problem)[0].sphere() == pytest.approx(-2)  # a lower bound of the distance, sqrt(5)
