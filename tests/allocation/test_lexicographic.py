"""Truth: intervals by hand, SciPy's linear program in another form, and bounds that hold for any forces in the box."""

import json

import numpy as np
import pytest
from scipy.optimize import linprog
from typer.testing import CliRunner

from casadi_gnc.allocation import AllocationProblem, AllocationStatus
from casadi_gnc.allocation.lexicographic import ROUNDING, LeastPropellant, Limit
from casadi_gnc.cli.main import app
from casadi_gnc.errors import AllocationError, PackageError, ProblemError
from casadi_gnc.problem_files.allocation_file import load_allocation

FILE = """format = 1
kind = "allocation"
[matrices]
effectiveness = [[1.0, 1.0, 0.0], [0.0, 1.0, 1.0]]
lower = 0.0
upper = 1.0
[weights]
change = 0.0
effort = [1.0, 3.0, 1.0]
[options]
objective = "propellant"
priorities = [0, 1]
[[limit]]
name = "bus power"
coefficients = [2.0, 1.0, 2.0]
most = 2.5
"""


def box_problem(rng, rows=3, count=7, **other):
    return AllocationProblem(rng.normal(size=(rows, count)), -0.2, rng.uniform(0.3, 1.0, count), **other)


def test_least_propellant_is_that_of_the_program_with_equalities(rng):
    """For commands that can be made: min sum w (p + m), A (p - m) = u; forces split in what pushes and pulls."""
    for _ in range(10):
        problem = box_problem(rng, effort_weight=rng.uniform(0.5, 2.0, 7))
        command = problem.effectiveness @ rng.uniform(problem.lower, problem.upper)
        found = LeastPropellant(problem).solve(command)
        cost = np.concatenate([problem.effort_weight, problem.effort_weight])
        sides = [(0.0, high) for high in problem.upper] + [(0.0, -low) for low in problem.lower]
        A = np.hstack([problem.effectiveness, -problem.effectiveness])
        truth = linprog(cost, A_eq=A, b_eq=command, bounds=sides, method="highs-ipm")
        assert found.status is AllocationStatus.OPTIMAL
        assert found.objective == pytest.approx(truth.fun, rel=1e-6)
        assert found.levels[0].error <= 1e-8 * problem.full_effort
        assert found.duality_gap <= 1e-6 * found.objective
        assert np.all((found.forces >= problem.lower) & (found.forces <= problem.upper))


def test_levels_are_exact_whatever_the_weights(rng):
    """One row a level: the first error is the distance to what its row can make; no second level is bought with it."""
    for _ in range(10):
        problem = box_problem(rng, rows=2, count=4)
        command = rng.normal(size=2) * 3
        first, second = LeastPropellant(problem, [1, 0]).solve(command).levels
        assert (first.rows, second.rows) == ((2,), (1,))
        row = problem.effectiveness[1]
        most = np.maximum(row * problem.lower, row * problem.upper).sum()
        least = np.minimum(row * problem.lower, row * problem.upper).sum()
        assert first.error == pytest.approx(max(command[1] - most, least - command[1], 0.0), abs=1e-7)
        # Of many forces with as small a first error, none has a smaller second one.
        forces = rng.uniform(problem.lower, problem.upper, (20000, 4))
        errors = np.abs(command - forces @ problem.effectiveness.T)
        kept = errors[errors[:, 1] <= first.error]
        assert second.error <= kept[:, 0].min(initial=np.inf) + 1e-7
        assert max(first.gap, second.gap) <= ROUNDING * problem.full_effort


def test_bounds_hold_for_any_forces_under_the_worst_error(rng):
    """The certificate against forces drawn at random, and the error against errors drawn inside the box."""
    problem = load_allocation("huang2020/allocation").problem
    found = LeastPropellant(problem, [0, 1, 1]).solve([9e-4, 3e-4, -6e-4], np.full(12, 1e-3))
    assert found.status is AllocationStatus.OPTIMAL
    lower, upper = problem.box(np.full(12, 1e-3))
    for forces in rng.uniform(lower, upper, (200, 12)):
        error = np.abs(problem.missing(forces, np.array([9e-4, 3e-4, -6e-4])))[:, 0].max()
        assert error >= found.levels[0].error - found.levels[0].gap
    for share in rng.dirichlet(np.ones(8), 200):
        made = np.einsum("v,vrn,n->r", share, problem.vertices, found.forces)
        assert abs(9e-4 - made[0]) <= found.levels[0].error + 1e-15
    assert found.vertex_weights.sum() == pytest.approx(1.0)


def test_limits_are_kept_or_broken_as_little_as_can_be():
    problem = AllocationProblem(np.array([[1.0, 1.0]]), 0.5, 2.0)
    free = LeastPropellant(problem).solve([3.0])
    assert free.levels[0].error == pytest.approx(0.0, abs=1e-8)
    kept = LeastPropellant(problem, limits=[Limit([1.0, 1.0], 2.5)]).solve([3.0])
    assert kept.status is AllocationStatus.OPTIMAL
    assert kept.forces.sum() == pytest.approx(2.5, abs=1e-7)
    broken = LeastPropellant(problem, limits=[Limit([1.0, 1.0], 0.7)]).solve([3.0])
    assert broken.status is AllocationStatus.LIMITS_BROKEN
    assert not broken.status.is_certified
    assert broken.forces == pytest.approx([0.5, 0.5], abs=1e-7)  # the least sum that the bounds allow


def test_bad_numbers_keep_the_forces_and_wrong_sizes_are_told():
    allocator = LeastPropellant(AllocationProblem(np.eye(2), 0.0, 1.0))
    before = allocator.solve([0.3, 0.4]).forces
    for wrong in (np.nan, np.inf, 1e200):
        found = allocator.solve([wrong, 0.0])
        assert found.status is AllocationStatus.BAD_COMMAND
        assert np.array_equal(found.forces, before)
    with pytest.raises(AllocationError, match=r"command has shape \(3,\), expected \(2,\)"):
        allocator.solve([1.0, 2.0, 3.0])
    with pytest.raises(AllocationError, match="1 priorities for 2 rows"):
        LeastPropellant(allocator.problem, [0])
    with pytest.raises(AllocationError, match=r"coefficients of shape \(1,\), expected 2 finite"):
        LeastPropellant(allocator.problem, limits=[Limit([1.0], 1.0)])
    with pytest.raises(AllocationError, match="accuracy 'best' is not known"):
        LeastPropellant(allocator.problem, accuracy="best")
    with pytest.raises(AllocationError, match="no force costs propellant"):
        LeastPropellant(AllocationProblem(np.eye(2), 0.0, 1.0, effort_weight=0.0))


def test_a_file_is_allocated_by_the_command_line(tmp_path):
    """1.5 by the first row, 0.5 by the second, 2 F1 + F2 + 2 F3 <= 2.5: F1 + F2 = 1.5 and F2 >= 0.5 leave F3 = 0,
    F2 = 0.5, F1 = 1."""
    (tmp_path / "a.toml").write_text(FILE)
    (tmp_path / "u.csv").write_text("u1,u2\n1.5,0.5\nnan,0\n")
    done = CliRunner().invoke(app, ["allocate", str(tmp_path / "a.toml"), "--commands", str(tmp_path / "u.csv")])
    assert done.exit_code == 0, done.output
    names, first, second = (line.split(",") for line in done.stdout.splitlines()[:3])
    assert names[-4:] == ["level1_error", "level1_gap", "level2_error", "level2_gap"]
    assert len(names) == len(first) == len(second)
    assert [float(value) for value in first[:3]] == pytest.approx([1.0, 0.5, 0.0], abs=1e-6)
    assert (first[3], second[3]) == ("OPTIMAL", "BAD_COMMAND")
    done = CliRunner().invoke(app, ["allocate", str(tmp_path / "a.toml"), "--stream", "--json"], input="1.5 0.5\n")
    assert [level["rows"] for level in json.loads(done.stdout.splitlines()[0])["levels"]] == [[1], [2]]


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("2.0, 1.0, 2.0]", "2.0]", "1 coefficients, expected 3, one an actuator"),
        ('objective = "propellant"', "", 'needs objective = "propellant"'),
        ('objective = "propellant"', 'objective = "propellant"\nkeep_direction = true', "keep_direction needs"),
        ('objective = "propellant"', 'objective = "propellant"\npriority_ratio = 9.0', "priorities are exact"),
        ("priorities = [0, 1]", "priorities = [0]", "1 priorities for 2 rows"),
        ("effort = [1.0, 3.0, 1.0]", "effort = 0.0", "no force costs propellant"),
        ("most = 2.5", "most = nan", "most"),
        ('"propellant"', '"fuel"', "objective"),
    ],
)
def test_what_does_not_fit_is_one_sentence(tmp_path, old, new, told):
    (tmp_path / "a.toml").write_text(FILE.replace(old, new, 1))
    with pytest.raises(ProblemError, match=told) as caught:
        load_allocation(tmp_path / "a.toml")
    assert "\n" not in str(caught.value)


def test_it_is_not_flown_and_takes_no_back_end(tmp_path):
    from casadi_gnc.delivery.making import flight_allocator
    from casadi_gnc.problem_files.allocating import CaseAllocator

    (tmp_path / "a.toml").write_text(FILE)
    case = load_allocation(tmp_path / "a.toml")
    with pytest.raises(PackageError, match="solved by linear programs"):
        flight_allocator(case)
    with pytest.raises(AllocationError, match="leave --backend out"):
        CaseAllocator(case, "clarabel")
