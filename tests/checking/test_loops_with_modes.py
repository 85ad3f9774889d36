"""What bends and sloshes is part of the linear loop: margins and stability are those of the law with the modes."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq

import casadi_gnc
from casadi_gnc.checking.broken_loops import scheme_margins
from casadi_gnc.checking.linear import HELD, loop_at, spectral_radius

pytestmark = pytest.mark.slow

H = 0.1


def slew(**changes):
    return casadi_gnc.load("satellites/flexible_slew", changes)


def of_one_axis(inertia, coupling, frequency, damping, gains, reads):
    """The discrete loop of J theta'' + d eta'' = u, eta'' + 2 z w eta' + w^2 eta = -d theta'', u held, by matrices."""
    w = 2 * np.pi * frequency
    mass = np.array([[inertia, coupling], [coupling, 1.0]])
    slope = np.zeros((4, 4))
    slope[:2, 2:] = np.eye(2)
    slope[2:] = np.linalg.solve(mass, [[0, 0, 0, 0], [0, -(w**2), 0, -2 * damping * w]])
    push = np.r_[0, 0, np.linalg.solve(mass, [1.0, 0.0])]
    moved = expm(H * np.block([[slope, push[:, None]], [np.zeros((1, 5))]]))
    A, B = moved[:4, :4], moved[:4, 4]
    C = np.array([gains[0] * reads, 0, gains[1], 0])
    return A, B, C


def test_the_margins_are_those_of_the_law_with_the_mode():
    """About x: the array's first mode takes a third of the inertia, its peak crosses one where the law is late."""
    mission = slew()
    law, craft = mission.schemes[0].law, mission.craft
    inertia = 1500.0 - sum(each.spin_inertia * each.axis[0] ** 2 for each in craft.wheel)
    A, B, C = of_one_axis(inertia, 22.0, 0.12, 0.005, (law.attitude_gain, law.rate_gain), 0.25)

    def L(w):
        return C @ np.linalg.solve(np.exp(1j * w * H) * np.eye(4) - A, B)

    grid = np.unique(np.r_[np.geomspace(1e-3, 31, 20_000), np.linspace(0.7, 1.1, 20_000)])
    above = [abs(L(w)) > 1 for w in grid]
    ends = [
        brentq(lambda w: abs(L(w)) - 1, a, b)
        for a, b, i, j in zip(grid, grid[1:], above, above[1:], strict=False)
        if i != j
    ]
    assert len(ends) == 3  # of the body with its arrays, and both sides of the peak
    phases = {w: np.angle(-L(w)) for w in ends}
    found = scheme_margins(mission, mission.schemes[0]).channels["torque 1"]
    expected = min(abs(phase) for phase in phases.values())
    assert found.phase == pytest.approx(expected, rel=1e-3)
    assert found.delay == pytest.approx(min((phase % (2 * np.pi)) / w for w, phase in phases.items()), rel=1e-3)


def test_a_command_that_is_late_shakes_the_arrays_and_check_says_so():
    """A second held and a second late, beside a delay margin of 0.84 s; arrays that do not bend bear ten."""
    slow = {"timing.sample_period_s": 1.0, "timing.plant_substeps": 16}
    stiff = {f"flexible_mode.{i}.rotation_kg05_m": [1e-9, 0.0, 0.0] for i in (1, 2, 3)}
    bending, clamped = slew(**slow), slew(**slow, **stiff)
    radius = [spectral_radius(loop_at(each, each.schemes[0], 0.0).delayed_moving) for each in (bending, clamped)]
    assert radius[0] > 1.0003
    assert radius[1] < 1
    found = {each.name: each for each in casadi_gnc.check(bending)}
    assert (found["sampling.closed_loop"].verdict, found["sampling.delay"].verdict) == ("ok", "note")
    assert found["sampling.bandwidth"].verdict == "note"


def test_the_bandwidth_is_told_against_the_slowest_swing_also_where_the_reference_moves(tmp_path):
    """A rate loop of P/J = 0.02 rad/s crosses one at 0.02 rad/s: a mode at 1 Hz, hardly coupled, is far above."""
    text = casadi_gnc.problem_files.read("satellites/slew_and_track").path.read_text(encoding="utf-8")
    mode = "[[flexible_mode]]\nfrequency_Hz = 1.0\ndamping = 0.01\nrotation_kg05_m = [0.01, 0.0, 0.0]\n\n"
    (tmp_path / "arrays.toml").write_text(text.replace("[[wheel]]", mode + "[[wheel]]", 1), encoding="utf-8")
    mission = casadi_gnc.load(tmp_path / "arrays.toml").with_scheme("mrp")
    found = {each.name: each for each in casadi_gnc.check(mission)}["sampling.bandwidth"]
    assert HELD in found.source
    assert found.verdict == "ok"
    assert found.limit == 1.0
    craft, law = mission.craft, mission.schemes[0].law
    free = np.diag(np.array(craft.inertia_kg_m2)) - sum(w.spin_inertia * np.square(w.axis) for w in craft.wheel)
    K, P, J = law.attitude_gain, law.rate_gain, free.min()
    # |K/4 + P s| = J w^2 at s = i w, sampled so fast that holding moves it by less than a percent.
    expected = np.sqrt((P**2 + np.sqrt(P**4 + 4 * (J * K / 4) ** 2)) / 2) / J
    assert 2 * np.pi * found.value == pytest.approx(expected, rel=0.02)
