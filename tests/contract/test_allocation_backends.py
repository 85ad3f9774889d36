"""What every back end must keep, whoever wrote it. A new one is tested by being registered.

Truth is the certificate, which needs no solver, and that no two back ends contradict each other's.
"""

from functools import partial

import numpy as np
import pytest
from installed_backends import CASES, NAMES, answer, is_inside, need, oracle

from casadi_gnc.allocation import AllocationProblem, AllocationStatus, Allocator, backends, solve
from casadi_gnc.allocation.backends import Capability
from casadi_gnc.errors import AllocationError

#: Without curvature of their own (M1 = M2 = 0) the gap has a part of first order in the forces: a
#: solver's 1e-8 of the box is 1e-8 of the full effort's cost.
DEGENERATE_FLOOR = 1e-7
#: Back ends that take long for each problem: a second, and hundreds of iterations in Python.
LONG = ("sdp_scs", "eiqp")


@pytest.fixture(params=NAMES)
def name(request):
    return need(request.param)


def is_exact(name: str) -> bool:
    return Capability.EXACT in backends.module(name).CAPABILITIES


def solves(name: str, problem: AllocationProblem) -> bool:
    return Capability.ROBUST in backends.module(name).CAPABILITIES or not problem.is_robust


def labels(name: str) -> list[str]:
    """Return the cases that a back end is given: a third of them where each takes a second."""
    able = [label for label, case in CASES.items() if solves(name, case.problem)]
    return able[::3] if name == "sdp_scs" else able


def some_problem(name: str) -> AllocationProblem:
    robust = Capability.ROBUST in backends.module(name).CAPABILITIES and name != "sdp_scs"
    return CASES["5 mm, random 0" if robust else "no error"].problem


def scale(case) -> float:
    """Cost of the largest effort about: what rounding floors are shares of."""
    problem = case.problem
    return problem.accuracy_weight * max(problem.full_effort, float(np.linalg.norm(case.command))) ** 2


def test_all_cases_are_feasible_and_as_accurate_as_stated(name):
    relative, floor = backends.module(name).ACCURACY
    bad = {}
    for label in labels(name):
        case, found = CASES[label], answer(name, label)
        allowed = max(relative * found.objective, max(floor, DEGENERATE_FLOOR * case.is_degenerate) * scale(case))
        good = is_inside(case, found.forces) and (found.duality_gap <= allowed or not is_exact(name))
        weights = found.vertex_weights
        good &= weights.shape == (len(case.problem.errors),) and weights.min() >= 0 and abs(weights.sum() - 1) < 1e-12
        good &= np.allclose(
            found.unallocated, case.command - case.problem.effectiveness @ found.forces, rtol=0, atol=1e-15
        )
        if not good:
            bad[label] = f"gap {found.duality_gap:.1e} of {found.objective:.1e}, {found.status.name}"
    assert not bad


@pytest.mark.parametrize("label", CASES)
def test_no_back_end_contradicts_the_certificate_of_another(label):
    """f_a - gap_a <= f* <= f_b. The rounding of a cost is some 1e-13 of its terms."""
    case, names = CASES[label], [n for n in NAMES if not backends.missing(n)]
    found = {n: answer(n, label) for n in names if label in labels(n)}
    least = min(found, key=lambda n: found[n].objective)
    bound = max(found, key=lambda n: found[n].objective - found[n].duality_gap)
    rounding = 1e-13 * (found[least].objective + scale(case))
    assert found[bound].objective - found[bound].duality_gap <= found[least].objective + rounding, (bound, least)
    assert sum(is_exact(n) for n in found) >= 4


def test_random_problems_without_uncertainty(name, rng):
    """Bounds on both sides, weights and preferred forces of every actuator's own, h over five decades."""
    relative, floor = backends.module(name).ACCURACY
    for k in range(5 if name in LONG else 25):
        effectiveness = rng.normal(size=(3, 4))
        problem = AllocationProblem(
            effectiveness,
            -rng.uniform(0, 1, 4),
            rng.uniform(0, 1, 4),
            effort_weight=rng.uniform(0.1, 10, 4),
            change_weight=rng.uniform(0, 10, 4),
            accuracy_weight=10.0 ** rng.uniform(1, 6),
            max_step=rng.choice([0.2, np.inf]),
            preferred=rng.uniform(-0.1, 0.1, 4),
        )
        case = oracle.Case(problem, effectiveness @ rng.uniform(-1, 1, 4), rng.uniform(-0.5, 0.5, 4))
        found = solve(problem, case.command, case.previous, backend=name)
        assert is_inside(case, found.forces)
        if is_exact(name):
            assert found.duality_gap <= max(relative * found.objective, floor * scale(case)), k


def test_unreachable_and_dead_cases_are_what_they_should_be():
    """Closed forms: with every actuator dead nothing is done, and the cost is that of the command."""
    case = CASES["all dead"]
    found = answer("clarabel", "all dead")
    assert not np.any(found.forces)
    assert found.objective == pytest.approx(case.problem.accuracy_weight * case.command @ case.command, rel=1e-12)
    assert answer("clarabel", "all-zero command").objective <= 1e-15 * scale(CASES["all-zero command"])


def test_one_actuator_has_a_closed_form(name):
    """u > F (1 - d), so the smaller effectiveness is worst: F = h (1 - d) u / (m + h (1 - d)^2)."""
    robust = Capability.ROBUST in backends.module(name).CAPABILITIES
    d, m, h, u = 0.3 * robust, 2.0, 3.0, 1.0
    errors = np.array([[[-d]], [[d]]])
    problem = AllocationProblem(
        np.array([[1.0]]),
        0.0,
        2.0,
        coupling=np.array([[1.0]]),
        errors=errors,
        effort_weight=m,
        change_weight=0.0,
        accuracy_weight=h,
    )
    found = solve(problem, [u], [0.5], backend=name)
    if is_exact(name):
        assert found.forces[0] == pytest.approx(h * (1 - d) * u / (m + h * (1 - d) ** 2), abs=2e-3)
        if robust:
            assert found.vertex_weights[0] == pytest.approx(1.0, abs=2e-2)
            assert found.worst_vertex == 0


def test_samples_in_a_row_are_as_accurate_as_one(name):
    """A slew: whatever is kept from the last sample must not spoil the next."""
    problem = some_problem(name)
    allocator = Allocator(problem, name)
    relative, floor = backends.module(name).ACCURACY
    for k in range(8 if name in LONG else 25):
        command = oracle.COMMAND * np.cos([0.2 * k, 0.3 * k + 1, 0.1 * k])
        case = oracle.Case(problem, command, allocator.previous)
        found = allocator.solve(command)
        assert is_inside(case, found.forces)
        if is_exact(name):
            assert found.duality_gap <= max(relative * found.objective, floor * scale(case)), k


def test_two_allocators_do_not_disturb_each_other(name):
    """Nearly: ProxQP's sums depend on where its memory is aligned."""
    problem = some_problem(name)
    commands = [oracle.COMMAND, -oracle.COMMAND]
    alone = [Allocator(problem, name).solve(command).forces for command in commands]
    both = [Allocator(problem, name) for _ in commands]
    again = [allocator.solve(command).forces for allocator, command in zip(both, commands, strict=True)]
    assert np.allclose(alone, again, rtol=0, atol=1e-9 * oracle.MAX_FORCE)


def test_unknown_and_senseless_options_are_refused(name):
    problem = some_problem(name)
    with pytest.raises(AllocationError, match="nonsense"):
        Allocator(problem, name, nonsense=1)
    if is_exact(name):
        for wrong in (-1.0, float("nan"), "tight"):
            with pytest.raises(AllocationError, match="tolerance|tight|refused|number"):
                Allocator(problem, name, tolerance=wrong)


def test_a_command_that_is_no_number_keeps_the_forces(name):
    allocator = Allocator(some_problem(name), name)
    before = allocator.solve(oracle.COMMAND).forces
    for wrong in (np.nan, np.inf, -np.inf, 1e200):
        found = allocator.solve([wrong, 0.0, 0.0])
        assert found.status is AllocationStatus.BAD_COMMAND
        assert np.array_equal(found.forces, before)
        found = allocator.solve(oracle.COMMAND, np.append(np.full(11, 1e-3), wrong))
        assert found.status is AllocationStatus.BAD_COMMAND
        assert np.all(np.isfinite(found.forces))
        before = allocator.previous
    assert allocator.solve(oracle.COMMAND).status is not AllocationStatus.BAD_COMMAND


def test_wrong_shapes_are_refused(name):
    allocator = Allocator(some_problem(name), name)
    with pytest.raises(AllocationError, match=r"command has shape \(2,\), expected \(3,\)"):
        allocator.solve([1.0, 2.0])
    with pytest.raises(AllocationError, match=r"previous \(3,\), expected \(12,\)"):
        allocator.solve(oracle.COMMAND, [1.0, 2.0, 3.0])


@pytest.mark.parametrize("plain", [n for n in NAMES if Capability.ROBUST not in backends.module(n).CAPABILITIES])
def test_uncertainty_is_refused_by_a_back_end_for_quadratic_programs(plain):
    name = need(plain)
    robust, certain = CASES["5 mm, random 0"].problem, CASES["no error"].problem
    with pytest.raises(AllocationError, match=f"'{name}' solves problems without uncertainty only; leave coupling"):
        Allocator(robust, name)
    allocator = Allocator(certain, name)
    with pytest.raises(AllocationError, match="without uncertainty only"):
        allocator.update(errors=robust.errors)
    found = allocator.solve(oracle.COMMAND)  # and what was there still works
    assert found.status.is_certified or not is_exact(name)


def test_update_changes_the_problem(name):
    allocator = Allocator(some_problem(name), name)
    allocator.solve(oracle.COMMAND)
    allocator.update(upper=1e-3)
    assert allocator.solve(oracle.COMMAND).forces.max() <= 1e-3
    with pytest.raises(AllocationError, match="nonsense"):
        allocator.update(nonsense=1.0)


def test_unknown_names_are_answered_with_the_known_ones():
    with pytest.raises(AllocationError, match="no allocation back end 'none'; .*[Tt]here is .*clarabel"):
        Allocator(CASES["no error"].problem, "none")
    with pytest.raises(AllocationError, match="qpsolvers does not find the solver 'none'"):
        Allocator(CASES["no error"].problem, "qpsolvers:none")


@pytest.mark.parametrize("solver", ["clarabel", "daqp", "proxqp", "scs"])
def test_every_solver_of_qpsolvers_can_be_named(solver):
    need(solver)
    case = CASES["no error"]
    found = solve(case.problem, case.command, case.previous, backend=f"qpsolvers:{solver}")
    assert found.status.is_certified
    with pytest.raises(AllocationError, match="refuses|max_iterations|takes no"):
        Allocator(case.problem, f"qpsolvers:{solver}", max_iterations=0)


def test_solvers_under_the_gpl_are_never_chosen():
    assert not {"quadprog", "cvxopt", "kvxopt", "ecos", "qpswift"}.intersection(NAMES)


def test_registry_says_what_there_is(name):
    home = backends.module(name)
    assert isinstance(home.CAPABILITIES, Capability)
    assert callable(home.set_up)
    assert all(value > 0 for value in home.ACCURACY)
    kinds = Capability.SOCP | Capability.SDP | Capability.NLP | Capability.QP | Capability.C_CODE
    assert home.CAPABILITIES & kinds
    assert bool(home.CAPABILITIES & Capability.QP) <= (Capability.ROBUST not in home.CAPABILITIES)
    assert isinstance(partial(home.set_up, some_problem(name))(), object)
