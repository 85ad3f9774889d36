"""Published robust least squares: answers by hand, the two forms against each other, certificates from both sides."""

import math

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from casadi_gnc.allocation import AllocationProblem, solve
from casadi_gnc.allocation.backends.robust_least_squares_ import ellipsoid_of, radius


def uncertain(matrix, errors, lower=-2.0, upper=2.0, coupling=None):
    """Return a problem whose errors act on the forces themselves, unless a coupling is given."""
    matrix = np.array(matrix, dtype=float)
    coupling = np.eye(matrix.shape[1]) if coupling is None else coupling
    return AllocationProblem(matrix, lower, upper, coupling=coupling, errors=np.array(errors, dtype=float))


def some_problem(rng, axes=2):
    errors = rng.normal(size=(axes, 3, 2)) * 0.1
    corners = np.array(np.meshgrid(*[[-1, 1]] * axes)).reshape(axes, -1).T
    errors = np.einsum("ka,arp->krp", corners, errors)
    return uncertain(rng.normal(size=(3, 5)), errors, 0.0, 1.0, coupling=rng.normal(size=(2, 5)))


def worst_of_ellipsoid(problem, forces, command):
    """Return max |r + M d| over |d| <= 1, and the d: least over s > |M|^2 of s + r'(I - M M'/s)^-1 r."""
    middle, parts = ellipsoid_of(problem)
    r, M = middle @ forces - command, np.einsum("arn,n->ra", parts, forces)
    left, sizes, _ = np.linalg.svd(M)
    along = left.T @ r
    squares = np.zeros(len(r))
    squares[: len(sizes)] = sizes**2
    top = sizes[0] ** 2

    def bound(logarithm):
        s = top * (1 + math.exp(logarithm))
        return s + float(np.sum(along**2 / (1 - squares / s)))

    s = top * (1 + math.exp(minimize_scalar(bound, bounds=(-40, 40), method="bounded", options={"xatol": 1e-12}).x))
    d = np.linalg.lstsq(s * np.eye(M.shape[1]) - M.T @ M, M.T @ r, 1e-12)[0]
    return math.sqrt(s + float(np.sum(along**2 / (1 - squares / s)))), d / max(np.linalg.norm(d), 1e-300)


def test_one_actuator_by_hand():
    """|(F - 1, F)| + rho |F| is least where (2 F - 1) 2^1/2 = -rho ((2 F - 1)^2 + 1)^1/2."""
    problem = uncertain([[1], [1]], [[[0.3], [0.4]], [[-0.3], [-0.4]]])
    assert radius(problem) == pytest.approx(0.5)
    assert solve(problem, [1, 0], backend="rls").forces == pytest.approx(
        [(1 - 0.5 / math.sqrt(2 - 0.25)) / 2], abs=1e-6
    )
    # Errors of a segment: |(0.7 F - 1, 0.6 F)| and |(1.3 F - 1, 1.4 F)| meet where 2.8 F = 1.2.
    assert solve(problem, [1, 0], backend="ellipsoid").forces == pytest.approx([1.2 / 2.8], abs=1e-6)


def test_large_errors_stop_the_actuators_and_small_ones_do_not():
    """|F - u| + rho |F| of one row: all is done where rho < 1, nothing where rho > 1."""
    for rho, made in ((0.9, 1.0), (1.1, 0.0)):
        problem = uncertain([[1]], [[[rho]], [[-rho]]])
        for name in ("rls", "ellipsoid"):
            assert solve(problem, [1.0], backend=name).forces == pytest.approx([made], abs=1e-6)


def test_least_ellipsoids_by_hand():
    """A box's half-axes times 2^1/2; about a triangle Steiner's, through the corners, its centre the centroid."""
    box = uncertain(np.eye(2), [np.diag([0.1 * a, 0.3 * b]) for a in (-1, 1) for b in (-1, 1)])
    middle, parts = ellipsoid_of(box)
    assert middle == pytest.approx(np.eye(2), abs=1e-12)
    assert np.sort(np.abs(parts).sum(axis=(1, 2))) == pytest.approx([0.1 * math.sqrt(2), 0.3 * math.sqrt(2)])
    triangle = uncertain(np.zeros((2, 1)), [[[0], [0]], [[1], [0]], [[0], [1]]])
    middle, parts = ellipsoid_of(triangle)
    assert middle[:, 0] == pytest.approx([1 / 3, 1 / 3], abs=1e-6)
    assert abs(np.linalg.det(parts[:, :, 0])) == pytest.approx(4 / (3 * math.sqrt(3)) / 2, rel=1e-6)


def test_an_ellipsoid_holds_its_vertices(rng):
    problem = uncertain(rng.normal(size=(3, 4)), rng.normal(size=(9, 3, 2)), coupling=rng.normal(size=(2, 4)))
    middle, parts = ellipsoid_of(problem)
    basis = parts.reshape(len(parts), -1).T
    for vertex in problem.vertices:
        d = np.linalg.lstsq(basis, (vertex - middle).ravel(), 1e-12)[0]
        assert np.allclose(basis @ d, (vertex - middle).ravel(), atol=1e-9)
        assert np.linalg.norm(d) <= 1 + 1e-9


def test_a_ball_of_all_entries_is_robust_least_squares(rng):
    """Errors of every entry alone, as large as rho: the ellipsoid is the Frobenius ball, where both ask the same."""
    errors = 0.3 * np.concatenate([np.eye(6), -np.eye(6)]).reshape(12, 2, 3)
    for _ in range(5):
        problem = uncertain(rng.normal(size=(2, 3)), errors, -0.4, 0.6)
        command = problem.effectiveness @ rng.uniform(-0.4, 0.6, 3)
        ball, ellipsoid = (solve(problem, command, backend=name).forces for name in ("rls", "ellipsoid"))
        assert ball == pytest.approx(ellipsoid, abs=1e-5)


def polished(problem, command, forces, rho):
    """Return better forces: |r| + rho |F| is least where |r|^2/a + rho |F|^2/b is, a and b being those norms."""
    for _ in range(40):
        a, b = np.linalg.norm(problem.effectiveness @ forces - command), np.linalg.norm(forces)
        weighted = AllocationProblem(
            problem.effectiveness,
            problem.lower,
            problem.upper,
            effort_weight=rho * a / b,
            change_weight=0.0,
            accuracy_weight=1.0,
        )
        forces = solve(weighted, command, backend="wls").forces
    return forces


def test_robust_least_squares_are_certified(rng):
    """|r| + rho |F| >= (A'z + w)'F - z'u for |z| <= 1, |w| <= rho: the right side is least at a corner of the box."""
    checked = 0
    for _ in range(10):
        problem = some_problem(rng)
        command, rho = problem.effectiveness @ rng.uniform(-0.5, 1.5, 5), radius(problem)
        forces = solve(problem, command, backend="rls").forces
        if np.linalg.norm(problem.effectiveness @ forces - command) < 1e-2:
            continue  # an error of zero has no direction
        near = polished(problem, command, forces, rho)
        r = problem.effectiveness @ near - command
        price = problem.effectiveness.T @ r / np.linalg.norm(r) + rho * near / np.linalg.norm(near)
        bound = np.minimum(price * problem.lower, price * problem.upper).sum() - r @ command / np.linalg.norm(r)
        value = np.linalg.norm(problem.effectiveness @ forces - command) + rho * np.linalg.norm(forces)
        assert bound <= value <= bound * (1 + 1e-7)
        checked += 1
    assert checked >= 5


def test_ellipsoids_are_certified(rng):
    """Some errors of the ellipsoid, as vertices of our problem, prove from below what its worst error is from above."""
    for axes in (1, 2, 3):
        problem = some_problem(rng, axes)
        command = problem.effectiveness @ rng.uniform(-0.2, 1.2, 5)
        forces = solve(problem, command, backend="ellipsoid").forces
        worst, d = worst_of_ellipsoid(problem, forces, command)
        middle, parts = ellipsoid_of(problem)
        directions = [d, -d, *np.eye(axes), *-np.eye(axes)]
        for _ in range(8):
            vertices = np.array([np.einsum("a,arn->rn", one, parts) for one in directions])
            cut = AllocationProblem(
                middle,
                problem.lower,
                problem.upper,
                coupling=np.eye(5),
                errors=vertices,
                effort_weight=1e-9,
                change_weight=0.0,
                accuracy_weight=1.0,
            )
            found = solve(cut, command)
            below = math.sqrt(max(found.objective - found.duality_gap - 1e-9 * 5, 0.0))
            if below >= worst * (1 - 1e-5):
                break
            _, d = worst_of_ellipsoid(problem, found.forces, command)
            directions += [d, -d]
        assert worst * (1 - 1e-5) <= below <= worst * (1 + 1e-8)
