"""Missions that say what cannot be meant are told of it; shipped ones are not."""

import numpy as np
import pytest

import casadi_gnc
from casadi_gnc.checking import sense
from casadi_gnc.problem_files.document import read, shipped

MISSIONS = [name for name in shipped() if read(name).data["kind"] == "mission"]
WAVE = {"frequency_rad_per_s": 1.0, "amplitude_N_m": [1e-4, 0.0, 0.0]}


def told(changes, scheme="observer_pinv"):
    mission = casadi_gnc.load("huang2020/detumble", changes)
    return {each.name: each for each in sense.checks(mission, mission.scheme(scheme))}


@pytest.mark.parametrize("name", MISSIONS)
def test_shipped_missions_make_sense(name):
    mission = casadi_gnc.load(name, strict=False)
    assert [each.name for each in sense.checks(mission, mission.schemes[0])] == []


def test_windows_after_the_end_and_thresholds_out_of_reach():
    found = told({"metric.*.after_s": 0.0})
    assert found == {}
    (window,) = told({"metric.4.after_s": 1500.1}).values()
    assert (window.verdict, window.limit) == ("warn", pytest.approx(1500.0))
    (threshold,) = told({"metric.1.threshold": 1e30}).values()
    assert threshold.name.startswith("sense.threshold.")
    assert threshold.limit == casadi_gnc.load("huang2020/detumble").truth.measurement.signal("rate").limit


@pytest.mark.parametrize(
    ("frequency", "is_told"), [(1e-3, False), (1.0, False), (10.0, False), (31.4, True), (1e9, True)]
)
def test_pushes_faster_than_a_step(frequency, is_told):
    """A wave at w rad/s departs from the line between the ends of a step of h by 1 - cos(w h / 2) of its amplitude at
    most: 0.12 of it, 0.06 of its range, at 10 rad/s and 0.1 s, and all of its range at 31.4 rad/s."""
    found = told({"environment.harmonic": [{**WAVE, "frequency_rad_per_s": frequency}]})
    assert ("sense.push" in found) == is_told


def test_a_jump_is_no_fast_push():
    mission = casadi_gnc.load("huang2019/wheel_faults", strict=False)
    assert sense.unseen_push(mission) < 0.01
    assert np.isfinite(sense.unseen_push(casadi_gnc.load("shi2020/docking", strict=False)))
