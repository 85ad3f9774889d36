"""What varies as one vector in standard units, and a number of many flights at once."""

from __future__ import annotations

import math

import numpy as np
import pytest

import casadi_gnc
from casadi_gnc.campaigns import Choice, Correlated, DispersionTable, LogUniform, Normal, Uniform
from casadi_gnc.missions.requirements import Requirement
from casadi_gnc.tuning import Objective, Space

KEYS = ("n", "u.1", "u.2", "l", "c", "k.1", "k.2")
GIVEN = ("n", "u", "l", "c", "k")
LAWS = (
    Normal(2.0, 0.5, truncate=3.0),
    Uniform(-1.0, 3.0, size=2),
    LogUniform(1.0, 100.0),
    Choice(((1.0,), (5.0,), (7.0,)), weights=(1.0, 0.0, 3.0)),
    Correlated((1.0, -1.0), ((4.0, 2.0), (2.0, 2.0))),
)
NOMINAL = np.array([2.5, 1.0, 0.0, 10.0, 5.0, 3.0, 1.0])


def space():
    return Space(KEYS, GIVEN, LAWS, NOMINAL)


def test_coordinates_are_standard_units():
    there = space()
    point = [1.0, 0.5, -1.0, 0.5, 1.0, 1.0, -1.0]
    # L of the covariance is [[2, 0], [1, 1]] by hand.
    right = [2.5, 2.0, -1.0, 10.0**1.5, 7.0, 3.0, -1.0]
    assert there.rows(np.array([point]))[0] == pytest.approx(right, rel=1e-12)
    assert there.high.tolist() == [3.0, 1.0, 1.0, 1.0, 1.0, math.inf, math.inf]


def test_the_file_s_own_numbers_have_coordinates_and_a_nan_gives_them_back_word_for_word():
    there = space()
    # 2.5 = 2 + 0.5; 1 is the middle of -1 ... 3; sqrt(1 * 100) = 10; (3 - 1, 1 + 1) = L (1, 1).
    assert there.start == pytest.approx([1.0, 0.0, -0.5, 0.0, 0.0, 1.0, 1.0], abs=1e-12)
    assert there.rows(np.full((1, 7), math.nan)).tolist() == [NOMINAL.tolist()]
    half = np.array([[0.0, math.nan, 0.5, 0.0, 1.0, math.nan, 3.0]])
    assert there.rows(half)[0].tolist() == pytest.approx([2.0, 1.0, 2.0, 10.0, 7.0, 3.0, 1.0])


def test_distance_is_in_standard_deviations_of_each_law():
    there = space()
    moved = there.start.copy()
    moved[0] += 3.0
    moved[1] += 4.0 / math.sqrt(3.0)  # four deviations of a uniform number, past its end
    moved[4] = 1.0
    assert there.distance(moved)[0] == pytest.approx(5.0)
    assert there.distance(np.full((1, 7), math.nan))[0] == 0.0


def test_an_alternative_that_is_never_drawn_is_none():
    there = space()
    group = next(each for each in there.groups if each.discrete)
    found = there.alternatives(group)
    points = np.full((2, 7), math.nan)
    points[:, 4] = found
    assert there.rows(points)[:, 4].tolist() == [1.0, 7.0]


@pytest.mark.slow
def test_derivatives_are_what_differences_come_to():
    """A flight there and back against differences of flights, one coordinate left out and one at its end."""
    mission = casadi_gnc.load("huang2020/detumble").with_timing(duration=60.0)
    ends = [0.9, 1.1]
    varying = [
        DispersionTable(key="initial.rate_rad_per_s", normal={"mean": 0.4, "deviation": 0.05}),
        DispersionTable(key="truth.inertia_factor", uniform=ends),
        DispersionTable(key="scheme.observer_pinv.law.rate_gain", log_uniform=[0.1, 2.0]),
    ]
    asked = Requirement("SLOW", formula="eventually[50, 60](norm(rate) <= 0.05)")
    objective = Objective(mission, "observer_pinv", parameters=varying, what=asked)
    point = np.array([0.2, -0.5, math.nan, 1.0, 0.3])
    value, slope = objective.derivatives(point)
    assert value == pytest.approx(objective.values(point[None, :])[0], rel=1e-12)
    assert slope[2] == 0
    # Thrusters clip often in this flight: a step of 1e-3 meets decisions that turn.
    assert slope == pytest.approx(objective.gradient(point, 1e-6), rel=1e-4, abs=1e-7)
    soft, _ = objective.derivatives(point, temperature=1e-3)
    assert 0 <= soft - value <= 1e-3 * math.log(1e4)
