"""Many small linear programs at once, and a driven loop by doubling, against one after the other."""

import numpy as np
import pytest
from scipy.optimize import linprog

from casadi_gnc.checking.linear import driven
from casadi_gnc.checking.programs import largest_shares, least_shares


@pytest.mark.parametrize("always_on", [0.0, 0.4])
def test_largest_shares_are_those_of_single_programs(rng, always_on):
    matrix = rng.standard_normal((3, 7))
    lower, upper = np.full(7, -0.2), rng.uniform(0.5, 2.0, 7)
    lower[2], upper[2] = always_on, 1.0  # what cannot be turned off is made up for by the others, or is not
    wanted = rng.standard_normal((9, 3))
    for effort, share in zip(wanted, largest_shares(matrix, wanted, lower, upper), strict=True):
        found = linprog(
            np.r_[np.zeros(7), -1.0],
            A_eq=np.column_stack([matrix, -effort]),
            b_eq=np.zeros(3),
            bounds=[*zip(lower, upper, strict=True), (0, None)],
        )
        assert share == pytest.approx(found.x[-1] if found.status == 0 else 0.0, rel=1e-8)


def test_an_effort_that_cannot_be_made_takes_no_share_from_others():
    """Two actuators on one axis that push one way, and a third across: by hand 2, 0, 1, 5/4."""
    matrix = np.array([[1.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    wanted = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, -1.0], [1.0, 0.8]])
    shares = largest_shares(matrix, wanted, [0.0, 0.0, -1.0], [1.0, 1.0, 1.0])
    assert shares == pytest.approx([2.0, 0.0, 1.0, 1.25], abs=1e-9)
    # One that is always on leaves 1 N along the first axis to every effort across, which nothing cancels.
    assert largest_shares(matrix, wanted, [1.0, 0.0, -1.0], [1.0, 1.0, 1.0]) == pytest.approx([2.0, 0.0, 0.0, 1.25])


def test_least_shares_are_loads_over_what_there_is():
    """One axis, two actuators of 2 and 1 N, a load d: |d| / 3 of the bounds; one without actuators is never borne."""
    bounds = np.array([[1.0, 0, -2], [-1, 0, -2], [0, 1, -1], [0, -1, -1]])
    loads = np.array([[0.3], [-1.5], [0.0], [6.0]])
    gain = np.ones((4, 1, 2))
    assert least_shares(bounds, gain, loads) == pytest.approx(np.abs(loads.ravel()) / 3, abs=1e-9)
    gain[3] = 0.0
    assert least_shares(bounds, gain, loads) == pytest.approx([0.1, 0.5, 0.0, np.inf], abs=1e-9)


@pytest.mark.parametrize("count", [1, 2, 3, 64, 1001])
def test_driven_loop_by_doubling(rng, count):
    step = rng.standard_normal((5, 5))
    step *= 0.98 / np.abs(np.linalg.eigvals(step)).max()
    push = rng.standard_normal((count, 5))
    state, path = np.zeros(5), []
    for each in push:
        path.append(state)
        state = step @ state + each
    # The sums are in another order: some rounding of numbers up to about 50.
    assert np.allclose(driven(step, push), path, rtol=0, atol=1e-11)


def test_what_an_unstable_part_does_not_touch_goes_on():
    path = driven(np.diag([3.0, 0.5]), np.ones((4000, 2)))
    assert np.isfinite(path).all()
    assert path[-1, 1] == pytest.approx(2.0, rel=1e-12)
    assert path[-1, 0] >= 1e150
