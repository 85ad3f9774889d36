"""Truth: differences of forces that were solved anew on the exact active set, and a closed form."""

import numpy as np
import pytest

from casadi_gnc.allocation import AllocationProblem, solve
from casadi_gnc.allocation.derivatives import jacobian
from casadi_gnc.errors import AllocationError
from casadi_gnc.problem_files.allocation_file import load_allocation

ROBUST = load_allocation("huang2020/allocation").problem
PLAIN = AllocationProblem(ROBUST.effectiveness, ROBUST.lower, ROBUST.upper, max_step=5e-4)
STEP = 1e-7


@pytest.mark.parametrize(("problem", "backend"), [(PLAIN, "daqp"), (ROBUST, "sqpmethod")], ids=["rates", "vertices"])
def test_derivatives_are_those_of_differences(problem, backend, rng):
    """Steps of 1e-7 on forces of 1e-3: piecewise linear without errors, with them exact to 1e-4 of the step."""
    for _ in range(2):
        command, previous = rng.normal(size=3) * 4e-4, rng.uniform(0, 2e-3, 12)
        found = jacobian(problem, solve(problem, command, previous, backend=backend), command, previous)
        if not found.is_determined:
            continue
        for side, columns, count in (("command", found.by_command, 3), ("previous", found.by_previous, 12)):
            for i in (0, count - 1):
                step = STEP * (np.arange(count) == i)
                ends = [
                    solve(
                        problem,
                        command + sign * step if side == "command" else command,
                        previous + sign * step if side == "previous" else previous,
                        backend=backend,
                    ).forces
                    for sign in (1, -1)
                ]
                assert columns[:, i] == pytest.approx((ends[0] - ends[1]) / (2 * STEP), abs=1e-5)


def test_a_tie_of_bounds_is_told():
    """u = 0 puts F on its lower bound without a price: 0 on one side, h/(m + h) on the other."""
    problem = AllocationProblem(np.array([[1.0]]), 0.0, 1.0, change_weight=0.0, accuracy_weight=3.0)
    at = {u: jacobian(problem, solve(problem, [u], backend="daqp"), [u], [0.0]) for u in (-0.5, 0.0, 0.5)}
    assert [at[u].is_determined for u in at] == [True, False, True]
    assert at[-0.5].by_command.item() == 0.0
    assert at[0.5].by_command.item() == pytest.approx(3 / 4)


def test_wrong_shapes_and_answers_that_prove_nothing_are_refused():
    answer = solve(PLAIN, [1e-4, 0, 0], backend="pinv")
    with pytest.raises(AllocationError, match="NOT_CERTIFIED has no derivatives"):
        jacobian(PLAIN, answer, [1e-4, 0, 0], np.zeros(12))
    with pytest.raises(AllocationError, match=r"command has shape \(2,\), expected \(3,\)"):
        jacobian(PLAIN, answer, [1e-4, 0], np.zeros(12))
