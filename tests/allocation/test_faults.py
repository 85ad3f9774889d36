"""Truth: the changed geometry itself, and the wheel fault of Huang and Duan (2019), derived independently."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from casadi_gnc.allocation import AllocationProblem, Allocator, solve
from casadi_gnc.allocation.faults import with_faults, worst_alignment
from casadi_gnc.errors import AllocationError
from casadi_gnc.mechanics.attitude import frame_rotation


@pytest.fixture
def problem(rng):
    errors = 0.05 * rng.normal(size=(4, 3, 3))
    return AllocationProblem(rng.normal(size=(3, 7)), 0.0, 1.0, coupling=rng.normal(size=(3, 7)), errors=errors)


def test_dead_and_stuck_actuators_stay_where_they_are(problem, rng):
    faulty = with_faults(problem, dead=(2,), stuck={5: 0.25})
    for _ in range(5):
        answer = solve(faulty, rng.normal(size=3))
        assert answer.forces[1] == 0
        assert answer.forces[4] == 0.25
        assert answer.status.is_certified


def test_vertices_of_degraded_actuators_are_the_degraded_geometry(problem):
    """Every vertex is (A + D_c E) diag(g) for a corner of geometry and effectiveness."""
    faulty = with_faults(problem, degraded={1: (0.5, 1.0), 6: (0.0, 0.8)})
    expected = []
    for corner, g1, g6 in product(problem.errors, (0.5, 1.0), (0.0, 0.8)):
        g = np.ones(7)
        g[0], g[5] = g1, g6
        expected.append((problem.effectiveness + corner @ problem.coupling) * g)
    assert np.allclose(faulty.vertices, expected, atol=1e-14)
    assert faulty.coupling.shape == (5, 7)


def test_corners_bound_the_inside_of_the_box(problem, rng):
    faulty = with_faults(problem, degraded={1: (0.5, 1.0), 6: (0.0, 0.8)})
    forces, command = rng.uniform(0, 1, 7), rng.normal(size=3)
    worst = faulty.vertex_costs(forces, command).max()
    for _ in range(300):
        weights, g = rng.dirichlet(np.ones(4)), np.ones(7)
        g[0], g[5] = rng.uniform(0.5, 1.0), rng.uniform(0.0, 0.8)
        geometry = (problem.effectiveness + np.tensordot(weights, problem.errors, 1) @ problem.coupling) * g
        assert faulty.accuracy_weight * np.sum((command - geometry @ forces) ** 2) <= worst * (1 + 1e-12)


def test_bad_faults_are_told(problem):
    with pytest.raises(AllocationError, match="fault on actuator 8; there are actuators 1 to 7"):
        with_faults(problem, dead=(8,))
    with pytest.raises(AllocationError, match="actuator 1: effectiveness from 0.9 to 0.2"):
        with_faults(problem, degraded={1: (0.9, 0.2)})
    with pytest.raises(AllocationError, match="make 128 vertices; 64 are the limit"):
        with_faults(problem, degraded=dict.fromkeys(range(1, 6), (0.5, 1.0)))


R = np.array(frame_rotation(np.pi / 4, np.pi / 7, np.pi / 3))
AXES = R @ np.array([[1, 0, 0, 1 / np.sqrt(3)], [0, 1, 0, 1 / np.sqrt(3)], [0, 0, 1, 1 / np.sqrt(3)]])


def wheels(accuracy_weight: float) -> AllocationProblem:
    """The paper's model: columns R(cbar_i - r_c) J_w, whose error acts on the sum of accelerations."""
    jw, centre, half = 0.338, np.array([2.0, 2.0, 2.0]), 0.3
    nominal = jw * (AXES - (R @ centre)[:, None])
    errors = [-(R @ (half * np.array(s)))[:, None] for s in product((-1, 1), repeat=3)]
    return AllocationProblem(
        nominal, -7.0, 7.0, coupling=np.full((1, 4), jw), errors=np.array(errors), effort_weight=1.0, change_weight=0.0,
        accuracy_weight=accuracy_weight,
    )  # fmt: skip


def test_large_weights_turn_the_loop_around_under_wheel_faults():
    """Minimising against mass-centre errors makes wheels oppose each other; half-dead ones then lose.

    Derived independently: torque map eigenvalue -1.44 at wheel effectiveness (.5, .5, 1, 1) and large h.
    """
    problem = wheels(1e6)
    degraded = replace(problem, effectiveness=problem.effectiveness * [0.5, 0.5, 1, 1], coupling=None, errors=None)
    assert worst_alignment(problem, degraded).share < -0.5
    assert worst_alignment(problem).share > 0.5
    # The eigenvalue itself, from the linear limit x = [C0 Jw; 1']^-1 [u; 0].
    limit = np.linalg.inv(np.vstack([problem.effectiveness, np.ones(4)]))[:, :3]
    assert np.linalg.eigvals(degraded.effectiveness @ limit).real.min() == pytest.approx(-1.44, abs=0.02)


def test_faults_in_the_uncertainty_keep_the_loop_the_right_way():
    problem = wheels(1e6)
    known = with_faults(problem, degraded={1: (0.5, 1.0), 2: (0.5, 1.0)})
    assert worst_alignment(known, known).share > 0


def test_update_keeps_the_last_forces(problem, rng):
    allocator = Allocator(problem)
    first = allocator.solve(rng.normal(size=3))
    allocator.update(upper=0.5)
    assert np.array_equal(allocator.previous, first.forces)
    assert np.all(allocator.solve(rng.normal(size=3)).forces <= 0.5)


def test_an_update_of_the_on_board_solver_costs_no_more_than_a_cold_start(rng):
    """New weights: the solver tries to go on from the last answer, within its budget, and is certified."""
    from casadi_gnc.problem_files.allocation_file import load_allocation

    problem = load_allocation("huang2020/allocation").problem
    warm, cold = Allocator(problem, "online", accuracy="high"), Allocator(problem, "online", accuracy="high")
    command = rng.uniform(-3e-4, 3e-4, 3)
    last = warm.solve(command).forces
    warm.update(accuracy_weight=1.001e6)
    cold = Allocator(replace(problem, accuracy_weight=1.001e6), "online", accuracy="high")
    answers = warm.solve(command, last), cold.solve(command, last)
    assert all(answer.status.is_certified for answer in answers)
    assert answers[0].iterations <= answers[1].iterations + 4
    assert answers[0].objective == pytest.approx(answers[1].objective, rel=1e-7)


def test_dead_actuators_of_the_truth_do_not_follow():
    from casadi_gnc.problem_files.allocation_file import load_allocation

    problem = load_allocation("huang2020/allocation").problem
    assert worst_alignment(problem).share > 0.9
    assert worst_alignment(problem, with_faults(problem, dead=tuple(range(1, 13)))).share == pytest.approx(0.0)


def test_arrays_that_the_c_would_read_past_are_refused():
    from casadi_gnc.allocation.online import OnlineSolver
    from casadi_gnc.problem_files.allocation_file import load_allocation

    solver = OnlineSolver(load_allocation("huang2020/allocation").problem)
    lower, upper = np.zeros(12), np.full(12, 1e-3)
    with pytest.raises(AllocationError, match=r"expected \(3,\)"):
        solver.solve(np.zeros(1), lower, lower, upper)
    for commands, low in ((np.zeros((5, 2)), lower), (np.zeros(3), lower), (np.zeros((5, 3)), 0.0)):
        with pytest.raises(AllocationError, match="an array has shape"):
            solver.sequence(commands, low, upper)
