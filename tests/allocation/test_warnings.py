"""What allocation files are warned of or refused for: rank, forces never reached, faults that cannot be, no numbers."""

import numpy as np
import pytest

from casadi_gnc.errors import GncError
from casadi_gnc.problem_files.allocation_file import load_allocation

ROTORS = [
    [-0.15, -0.3, -0.15, 0.15, 0.3, 0.15],
    [0.2598, 0.0, -0.2598, -0.2598, 0.0, 0.2598],
    [-0.05, 0.05, -0.05, 0.05, -0.05, 0.05],
    [-1.0, -1.0, -1.0, -1.0, -1.0, -1.0],
]


def warnings(tmp_path, matrix, more=""):
    path = tmp_path / "a.toml"
    path.write_text(
        f'format = 1\nkind = "allocation"\n[matrices]\neffectiveness = {np.array(matrix).tolist()}\nlower = 0.0\n'
        f"upper = 1.0\n{more}"
    )
    return load_allocation(path).warnings


def test_a_dead_rotor_and_the_one_opposite_lose_an_axis(tmp_path):
    """numpy: the live columns have the singular values 2, 0.52, 0.32 and 0."""
    (told,) = warnings(tmp_path, ROTORS, "[faults]\ndead = [1, 4]\n")
    assert "of the actuators that can move has rank 3 of 4" in told
    (same,) = warnings(tmp_path, np.delete(ROTORS, [0, 3], axis=1))
    assert "has rank 3 of 4" in same
    assert not warnings(tmp_path, ROTORS)
    assert not warnings(tmp_path, ROTORS, "[faults]\ndead = [1]\n")
    (told,) = warnings(tmp_path, ROTORS, "[faults]\ndead = [1, 2, 3, 4, 5, 6]\n")
    assert "no actuator can move" in told


@pytest.mark.parametrize(("part", "near"), [(1e-3, True), (0.1, False)])
def test_an_axis_that_is_nearly_lost_is_told(tmp_path, part, near):
    told = warnings(tmp_path, [[1.0, 1.0], [1.0, 1.0 + 2 * part]])
    assert bool(told) == near
    assert not near or "near to rank 1 of 2" in told[0]
    assert not warnings(tmp_path, [[1.0, 0.0], [0.0, 1e-6]])  # a small unit is no loss


def test_a_least_force_that_is_never_reached_is_told(tmp_path):
    (told,) = warnings(tmp_path, [[1.0, -1.0]], "max_rate_per_s = 2.0\n[options]\nleast_force_N = 0.3\n")
    assert "from rest actuators 1, 2 can never make as much" in told  # 2 N/s for 0.1 s


def test_a_stuck_force_beyond_the_bounds_is_told(tmp_path):
    """What is stuck makes its force whatever the bounds; at a bound it is no surprise."""
    (told,) = warnings(tmp_path, [[1.0, -1.0, 0.5]], "[faults]\nstuck = [{ actuator = 2, force_N = 40.0 }]\n")
    assert told == "actuator 2 is stuck at 40, outside its own bounds, 0 to 1"
    assert not warnings(tmp_path, [[1.0, -1.0, 0.5]], "[faults]\nstuck = [{ actuator = 2, force_N = 1.0 }]\n")


def test_two_faults_of_one_actuator_are_refused(tmp_path):
    stuck = "stuck = [{ actuator = 2, force_N = 0.5 }"
    with pytest.raises(GncError, match="actuator 2 is both dead and stuck; keep one"):
        warnings(tmp_path, [[1.0, -1.0]], f"[faults]\ndead = [2]\n{stuck}]\n")
    with pytest.raises(GncError, match="actuator 2 is stuck twice; keep one"):
        warnings(tmp_path, [[1.0, -1.0]], f"[faults]\n{stuck}, {{ actuator = 2, force_N = 0.1 }}]\n")


@pytest.mark.parametrize(
    ("given", "shown", "finite"),
    [("inf", "is inf", "finite "), ("nan", "is nan", "finite "), ('"5"', "is '5'", ""), ("true", "is true", "")],
)
def test_a_number_or_a_list_is_asked_for_in_one_sentence(tmp_path, given, shown, finite):
    expected = f"line 7, matrices.max_rate_per_s: {shown}, expected a {finite}number or a list of such"
    with pytest.raises(GncError, match=f"{expected}; leave it out for none$"):
        warnings(tmp_path, [[1.0, -1.0]], f"max_rate_per_s = {given}\n")
