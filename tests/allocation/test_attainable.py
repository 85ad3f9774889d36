"""Truth: shapes with known faces, brute-force vertex enumeration, duality, scaling laws, inclusion.

The linear programs and the lists of faces are also two independent ways to the same numbers.
"""

import json
from itertools import combinations, pairwise, product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog, lsq_linear
from scipy.spatial import ConvexHull

from casadi_gnc.allocation.attainable import attainable
from casadi_gnc.allocation.attainable_plots import outline, plot_slices
from casadi_gnc.allocation.attainable_sets import SetKind, attainable_sets
from casadi_gnc.allocation.problem import AllocationProblem
from casadi_gnc.allocation.zonotope import Zonotope
from casadi_gnc.errors import AllocationError, ProblemError
from casadi_gnc.mechanics.attitude import frame_rotation
from casadi_gnc.mechanics.thrusters import ThrusterGeometry
from casadi_gnc.problem_files.document import read

#: Both ways end at the feasibility tolerance of the linear program, 1e-10 of the full effort.
CLOSE = {"rtol": 1e-8, "atol": 1e-9}


def huang(error: float = 5e-3) -> AllocationProblem:
    data = read("huang2020/detumble").data
    mounted = data["spacecraft"]["thrusters"]
    rotation = frame_rotation(np.pi / 4, np.pi / 7, np.pi / 3)
    geometry = ThrusterGeometry.from_rows(mounted["positions_m"], mounted["directions"]).seen_from(rotation, [0.05] * 3)
    corner = [error] * 3
    return AllocationProblem.of_thrusters(
        geometry, rotation, ([-e for e in corner], corner), lower=0.0, upper=mounted["max_force_N"]
    )


def random_problem(rng, rows, count, lifted=1, vertices=4, lowest=-1.0, size=0.3) -> AllocationProblem:
    """Bounds hold zero for lowest = -1, hold it for some actuators below 0, for none above."""
    lower = lowest + rng.uniform(0, 1, count)
    return AllocationProblem(
        rng.normal(size=(rows, count)),
        lower,
        np.maximum(lower, 0) + rng.uniform(0.1, 1, count),
        coupling=rng.normal(size=(lifted, count)),
        errors=size * rng.normal(size=(vertices, rows, lifted)),
    )


def hexadecachoron() -> AllocationProblem:
    """Four unit forces that must cancel: the cut of the 4-cube by its diagonal plane is an octahedron."""
    effectiveness = np.array([[1, 1, -1, -1], [1, -1, 1, -1], [1, -1, -1, 1]]) / 2
    return AllocationProblem(
        effectiveness,
        -1.0,
        1.0,
        coupling=np.ones((1, 4)),
        errors=[[[0.1], [0.0], [0.0]], [[-0.1], [0], [0]]],
    )


def sliced_vertices(matrix, lower, upper, tie) -> np.ndarray:
    """Every vertex of the forces' polytope, by trying every choice of free forces, through the matrix."""
    count, rank = matrix.shape[1], len(tie)
    found = []
    for free in combinations(range(count), rank):
        fixed = [i for i in range(count) if i not in free]
        for ends in product(*((lower[i], upper[i]) for i in fixed)):
            forces = np.zeros(count)
            forces[fixed] = ends
            forces[list(free)] = np.linalg.solve(tie[:, free], -tie[:, fixed] @ ends) if rank else []
            if np.all(forces >= lower - 1e-9) and np.all(forces <= upper + 1e-9):
                found.append(matrix @ forces)
    return np.array(found)


def faces_of(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    if points.shape[1] == 1:
        return np.array([[1.0], [-1.0]]), np.array([points.max(), -points.min()])
    hull = ConvexHull(points)
    return hull.equations[:, :-1], -hull.equations[:, -1]


def cube_distance(points: np.ndarray) -> float:
    """Half-width at which a cube about the origin touches a convex hull, over the weights of its points."""
    count, rows = points.shape
    below = np.column_stack([np.vstack([points.T, -points.T]), -np.ones(2 * rows)])
    one = np.append(np.ones(count), 0.0)[None]
    found = linprog(np.append(np.zeros(count), 1.0), below, np.zeros(2 * rows), one, [1.0])
    return float(found.fun)


# --- the paper ------------------------------------------------------------------------------------


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


# --- shapes with known faces ----------------------------------------------------------------------


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


# --- brute force ----------------------------------------------------------------------------------


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


# --- laws -----------------------------------------------------------------------------------------


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
        assert np.isclose(a.sphere(), b.sphere(), **CLOSE)


def test_rate_bound_shrinks_to_one_sample():
    problem = AllocationProblem(np.eye(2), -1.0, 1.0, max_step=0.25)
    assert attainable(problem, previous=np.zeros(2)).nominal.box == pytest.approx([0.25, 0.25])
    assert attainable(problem).nominal.box == pytest.approx([1, 1])


def test_seed_decides():
    problem = huang(2e-2)
    a, b = (attainable(problem, samples=5, seed=3) for _ in range(2))
    assert a.summary() == b.summary()


# --- limits and bad input -------------------------------------------------------------------------


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


# --- pictures -------------------------------------------------------------------------------------


def area(polygon: np.ndarray) -> float:
    x, y = polygon.T
    return abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2


def test_outlines():
    """The octahedron's slice is the square |x| + |y| <= 2; the 4-cube's shadow, sliced, lies around it."""
    nominal, _, common = attainable_sets(hexadecachoron())
    square = outline(common, 0, 1)
    assert len(square) == 4
    assert area(square) == pytest.approx(8, rel=1e-9)
    assert area(outline(nominal, 0, 1)) >= 8


def test_outlines_of_thin_sets():
    flat = AllocationProblem(np.array([[1.0, 1], [1, -1], [0, 0]]), -1.0, 1.0)
    one = attainable_sets(flat)[0]
    assert area(outline(one, 0, 1)) == pytest.approx(8)
    assert area(outline(one, 0, 2)) == pytest.approx(0, abs=1e-9)
    assert np.ptp(outline(one, 0, 2)[:, 0]) == pytest.approx(4)
    off = AllocationProblem(np.eye(3), [-1, -1, 0.5], [1, 1, 0.5])
    assert len(outline(attainable_sets(off)[0], 0, 1)) == 0


def test_outline_reaches_as_far_as_the_linear_program(rng):
    for one in attainable_sets(huang()):
        polygon = outline(one, 0, 2)
        for angle in rng.uniform(0, 2 * np.pi, 8):
            d = np.array([np.cos(angle), np.sin(angle)])
            edges = np.roll(polygon, -1, 0) - polygon
            normals = np.column_stack([edges[:, 1], -edges[:, 0]])
            normals *= np.sign(np.einsum("ij,ij->i", normals, polygon))[:, None]  # the origin is inside
            ahead = normals @ d > 1e-12
            reach = (np.einsum("ij,ij->i", normals, polygon)[ahead] / (normals[ahead] @ d)).min()
            assert np.isclose(reach, one.line([d[0], 0, d[1]])[1], rtol=1e-7)


def test_pictures(tmp_path):
    for name, problem, wanted in (
        ("three.png", huang(), 1.5e-3),
        ("two.svg", AllocationProblem(np.eye(2), -1.0, 1.0), [1.0, 2.0]),
    ):
        target = plot_slices(problem, tmp_path / name, wanted=wanted)
        assert target.stat().st_size > 5000
    assert sorted(path.name for path in tmp_path.iterdir()) == ["three.png", "two.svg"]
    with pytest.raises(AllocationError, match="one row"):
        plot_slices(AllocationProblem([[1.0]], 0.0, 1.0), tmp_path / "one.png")
    with pytest.raises(ProblemError, match="a picture ends in .png"):
        plot_slices(huang(), tmp_path / "three.doc")
    with pytest.raises(AllocationError, match="2 names"):
        plot_slices(huang(), tmp_path / "three.png", axes_names=("x", "y"))


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
