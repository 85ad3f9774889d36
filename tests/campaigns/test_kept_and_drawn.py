"""What a campaign keeps beside its rows, how others read them, plans by name, and its pictures."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest

import casadi_gnc
from casadi_gnc.campaigns import DispersionTable
from casadi_gnc.campaigns.campaign import campaign
from casadi_gnc.campaigns.keeping import Keep
from casadi_gnc.errors import CampaignError
from casadi_gnc.missions.requirements import Requirement
from casadi_gnc.reports.campaign_gallery import draw_campaign

INERTIA = DispersionTable(key="truth.inertia_factor", normal={"mean": 1.0, "deviation": 0.03, "truncate": 3.0})
RATES = DispersionTable(key="initial.rate_rad_per_s", uniform=[-0.05, 0.05])
ATTITUDE = DispersionTable(key="initial.mrp", rotation={"deviation_rad": 0.3})


def mission(*requirements, samples=200):
    found = casadi_gnc.load("huang2020/detumble").with_scheme("observer_pinv")
    found = found.with_timing(duration=samples * found.timing.sample_period)
    asked = (casadi_gnc.Metric("final_rate", "final", "rate"), casadi_gnc.Metric("used", "sample_sum", "wanted"))
    return dataclasses.replace(found, metrics=asked, requirements=requirements)


SLOW = Requirement("R-1", metric="final_rate", at_most=0.02, share=0.5)
CALM = Requirement("R-2", formula="always(norm(rate) > 0.03 implies eventually[0, 6](norm(rate) <= 0.03))", share=0.5)
CALMED = Requirement("R-3", formula="always(norm(rate) <= 0.06 or eventually(norm(rate) <= 0.03))")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("campaign")


@pytest.fixture(scope="module")
def found(folder):
    asked = mission(SLOW, CALM, CALMED)
    return campaign(asked, 120, dispersions=[INERTIA, RATES], out=folder, keep=Keep.of("worst:3, failed:4, random:2"))


def test_requirements_that_look_ahead_inside_others_are_judged_from_whole_records(found):
    """Inner intervals with an end and without; truth is the record of a single flight, evaluated as such."""
    for case in (0, 17, 63, 119):
        flight = found.case(case).fly(decimation=1)
        for one in (CALM, CALMED):
            assert found.column(f"requirement.{one.id}")[case] == one.robustness(flight.signals)
    margins = found.column("requirement.R-2")
    assert 0 < (margins < 0).sum() < 120
    told = found.summary()["requirements"]
    assert told["R-2"]["met_by"] == (margins >= 0).sum()
    assert told["R-3"]["verdict"] == ("undecided" if (found.column("requirement.R-3") >= 0).all() else "not met")


def test_cases_that_fail_are_found_by_their_order(found):
    bad = np.zeros(120, dtype=bool)
    for i in (1, 2, 3):
        bad |= found.column(f"requirement.R-{i}") < 0
    numbers = np.flatnonzero(bad)
    assert [found.case(f"failed:{k}").number for k in (1, 2, len(numbers))] == [numbers[0], numbers[1], numbers[-1]]
    with pytest.raises(CampaignError, match=f"no case failed:{len(numbers) + 1}; {len(numbers)} flights fail"):
        found.case(f"failed:{len(numbers) + 1}")


def test_records_are_kept_of_the_worst_the_failed_and_some_at_random(found, folder):
    told = json.loads((folder / "kept" / "kept.json").read_text())
    assert told["keep"] == {"worst": 3, "failed": 4, "random": 2}
    reasons = {int(case): why for case, why in told["cases"].items()}
    assert {path.name for path in (folder / "kept").glob("*.npz")} == {f"case-{case}.npz" for case in reasons}
    for metric in ("final_rate", "used"):
        values = found.column(f"metric.{metric}")
        worst = set(np.argsort(-values)[:3].tolist())
        assert worst == {case for case, why in reasons.items() if f"worst:{metric}" in why}
    margins = found.column("requirement.R-2")
    failed = {case for case in np.argsort(margins, kind="stable")[:4].tolist() if margins[case] < 0}
    assert failed == {case for case, why in reasons.items() if "failed:R-2" in why}
    assert sum("random" in why for why in reasons.values()) == 2
    for case in reasons:
        flight = found.case(case).fly()
        with np.load(folder / "kept" / f"case-{case}.npz") as record:
            for name in flight:
                assert (record[name] == flight[name]).all()


def test_what_is_kept_follows_what_is_asked(found, folder):
    before = (folder / "kept" / "kept.json").read_text()
    try:
        campaign(mission(SLOW, CALM, CALMED), 120, dispersions=[INERTIA, RATES], out=folder, keep=Keep.of("worst:1"))
        left = json.loads((folder / "kept" / "kept.json").read_text())["cases"]
        assert len(list((folder / "kept").glob("*.npz"))) == len(left) <= 2
    finally:
        campaign(
            mission(SLOW, CALM, CALMED), 120, dispersions=[INERTIA, RATES], out=folder,
            keep=Keep.of("worst:3,failed:4,random:2"),
        )  # fmt: skip
    assert (folder / "kept" / "kept.json").read_text() == before


@pytest.mark.parametrize("text", ["", "worst", "worst:x", "best:3", "worst:3,worst:4", "worst:-1", "worst:3;failed:1"])
def test_what_cannot_be_kept_is_told(text):
    with pytest.raises(CampaignError, match="expected how many of worst, failed, random, each once"):
        Keep.of(text)


@pytest.mark.packages("duckdb")
def test_duckdb_reads_the_folder_in_place(found, folder):
    import duckdb

    (told,) = duckdb.sql(
        f"""SELECT count(*), max("metric.final_rate"), arg_max("case", "metric.final_rate"),
        sum(CASE WHEN "requirement.R-1" >= 0 THEN 1 ELSE 0 END) FROM '{folder}/*.parquet' WHERE refused = ''"""
    ).fetchall()
    values = found.column("metric.final_rate")
    met = int((found.column("requirement.R-1") >= 0).sum())
    assert told == (120, values.max(), int(np.argmax(values)), met)


def test_pick_freeze_by_name_tells_what_drives_a_metric():
    """The final rate follows the initial ones and hardly the inertia; an attitude counts as one input."""
    found = campaign(mission(), 7 * 64, dispersions=[INERTIA, RATES, ATTITUDE], plan="pick_freeze")
    told = found.summary()["metrics"]["final_rate"]["sensitivity"]
    assert {each["key"] for each in told} == {
        "truth.inertia_factor",
        "initial.rate_rad_per_s.1",
        "initial.rate_rad_per_s.2",
        "initial.rate_rad_per_s.3",
        "initial.mrp",
    }
    totals = {each["key"]: each["total"]["value"] for each in told}
    assert told[0]["key"].startswith("initial.rate_rad_per_s")
    assert totals["truth.inertia_factor"] < 0.2 < sum(totals.values())
    from casadi_gnc.campaigns.statistics import indices

    straight = indices(found.column("metric.final_rate"), 5)
    assert totals["truth.inertia_factor"] == straight.total[0].value


def test_importance_by_name_weighs_what_it_prefers():
    """A share that is known in closed form: the distance of normal numbers from their mean along a direction."""
    rates = DispersionTable(key="initial.rate_rad_per_s", normal={"mean": 0.0, "deviation": 0.02})
    plan = "importance:3:initial.rate_rad_per_s.1,initial.rate_rad_per_s.2=-1"
    found = campaign(mission(samples=20), 1000, dispersions=[rates, INERTIA], plan=plan)
    x, y = (found.column(f"initial.rate_rad_per_s.{i}") for i in (1, 2))
    beyond = (x - y) / np.sqrt(2) > 3 * 0.02
    from casadi_gnc.campaigns.statistics import weighted_share

    share = weighted_share(beyond, found.column("weight"), 0.99)
    assert beyond.sum() > 300  # of independent cases one or two would be
    assert share.low < 0.0013498980316300946 < share.high
    assert found.summary()["weighted"]
    with pytest.raises(CampaignError, match="no direction: it is a rotation"):
        campaign(mission(), 8, dispersions=[ATTITUDE], plan="importance:3:initial.mrp")


@pytest.mark.parametrize(
    ("plan", "told"),
    [
        ("importance", "expected importance:SHIFT:KEY=PART"),
        ("importance:far:truth.inertia_factor", "expected importance:SHIFT:KEY=PART"),
        ("importance:3:truth.inertia", "'truth.inertia' does not vary; did you mean 'truth.inertia_factor'. There is"),
        ("importance:3:truth.inertia_factor=x", "expected KEY or KEY=NUMBER"),
        ("importance:9:truth.inertia_factor", "a shift by 9 deviations"),
        ("importance:3:truth.inertia_factor=0", "expected a vector, not zero"),
        ("pick_freeze", "expected a multiple, such as 96 or 102"),
    ],
)
def test_plans_that_cannot_be_made_are_told(plan, told):
    with pytest.raises(CampaignError, match=told):
        campaign(mission(), 100, dispersions=[INERTIA, RATES], plan=plan)


def test_pictures_of_all_that_a_campaign_says(found, tmp_path):
    drawn = draw_campaign(found, tmp_path)
    of_metrics = [f"{name}_{what}.png" for name in ("final_rate", "used")
                  for what in ("histogram", "convergence", "scatter", "correlations", "sensitivity")]  # fmt: skip
    assert {path.name for path in drawn} == {*of_metrics, *(f"R-{i}_convergence.png" for i in (1, 2, 3))}
    assert all(path.stat().st_size > 5000 for path in drawn)


@pytest.mark.slow
def test_pictures_of_chosen_and_of_weighted_cases(tmp_path):
    chosen = campaign(mission(SLOW, samples=20), 9, dispersions=[INERTIA, RATES], plan="one_at_a_time")
    names = {path.name for path in draw_campaign(chosen, tmp_path / "chosen", ending="svg")}
    assert names == {f"{name}_{what}.svg" for name in ("final_rate", "used") for what in ("histogram", "scatter")}
    plan = "importance:2:initial.rate_rad_per_s"
    weighted = campaign(mission(SLOW, samples=20), 64, dispersions=[INERTIA, RATES], plan=plan)
    assert "R-1_convergence.svg" in {path.name for path in draw_campaign(weighted, tmp_path / "weighted", ending="svg")}
