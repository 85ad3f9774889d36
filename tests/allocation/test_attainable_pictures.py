"""Outlines of attainable sets by their area and reach, and the pictures of them."""

import numpy as np
import pytest
from attainable_problems import hexadecachoron, huang

from casadi_gnc.allocation.attainable_plots import outline, plot_slices
from casadi_gnc.allocation.attainable_sets import attainable_sets
from casadi_gnc.allocation.problem import AllocationProblem
from casadi_gnc.errors import AllocationError, ProblemError


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
