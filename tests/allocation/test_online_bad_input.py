"""Bad input to the online allocator in C: it holds, refuses, and nothing sticks."""

import numpy as np
import online_allocator as oa
import pytest
from online_allocator import Allocator
from online_answers import PLAIN

NOT_FINITE = [(where, value) for where in ("u", "previous", "lower", "upper") for value in (np.nan, np.inf, -np.inf)]


# An infinite max_step is no mistake: there is no rate limit then.
@pytest.mark.parametrize(("where", "value"), [*NOT_FINITE, ("max_step", np.nan), ("max_step", -np.inf)])
def test_non_finite_input_holds_the_last_forces(thrusters, where, value):
    thrusters.reset()
    good = {
        "u": np.array([3e-4, 1e-4, 0]),
        "previous": np.full(12, 1e-3),
        "lower": np.zeros(12),
        "upper": np.full(12, oa.MAX_FORCE),
        "max_step": np.full(12, 1e-3),
    }
    before = np.array(thrusters.solve(**good).force)
    bad = {k: v.copy() for k, v in good.items()}
    bad[where][1] = value
    r = thrusters.solve(**bad)
    assert r.status == oa.BAD_COMMAND
    assert np.isfinite(r.force).all()
    assert np.isfinite(r.objective)
    expected = good["previous"].copy()
    if where == "previous":
        expected[1] = before[1]
    assert np.allclose(r.force, expected)
    assert np.array_equal(thrusters.solve(**good).force, before)  # nothing sticks


def test_previous_may_be_left_out(thrusters):
    thrusters.reset()
    u = np.array([3e-4, 1e-4, 0])
    first = np.array(thrusters.solve(u, None, 0, oa.MAX_FORCE).force)
    second = np.array(thrusters.solve(u, None, 0, oa.MAX_FORCE).force)
    thrusters.reset()
    thrusters.solve(u, np.zeros(12), 0, oa.MAX_FORCE)
    assert np.array_equal(thrusters.solve(u, first, 0, oa.MAX_FORCE).force, second)


def test_crossed_box_and_huge_numbers(thrusters):
    thrusters.reset()
    low, high = np.zeros(12), np.full(12, oa.MAX_FORCE)
    low[2] = 1
    assert thrusters.solve(np.zeros(3), np.zeros(12), low, high).status == oa.BAD_COMMAND
    for u in ([1e300, 0, 0], [1e160] * 3):
        r = thrusters.solve(u, np.zeros(12), 0, oa.MAX_FORCE)
        assert np.isfinite(r.force).all()
        assert r.status == oa.BAD_COMMAND
    assert thrusters.solve([1e-4, 0, 0], np.zeros(12), 0, oa.MAX_FORCE).status == oa.OPTIMAL


def test_fuzzed_words_never_give_nan_or_leave_the_box(thrusters):
    """Any 64-bit pattern as input: the call returns, forces are finite, and inside whenever the box is sound."""
    rng = np.random.default_rng(0)
    for _ in range(3000):
        values = rng.integers(0, 2**64, 39, dtype=np.uint64).view(np.float64)
        plain = rng.uniform(0, 4e-3, 39)
        mixed = np.where(rng.random(39) < 0.1, values, plain)
        u, previous, lower, upper = mixed[:3], mixed[3:15], np.minimum(mixed[15:27], 1e-3), mixed[27:]
        r = thrusters.solve(u, previous, lower, upper)
        assert np.isfinite(r.force).all()
        assert np.isfinite([r.objective, r.gap, r.worst_error]).all()
        if r.status != oa.BAD_COMMAND:
            assert (lower <= r.force).all()
            assert (r.force <= upper).all()


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("m1", -1),
        ("m2", np.nan),
        ("h", 0),
        ("h", np.inf),
        ("A0", np.nan),
        ("E", np.inf),
        ("D", np.nan),
        ("tolerance", -1),
    ],
)
def test_set_up_refuses(field, value):
    allocator = Allocator(12, 3, 3, 8)
    arguments = {"A0": oa.A0_2020, "E": oa.E_2020, "D": PLAIN[2], "m1": 1, "m2": 1, "h": 1e6}
    arguments[field] = value
    assert allocator.setup(**arguments) == oa.BAD_PROBLEM
    r = allocator.solve(np.ones(3), np.full(12, 1e-3), 0, oa.MAX_FORCE)  # and a solve with refused data holds
    assert r.status == oa.BAD_PROBLEM
    assert np.allclose(r.force, 1e-3)
