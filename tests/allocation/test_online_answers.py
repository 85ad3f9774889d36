"""Answers of the online allocator in C: truth comes from duality, closed forms and other solvers."""

import numpy as np
import online_allocator as oa
import pytest
from online_allocator import COLD, INTERIOR_POINT, SHAPES, WARM, Allocator
from online_answers import PLAIN, check


@pytest.mark.parametrize("family", oa.FAMILIES)
def test_every_answer_is_certified(family):
    """16 families x 7 shapes x 2 starts x (48 or 144) instances > 17000, from cold and after jumps."""
    rng, count = np.random.default_rng(sum(map(ord, family))), 0
    for N, R in SHAPES:
        allocator = Allocator(N, R, 3, 8)
        for _ in range(24 if N == 12 else 8):
            problem, *commands, step = oa.instance(rng, family, N, R)
            assert allocator.setup(*problem) == oa.OPTIMAL
            for mode in (COLD, WARM):
                _, results = allocator.sequence(*commands, step, mode=mode)
                check(problem, *commands, step, results)
                count += len(results)
    assert count == 864


@pytest.mark.parametrize("family", [f for f in oa.FAMILIES if f not in ("zero", "all_zero", "mixed_zero")])
def test_the_interior_point_alone_is_certified(family):
    """Without the active set, but for problems at rest or without weights, where it may end above the tolerance."""
    rng = np.random.default_rng(1 + sum(map(ord, family)))
    for N, R in SHAPES:
        allocator = Allocator(N, R, 3, 8)
        for _ in range(12):
            problem, *commands, step = oa.instance(rng, family, N, R)
            allocator.setup(*problem)
            _, results = allocator.sequence(*commands, step, mode=INTERIOR_POINT)
            check(problem, *commands, step, results)


@pytest.mark.parametrize(("P", "V"), [(3, 8), (1, 8), (1, 2)])
@pytest.mark.parametrize("as_printed", [False, True])
def test_wheels(P, V, as_printed):
    """Huang 2019: E = [Jw 1'; 0; 0] has rank 1, N = 4 < K; for h to infinity F = [A0; 1']^-1 [u; 0]."""
    Jw, s = 0.338, 1 / np.sqrt(3)
    A0 = oa.ROTATION @ (np.array([[1, 0, 0, s], [0, 1, 0, s], [0, 0, 1, s]]) - (2 if as_printed else 0)) * Jw
    E = np.zeros((P, 4))
    E[0] = Jw
    D = np.zeros((V, 3, P))
    D[:, :, 0] = (oa.corners([0.01] * 3) if V == 8 else np.array([[0.01] * 3, [-0.01] * 3])) @ oa.ROTATION.T
    problem = (A0, E, D, np.ones(4), np.zeros(4), 1e9, np.zeros(4))
    allocator = Allocator(4, 3, P, V)
    assert allocator.setup(*problem) == oa.OPTIMAL
    u = np.random.default_rng(0).normal(size=(200, 3)) * 0.05
    commands = u, np.zeros((200, 4)), np.full(4, -7.0), np.full(4, 7.0)
    for mode in (COLD, WARM, INTERIOR_POINT):
        _, results = allocator.sequence(*commands, mode=mode)
        check(problem, *commands, None, results)
        exact = np.linalg.solve(np.vstack([A0, np.ones(4)]), np.c_[u, np.zeros(200)].T).T
        if V == 8:  # the mass-centre error spans three directions, so the net wheel acceleration must vanish
            assert np.abs(results["force"] - exact).max() < 1e-2 * np.abs(exact).max()


@pytest.mark.filterwarnings("ignore:Solution may be inaccurate")
def test_agrees_with_a_conic_solver():
    """cvxpy and Clarabel on the second-order cone form; their tolerance, about 1e-7 of the objective, decides."""
    import cvxpy as cp

    allocator, rng = Allocator(12, 3, 3, 8), np.random.default_rng(8)
    A0, E, D = PLAIN[:3]
    for unreachable in (False, True):
        allocator.setup(*PLAIN)
        u, previous = rng.normal(size=3) * (6e-3 if unreachable else 4e-4), rng.uniform(0, oa.MAX_FORCE, 12)
        x = cp.Variable(12)
        F, U = oa.MAX_FORCE * x, 1e-3
        worst = cp.max(cp.hstack([cp.sum_squares((u - (A0 + D[v] @ E) @ F) / U) for v in range(8)]))
        cost = cp.sum_squares(F / U) + cp.sum_squares((F - previous) / U) + 1e6 * worst
        cp.Problem(cp.Minimize(cost), [x >= 0, x <= 1]).solve(solver="CLARABEL")
        ours = allocator.solve(u, previous, 0, oa.MAX_FORCE)
        assert ours.objective <= cost.value * U**2 * (1 + 1e-6)
        assert ours.objective >= cost.value * U**2 * (1 - 1e-5)


def test_box_least_squares():
    """V = 1, P = 0 is min |C F - d| in a box, which scipy solves by another method."""
    from scipy.optimize import lsq_linear

    allocator, rng = Allocator(12, 3, 0, 1), np.random.default_rng(3)
    allocator.setup(oa.A0_2020, None, None, 1, 2, 1e5, preferred=1e-3)
    for _ in range(50):
        u, previous = rng.normal(size=3) * 1e-3, rng.uniform(0, oa.MAX_FORCE, 12)
        C = np.vstack([np.sqrt(1e5) * oa.A0_2020, np.eye(12), np.sqrt(2) * np.eye(12)])
        d = np.concatenate([np.sqrt(1e5) * u, np.full(12, 1e-3), np.sqrt(2) * previous])
        truth = lsq_linear(C, d, bounds=(0, oa.MAX_FORCE), tol=1e-14)
        ours = allocator.solve(u, previous, 0, oa.MAX_FORCE)
        assert ours.status == oa.OPTIMAL
        assert ours.interior_point_iterations == 0
        assert np.allclose(ours.force, truth.x, atol=1e-5 * oa.MAX_FORCE)


def test_many_vertices_and_six_rows():
    """R = 6, P = 8, V = 64: effectiveness intervals of five actuators and a mass-centre box, all corners."""
    rng = np.random.default_rng(2)
    N, R, P, V = 12, 6, 8, 64
    A0 = np.vstack([oa.A0_2020, oa.E_2020 * 0.1])
    E = np.vstack([oa.E_2020, np.eye(12)[:5]])
    D = np.zeros((V, R, P))
    for v in range(V):
        sign = 2 * ((v >> np.arange(6)) & 1) - 1
        D[v, :3, :3] = -5e-3 * sign[0] * oa.skew(oa.ROTATION @ [1, 1, 1])
        D[v, :, 3:] = 0.1 * sign[1:] * A0[:, :5]
    problem = (A0, E, D, np.ones(N), np.ones(N), 1e6, np.zeros(N))
    allocator = Allocator(N, R, P, V)
    assert allocator.setup(*problem) == oa.OPTIMAL
    u, previous = rng.normal(size=(40, R)) * 3e-4, rng.uniform(0, oa.MAX_FORCE, (40, N))
    for mode in (COLD, WARM, INTERIOR_POINT):
        _, results = allocator.sequence(u, previous, 0, oa.MAX_FORCE, mode=mode)
        check(problem, u, previous, np.zeros(N), np.full(N, oa.MAX_FORCE), None, results)


@pytest.mark.slow
def test_sixty_four_actuators():
    """The largest size, all families: 64 actuators, 6 rows, 8 vertices; factors are told apart by all 64."""
    rng, allocator, fell_back = np.random.default_rng(5), Allocator(64, 6, 3, 8), []
    for family in oa.FAMILIES:
        for _ in range(3):
            problem, u, previous, lower, upper, step = oa.instance(rng, family, 64, 6)
            assert allocator.setup(*problem) == oa.OPTIMAL
            for mode in (COLD, WARM, INTERIOR_POINT):
                _, results = allocator.sequence(u, previous, lower, upper, step, mode=mode)
                check(problem, u, previous, lower, upper, step, results)
                if mode != INTERIOR_POINT and family != "all_zero":
                    fell_back += list(results["path"] == 2)
    assert np.mean(fell_back) < 0.05


def test_rank_deficient_effectiveness_is_solved():
    allocator, rng = Allocator(12, 3, 3, 8), np.random.default_rng(1)
    A0 = oa.A0_2020.copy()
    A0[2] = A0[0] + A0[1]
    problem = (A0, oa.E_2020, PLAIN[2], np.ones(12), np.ones(12), 1e6, np.zeros(12))
    allocator.setup(*problem)
    u, previous = rng.normal(size=(100, 3)) * 5e-4, rng.uniform(0, oa.MAX_FORCE, (100, 12))
    for mode in (COLD, WARM):
        _, results = allocator.sequence(u, previous, 0, oa.MAX_FORCE, mode=mode)
        check(problem, u, previous, np.zeros(12), np.full(12, oa.MAX_FORCE), None, results)
