"""What the rows of a campaign hold, what they are summed up to, and what cannot be flown."""

from __future__ import annotations

import dataclasses
import json
import math
import shutil

import numpy as np
import pytest
from tumbling import RATES, detumble, flown, run, short

import casadi_gnc
from casadi_gnc.campaigns import DispersionTable
from casadi_gnc.campaigns.campaign import shard_size
from casadi_gnc.errors import CampaignError
from casadi_gnc.missions.parameters import vary
from casadi_gnc.missions.requirements import Requirement


def test_plans_and_seeds_give_other_cases_and_the_table_holds_what_was_flown():
    found = [flown(plan=plan, seed=seed) for plan, seed in (("sobol", 0), ("latin_hypercube", 0), ("sobol", 1))]
    columns = [one.column("initial.rate_rad_per_s.2") for one in found]
    assert all(np.abs(column).max() <= 0.05 for column in columns)
    assert not (columns[0] == columns[1]).any()
    assert not (columns[0] == columns[2]).any()
    assert found[0].table.num_rows == 100
    assert len(np.unique(found[0].column("noise_seed"))) == 100


def test_cases_that_no_craft_can_have_are_counted_and_not_redrawn():
    wild = DispersionTable(key="truth.inertia_factor", normal={"mean": 1.0, "deviation": 1.0})
    found = flown(dispersions=[wild, RATES])
    negative = found.column("truth.inertia_factor") <= 0
    assert 5 < negative.sum() < 40
    assert ((found.column("refused") != "") == negative).all()
    summary = found.summary()
    assert summary["refused"] == negative.sum()
    assert sum(summary["why"].values()) == negative.sum()
    assert np.isnan(found.column("metric.final_rate")[negative]).all()
    with pytest.raises(CampaignError, match="is refused: .*greater than 0|is refused"):
        found.case(int(np.flatnonzero(negative)[0])).fly()


def test_an_indefinite_inertia_is_refused():
    varied = vary(casadi_gnc.load("sun2018/circular_orbit"), ["spacecraft.inertia_kg_m2"])
    values = np.tile(varied.parameters.nominal, (8, 1))
    values[1:7] += np.diag([20.0, 20.0, 10.0, 20.0, 10.0, 10.0])  # one entry each, its mirror image with it
    values[7, 1] = 1e6  # off the diagonal
    told = varied.refusals(values)
    assert told[:7] == [""] * 7
    assert "positive definite" in told[7]


def test_a_start_beyond_what_sensors_tell_is_refused():
    found = flown(dispersions=[DispersionTable(key="initial.rate_rad_per_s", uniform=[5.0, 15.0])])
    fast = (np.abs(found.columns([f"initial.rate_rad_per_s.{i}" for i in (1, 2, 3)])) > 10.0).any(axis=1)
    assert ((found.column("refused") != "") == fast).all()
    assert any("beyond the largest credible" in why for why in found.column("refused"))


def test_requirements_of_many_flights_are_judged_by_their_share():
    mission = detumble()["mission"]
    asked = (
        Requirement("R-1", metric="final_rate", at_most=0.01, share=0.5, confidence=0.9),
        Requirement("R-2", formula="always(norm(rate) <= 0.04)", share=0.999),
    )
    found = flown(mission=dataclasses.replace(mission, requirements=asked))
    told = found.summary()["requirements"]
    margins = 0.01 - found.column("metric.final_rate")
    assert (found.column("requirement.R-1") == margins).all()
    assert told["R-1"]["met_by"] == (margins >= 0).sum()
    assert told["R-2"]["verdict"] == "not met"
    worst = found.case("failed:R-2")
    flight = worst.fly(decimation=1)
    norm = np.linalg.norm(flight["rate"], axis=1)
    assert worst.row["requirement.R-2"] == pytest.approx(0.04 - norm.max(), abs=1e-15)
    assert flight.verdicts["R-2"].robustness == worst.row["requirement.R-2"]


def test_the_summary_has_bounds_that_enclose_what_it_tells(tmp_path):
    summary = flown(flights=300).summary()
    final = summary["metrics"]["final_rate"]
    for one in final["percentiles"].values():
        assert one["low"] is None or one["low"] <= one["value"]
        assert one["high"] is None or one["value"] <= one["high"]
    assert final["drivers"][0]["key"].startswith("initial.rate_rad_per_s")
    assert math.isfinite(final["worst"][0]["value"])
    json.dumps(summary, allow_nan=False)


def test_chosen_cases_are_told_by_their_range_and_not_by_shares():
    found = flown(plan="one_at_a_time", flights=9)
    told = found.summary()
    assert not told["representative"]
    values = found.column("metric.final_rate")
    assert told["metrics"]["final_rate"]["range"] == [values.min(), values.max()]
    assert told["metrics"]["final_rate"]["percentiles"] == {}
    assert (told["requirements"], told["statuses"]) == ({}, {})


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"dispersions": []}, "nothing differs from case to case"),
        ({"dispersions": [DispersionTable(key="truth.inertia", uniform=[0, 1])]}, "did you mean"),
        ({"dispersions": [RATES, RATES]}, "given by two keys"),
        ({"dispersions": [DispersionTable(key="initial.mrp", choice={"values": [[1.0, 2.0]]})]}, "stands for 3"),
        ({"plan": "random"}, "no plan 'random'; there is independent"),
        ({"plan": "corners"}, "ask for those"),
        ({"flights": 0}, "expected 1 to"),
        ({"shard": (4, 3)}, "the shard is 4/3"),
        ({"seed": -1}, "the seed is -1"),
        (
            {"dispersions": [DispersionTable(key="truth.inertia_factor", uniform=[-2, -1])]},
            "the first 64 cases are all refused; case 0: inertia_factor is -",
        ),
    ],
)
def test_what_cannot_be_flown_is_told_in_one_sentence(change, told):
    with pytest.raises(casadi_gnc.GncError, match=told) as error:
        flown(**change)
    assert "\n" not in str(error.value)


def test_an_allocation_outside_the_c_is_refused():
    from casadi_gnc.allocation.in_flight import SolverInFlight

    scheme = casadi_gnc.load("huang2020/slew").scheme("funnel_robust")
    mission = short("huang2020/slew")
    outside = dataclasses.replace(scheme.actuation, allocator=SolverInFlight(scheme.actuation.allocator.problem))
    with pytest.raises(CampaignError, match="called from Python at every sample"):
        flown(mission=mission.with_scheme("funnel_robust", actuation=outside))


def test_shards_are_seconds_of_work_and_the_same_everywhere():
    assert shard_size(15001) == 2048
    assert shard_size(10**9) == 16
    assert shard_size(1) == 65536


@pytest.mark.slow
def test_the_command_flies_shows_and_flies_a_case_again(problem, tmp_path):
    out = tmp_path / "mc"
    first = run("campaign", problem, "--flights", 200, "--scheme", "observer_pinv", "--out", out)
    assert first.returncode == 0, first.stderr
    assert "tumbling, observer_pinv: 200 flights of 200 cases" in first.stdout
    assert "DTB-1: " in first.stdout
    shutil.move(problem, tmp_path / "gone.toml")  # the folder is enough
    shown = json.loads(run("campaign", "show", out, "--json").stdout)
    worst = shown["metrics"]["settling_time"]["worst"][0]
    flight = run("fly", out, "--case", "worst:settling_time", "--out", tmp_path / "worst", "--json")
    assert flight.returncode == 0, flight.stderr
    value = json.loads(flight.stdout)["schemes"][0]["metrics"]["settling_time"]["value"]
    assert value == worst["value"]
    assert (tmp_path / "worst/observer_pinv.png").stat().st_size > 1e4
    told = run("fly", out, "--case", "worst:nothing")
    assert (told.returncode, told.stdout) == (2, "")
    assert "no metric 'nothing'; there is settling_time" in told.stderr
    assert run("campaign", "show", tmp_path).returncode == 2
