"""A satellite whose reference moves: its linear loop is that of the reference held still, and is said to be."""

from __future__ import annotations

import numpy as np
import pytest

import casadi_gnc
from casadi_gnc.checking.broken_loops import scheme_margins
from casadi_gnc.checking.linear import HELD, held, target_state
from casadi_gnc.errors import FlightError


@pytest.fixture(scope="module")
def tracking():
    return casadi_gnc.load("satellites/slew_and_track").with_scheme("mrp")


def test_the_loop_of_rate_and_attitude_bears_the_gain_of_its_sampled_double_integrator(tracking):
    """M = [[1 - b/4, h/4 (1 - a/2)], [-8 b/(4 h), 1 - a]] with a = f h P/J has a pole at -1 where a = 2, whatever K.

    Of all axes the first to leave is that of the least inertia, wheels free: f = 2 J/(h P).
    """
    craft, law = tracking.craft, tracking.schemes[0].law
    free = np.array(craft.inertia_kg_m2)
    for wheel in craft.wheel:
        axis = np.array(wheel.axis) / np.linalg.norm(wheel.axis)
        free = free - wheel.spin_inertia * np.outer(axis, axis)
    expected = 2 * np.linalg.eigvalsh(free)[0] / (tracking.timing.sample_period * law.rate_gain)
    found = scheme_margins(tracking, tracking.schemes[0])
    assert found.effort_high == pytest.approx(expected, rel=2e-3)  # gravity's gradient and the bisection


def test_it_is_held_where_it_is_at_the_start_and_at_rest(tracking):
    """Nadir: z of the body, held, looks from the place at the start to the Earth's centre."""
    still, scheme = held(tracking, tracking.schemes[0])
    assert (still is tracking, scheme.name) == (False, "mrp")
    state = still.truth.state.split(target_state(still))
    s = np.array(state.mrp)
    cross = np.array([[0, -s[2], s[1]], [s[2], 0, -s[0]], [-s[1], s[0], 0]])
    dcm = np.eye(3) + (8 * cross @ cross - 4 * (1 - s @ s) * cross) / (1 + s @ s) ** 2
    down = -np.array(state.position) / np.linalg.norm(state.position)
    assert dcm @ down == pytest.approx([0, 0, 1], abs=1e-12)
    assert np.array(state.rate) == pytest.approx(0, abs=0)
    assert held(tracking, tracking.schemes[0])[0] is still


def test_check_says_what_it_looked_at(tracking):
    found = {each.name: each for each in casadi_gnc.check(tracking)}
    assert HELD in found["sampling.closed_loop"].source
    assert found["sampling.closed_loop"].verdict == "ok"
    stays = {each.name: each for each in casadi_gnc.check(casadi_gnc.load("satellites/slew"))}
    assert HELD not in stays["sampling.closed_loop"].source


def test_coils_alone_have_no_loop_to_cut():
    mission = casadi_gnc.load("satellites/detumble_bdot")
    with pytest.raises(FlightError, match="says no target"):
        scheme_margins(mission, mission.schemes[0])
