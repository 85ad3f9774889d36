"""Satellites with hinged panels: the same words by every engine, panels that vary, what check says of them."""

from __future__ import annotations

import numpy as np
import pytest

import casadi_gnc
from casadi_gnc.campaigns.engines import CompiledBatch, best_vectors
from casadi_gnc.missions.parameters import vary

TEXT = """
format = 1
kind = "mission"
[spacecraft]
model = "satellite"
mass_kg = 300.0
inertia_kg_m2 = [[85.0, 2.0, -1.5], [2.0, 110.0, 1.0], [-1.5, 1.0, 64.0]]
[[wheel]]
axis = [1.0, 0.0, 0.0]
inertia_kg_m2 = 0.03
max_torque_N_m = 0.2
[[wheel]]
axis = [0.0, 1.0, 0.0]
inertia_kg_m2 = 0.03
max_torque_N_m = 0.2
[[wheel]]
axis = [0.0, 0.0, 1.0]
inertia_kg_m2 = 0.03
max_torque_N_m = 0.2
[[hinged_panel]]
mass_kg = 30.0
inertia_kg_m2 = [[12.0, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, 0.0, 14.0]]
hinge_m = [0.0, 0.7, 0.2]
axis = [1.0, 0.0, 0.0]
centre_m = [0.0, 2.2, 0.2]
stiffness_N_m_per_rad = 30.0
damping_N_m_s_per_rad = 0.2
angle_deg = 3.0
[initial]
euler_321_deg = [0.0, 0.0, 10.0]
[timing]
mode = "sampled"
sample_period_s = 0.1
duration_s = 20.0
[[scheme]]
name = "pd"
law = { type = "mrp_feedback", attitude_gain = 4.0, rate_gain = 18.0 }
[[metric]]
name = "swing"
kind = "peak"
signal = "panel_angle"
"""
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def mission(tmp_path_factory):
    path = tmp_path_factory.mktemp("panels") / "panels.toml"
    path.write_text(TEXT, encoding="utf-8")
    return casadi_gnc.load(path)


def test_the_c_and_the_virtual_machine_fly_the_same_words(mission):
    one, other = (casadi_gnc.fly(mission, engine=engine) for engine in ("c", "vm"))
    assert (one["panel_angle"] == other["panel_angle"]).all()
    assert (one["rate"] == other["rate"]).all()
    assert np.ptp(one["panel_angle"]) > np.radians(3)  # it swings through


def test_panels_vary_in_lanes_with_the_words_of_single_flights(mission):
    varied = vary(mission, ["hinged_panel.1.stiffness_N_m_per_rad", "hinged_panel.1.angle_deg"], None)
    values, seeds = varied.parameters.nominal * (1 + 0.1 * np.sin(np.arange(18.0)).reshape(9, 2)), np.arange(9)
    runs = [
        CompiledBatch(varied, vectors=kind, threads=1).fly(values, seeds.astype(np.uint64))
        for kind in ("none", best_vectors())
    ]
    assert (runs[0].words == runs[1].words).all()
    place = varied.tapes.tally.place("metric_swing")
    assert np.ptp(runs[0].tally[:, place]) > 1e-3


def test_check_weighs_the_frequency_of_a_panel_and_its_loop(mission):
    """k/(J_a + m d^2) = 30/(12 + 30 1.5^2): 0.097 Hz, below where the rate loop, P/J, crosses one."""
    found = {each.name: each for each in casadi_gnc.check(mission)}
    assert found["sampling.mode_frequency"].value == pytest.approx(np.sqrt(30 / (12 + 30 * 2.25)) / (2 * np.pi))
    assert found["sampling.bandwidth"].limit == found["sampling.mode_frequency"].value
    assert found["sampling.bandwidth"].verdict == "note"
    assert found["sampling.closed_loop"].verdict == "ok"
