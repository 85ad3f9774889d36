"""What every back end of the allocation keeps, whoever wrote it: the truth is the certificate."""

from __future__ import annotations

from typing import Any

import numpy as np

from casadi_gnc.allocation import AllocationProblem, AllocationStatus, Allocator, backends, solve
from casadi_gnc.allocation.backends import Capability
from casadi_gnc.errors import AllocationError
from casadi_gnc.testing.asserting import must


def check_allocation_backend(backend: Any, problems: int = 20) -> None:
    """Test a back end, by its name or itself, on random problems and on one with a closed form.

    Tested: forces inside their bounds; a gap within the accuracy that it states; weights on the simplex; samples in
    a row as accurate as one; a command that is no number keeps the forces; wrong shapes and unknown options are
    refused; two allocators do not disturb each other.

    Raises
    ------
    ContractError
        Saying what is not kept.
    """
    home, name = backends.module(backend), backends.name_of(backend)
    must(isinstance(home.CAPABILITIES, Capability), f"CAPABILITIES of {name} is no Capability")
    must(all(value > 0 for value in home.ACCURACY), f"ACCURACY of {name} is {home.ACCURACY}, expected two positives")
    generator = np.random.default_rng(1)
    robust = Capability.ROBUST in home.CAPABILITIES
    for k in range(problems):
        problem = _random_problem(generator, robust and k % 2 == 0)
        command = problem.effectiveness @ generator.uniform(-1, 1, problem.count)
        _check_answer(backend, problem, command, generator.uniform(-0.2, 0.2, problem.count), f"problem {k + 1}")
    _check_closed_form(backend, robust)
    _check_sequence(backend, generator)
    _check_refusals(backend, _random_problem(generator, False))


def _random_problem(generator: np.random.Generator, robust: bool) -> AllocationProblem:
    effectiveness = generator.normal(size=(3, 5))
    uncertainty = {}
    if robust:
        corners = np.array([np.outer(sign * np.eye(3)[axis], 1.0) for axis in range(3) for sign in (-0.1, 0.1)])
        uncertainty = {"coupling": np.ones((1, 5)), "errors": corners}
    return AllocationProblem(
        effectiveness,
        -generator.uniform(0.1, 1, 5),
        generator.uniform(0.1, 1, 5),
        effort_weight=generator.uniform(0.1, 10, 5),
        change_weight=generator.uniform(0, 10, 5),
        accuracy_weight=10.0 ** generator.uniform(1, 6),
        **uncertainty,
    )


def _check_answer(backend: Any, problem: AllocationProblem, command: np.ndarray, last: np.ndarray, what: str) -> None:
    home, name = backends.module(backend), backends.name_of(backend)
    found = solve(problem, command, last, backend=backend)
    lower, upper = problem.box(last)
    inside = found.forces.shape == lower.shape and bool(np.all((lower <= found.forces) & (found.forces <= upper)))
    must(inside, f"{name}, {what}: forces outside their bounds, or of another number")
    weights = found.vertex_weights
    must(weights.min() >= 0 and abs(weights.sum() - 1) < 1e-12, f"{name}, {what}: weights off the simplex")
    if Capability.EXACT not in home.CAPABILITIES:
        return
    relative, floor = home.ACCURACY
    scale = problem.accuracy_weight * max(problem.full_effort, float(np.linalg.norm(command))) ** 2
    allowed = max(relative * found.objective, floor * scale)
    told = f"{name}, {what}: the certificate's gap is {found.duality_gap:.2g}, its stated accuracy allows {allowed:.2g}"
    must(found.duality_gap <= allowed, told)


def _check_closed_form(backend: Any, robust: bool) -> None:
    """One actuator: u > F (1 - d), so the smaller effectiveness is worst, and F = h (1 - d) u / (m + h (1 - d)^2)."""
    home, name = backends.module(backend), backends.name_of(backend)
    if Capability.EXACT not in home.CAPABILITIES:
        return
    d, m, h, u = 0.3 * robust, 2.0, 3.0, 1.0
    uncertainty = {"coupling": np.array([[1.0]]), "errors": np.array([[[-d]], [[d]]])} if robust else {}
    problem = AllocationProblem(
        np.array([[1.0]]), 0.0, 2.0, effort_weight=m, change_weight=0.0, accuracy_weight=h, **uncertainty
    )
    expected = h * (1 - d) * u / (m + h * (1 - d) ** 2)
    force = float(solve(problem, [u], [0.5], backend=backend).forces[0])
    must(abs(force - expected) < 2e-3, f"{name}: one actuator is told {force:.5g}, the closed form is {expected:.5g}")


def _check_sequence(backend: Any, generator: np.random.Generator) -> None:
    """Whatever is kept from the last sample must not spoil the next, nor another allocator."""
    name, problem = backends.name_of(backend), _random_problem(generator, False)
    commands = [np.array([0.5 * np.cos(0.2 * k), 0.4 * np.cos(0.3 * k + 1), 0.3 * np.cos(0.1 * k)]) for k in range(10)]
    alone, one, other = (Allocator(problem, backend) for _ in range(3))
    quiet = [alone.solve(command).forces for command in commands]
    disturbed = []
    for command in commands:
        disturbed.append(one.solve(command).forces)
        other.solve(-command)
    for k, forces in enumerate(quiet, 1):
        inside = np.all((problem.lower <= forces) & (forces <= problem.upper))
        must(inside, f"{name}: sample {k} of a sequence leaves the bounds")
    near = np.allclose(quiet, disturbed, rtol=0, atol=1e-6 * float(problem.upper.max()))
    must(near, f"{name}: the same commands give other forces where another allocator works beside")


def _check_refusals(backend: Any, problem: AllocationProblem) -> None:
    name, allocator = backends.name_of(backend), Allocator(problem, backend)
    before = allocator.solve([0.1, 0.1, 0.1]).forces
    found = allocator.solve([np.nan, 0.0, 0.0])
    kept = found.status is AllocationStatus.BAD_COMMAND and np.array_equal(found.forces, before)
    must(kept, f"{name}: a command that is no number does not keep the forces")
    try:
        Allocator(problem, backend, nonsense=1)
    except AllocationError:
        return
    must(False, f"{name} takes an option that it does not know; name its options in set_up(problem, *, ...)")
