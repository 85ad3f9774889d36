"""Weaknesses that were planted into a mission are found by its campaign, ranked first, and fly again."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import casadi_gnc as gnc
from casadi_gnc.campaigns import DispersionTable
from casadi_gnc.errors import LawError
from casadi_gnc.laws import REGISTRY


def found_first(campaign, metric, requirement, planted):
    """Assert that those that fail are the planted ones, ranked before all others, and that the worst flies again."""
    failed = campaign.column(f"requirement.{requirement}") < 0
    assert (failed == planted).all()
    count = int(failed.sum())
    assert set(campaign.ranked(metric)[:count].tolist()) == set(np.flatnonzero(failed).tolist())
    told = campaign.summary()["requirements"][requirement]
    assert (told["met_by"], told["verdict"]) == (len(failed) - count, "not met")
    worst = campaign.case(f"failed:{requirement}")
    assert worst.number in np.flatnonzero(failed)
    again = worst.fly()
    assert again.metrics[metric] == campaign.column(f"metric.{metric}")[worst.number]
    assert again.verdicts[requirement].word == "not met"


@pytest.mark.slow
def test_a_wheel_fault_that_turns_the_loop_around_in_one_of_two_hundred_cases():
    """With a large accuracy weight wheels oppose each other; a wheel below half its strength turns the torque around.

    Only the first wheel's fault of `wheel_faults` is left; at 0.6 of its strength the craft still settles.
    """
    sound = {f"fault.{i}.effectiveness": 1.0 for i in (2, 3, 4)}
    sound |= {f"fault.{i}.bias_rad_per_s2": 0.0 for i in (2, 4)}
    mission = gnc.load("huang2019/wheel_faults", sound).with_scheme("observers_robust").with_timing(duration=40.0)
    late = gnc.Metric("late_attitude", "peak", "mrp", after=25.0)
    asked = gnc.Requirement("ATT", metric="late_attitude", at_most=0.05)
    mission = dataclasses.replace(mission, metrics=(late,), requirements=(asked,))
    faults = {"values": [1.0, 0.8, 0.3], "weights": [0.5, 0.495, 0.005]}
    varying = [
        DispersionTable(key="fault.1.effectiveness", choice=faults),
        DispersionTable(key="initial.rate_rad_per_s", uniform=[-0.02, 0.02]),
    ]
    campaign = gnc.campaign(mission, 1000, dispersions=varying, engine="c", audit=1)
    planted = campaign.column("fault.1.effectiveness") == 0.3
    assert 0 < planted.sum() < 20  # five are expected
    found_first(campaign, "late_attitude", "ATT", planted)


def test_a_sampled_observer_past_its_limit():
    """The printed observer, sampled, takes its own ramp for a disturbance: past a gain its loop grows at each sample.

    The limit is where `check_hold`, from the eigenvalues of the sampled loop, first refuses the gain.
    """
    mission = gnc.load("shi2020/docking")
    own = mission.scheme("iobc").law
    law = REGISTRY.find("position_disturbance_observer")(
        body=own.body,
        controller_gain=own.controller_gain,
        observer_gain=100.0,
        approach_speed=own.approach_speed,
        hold=own.hold,
        printed=frozenset({"held_feed_through"}),
    )
    late = gnc.Metric("late_velocity", "peak", "velocity", after=20.0)
    asked = gnc.Requirement("VEL", metric="late_velocity", at_most=0.05, share=0.999)
    mission = mission.with_scheme("iobc", law=law).with_timing(duration=30.0)
    mission = dataclasses.replace(mission, metrics=(late,), requirements=(asked,))
    gains = {"values": [80.0, 100.0, 120.0, 700.0], "weights": [0.33, 0.33, 0.33, 0.01]}
    dataclasses.replace(law, observer_gain=120.0).check_hold()
    with pytest.raises(LawError, match="the sampled loop grows"):
        dataclasses.replace(law, observer_gain=700.0).check_hold()
    starts = [[float(x) * factor for x in mission.start[:3]] for factor in (0.98, 1.0, 1.02)]
    varying = [
        DispersionTable(key="scheme.iobc.law.observer_gain", choice=gains),
        DispersionTable(key="initial.position_m", choice={"values": starts}),
    ]
    campaign = gnc.campaign(mission, 400, dispersions=varying, engine="c", audit=1)
    planted = campaign.column("scheme.iobc.law.observer_gain") == 700.0
    assert 0 < planted.sum() < 20
    found_first(campaign, "late_velocity", "VEL", planted)
    (driver, *_) = campaign.summary()["metrics"]["late_velocity"]["drivers"]
    assert driver["first_order"]["value"] > 0.5
