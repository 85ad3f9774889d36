"""A break that is told flies as a break, whatever found it; and what cannot be searched is one sentence."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

import casadi_gnc as gnc
from casadi_gnc.cli.main import app
from casadi_gnc.errors import CampaignError, GncError
from casadi_gnc.problem_files.document import read
from casadi_gnc.problem_files.rewriting import dumped

sys.path.insert(0, str(Path(__file__).parent))
from planted import PLANTED

ASKED = {"id": "P", "formula": "always(norm(rate) <= 1)"}
RATE = {"key": "initial.rate_rad_per_s", "uniform": [-0.1, 0.1]}


def written(file, requirement=ASKED, **tables):
    """Write a short de-tumbling with a requirement and further tables."""
    data = read("huang2020/detumble").data
    timing = {**data["timing"], "duration_s": 5.0}
    kept = [each for each in data["scheme"] if each["name"] == "damping_pinv"]
    file.write_text(dumped({**data, "timing": timing, "scheme": kept, "requirement": [requirement], **tables}))
    return file


@pytest.mark.parametrize(
    ("tables", "options", "told"),
    [
        ({}, {}, "nothing varies in m: it has no [[dispersion]], so there is nothing to search"),
        ({"dispersion": [RATE]}, {"requirement": "Q"}, "has no requirement 'Q'; there is P"),
        ({"dispersion": [RATE]}, {"within": "ball"}, "the set is 'ball'; expected one of contour, box, ellipsoid"),
        ({"dispersion": [RATE]}, {"radius": 0.0}, "reaches 0 standard deviations; expected above 0"),
        ({"dispersion": [RATE]}, {"flights": 0}, "0 flights are allowed; expected 1 or more"),
        (
            {"dispersion": [RATE]},
            {"over": {"timing.sample_period_s": [0.1] * 33}},
            "asks for 33 builds, expected at most 32",
        ),
        ({"dispersion": [RATE]}, {"over": {"timing.sample_periods": [0.1, 0.2]}}, "sample_periods"),
    ],
)
def test_what_cannot_be_searched_is_one_sentence(tmp_path, tables, options, told):
    file = written(tmp_path / "m.toml", **tables)
    with pytest.raises(GncError, match=r".") as raised:
        gnc.falsify(file, options.pop("requirement", "P"), **options)
    assert told in str(raised.value)
    assert "\n" not in str(raised.value)


def test_values_of_over_are_those_of_a_file(tmp_path):
    file = written(tmp_path / "m.toml", dispersion=[RATE])
    for bad in ("timing.sample_period_s", "timing.sample_period_s=", "timing.sample_period_s=0.1,,"):
        done = CliRunner().invoke(app, ["falsify", str(file), "--requirement", "P", "--over", bad])
        assert isinstance(done.exception, CampaignError)
        assert "expected KEY=VALUE,VALUE,..., values as in the file" in str(done.exception)
    twice = [word for value in ("0.1", "0.2") for word in ("--over", f"timing.sample_period_s={value}")]
    done = CliRunner().invoke(app, ["falsify", str(file), "--requirement", "P", *twice])
    assert "names 'timing.sample_period_s' twice" in str(done.exception)


@pytest.mark.slow  # the searches themselves are tested on formulas
def test_a_break_flies_as_a_break_and_what_is_printed_is_what_is_returned(tmp_path):
    """The rate can only grow from its start within a sample or two: it breaks at the start, of the largest axis.

    The norm of the rate is below 0.2 at all times if its start is; the start is (-0.1 ... 0.1)^3 with the largest
    norm 0.173, so 0.1 breaks, 0.2 does not.
    """
    file = written(tmp_path / "m.toml", {"id": "P", "formula": "always(norm(rate) <= 0.12)"}, dispersion=[RATE])
    data = read(file).data
    data["initial"]["rate_rad_per_s"] = [0.02, 0.0, 0.0]
    file.write_text("# kept\n" + dumped(data))
    out = tmp_path / "broken.toml"
    done = CliRunner().invoke(app, ["falsify", str(file), "--requirement", "P", "--out", str(out), "--json"])
    assert done.exit_code == 1
    told = json.loads(done.stdout)
    assert told["verdict"] == "broken"
    again = gnc.fly(out)
    assert again.verdicts["P"].word == "not met"
    assert again.verdicts["P"].robustness == told["broken"]["robustness"] < 0
    assert "# kept" in out.read_text()
    few = gnc.load(tmp_path / "broken.minimal.toml")
    assert gnc.fly(few).verdicts["P"].robustness == told["minimal"]["robustness"] < 0
    # On the way out along the file's own axis the wall is at 0.12, 0.1 away: past that axis' end at 0.1 another joins.
    assert float(again["rate"][0] @ again["rate"][0]) ** 0.5 == pytest.approx(0.12, rel=0.02)
    # The same search, from its journal: no flight, the same answer.
    found = gnc.falsify(file, "P", out=out)
    assert found.known == found.flights
    assert found.as_data() == told


@pytest.mark.slow
def test_a_requirement_that_is_broken_already_and_choices_alone(tmp_path):
    tight = written(tmp_path / "m.toml", {"id": "P", "formula": "always(norm(rate) <= 1e-4)"}, dispersion=[RATE])
    with pytest.raises(CampaignError, match="P is not met by the mission as it is: .*; there is no dispersion to look"):
        gnc.falsify(tight, "P")
    choice = {"key": "initial.rate_rad_per_s.1", "choice": {"values": [0.01, 0.02, 0.03]}}
    discrete = written(tmp_path / "d.toml", dispersion=[choice])
    found = gnc.falsify(discrete, "P")
    assert found.broken is None
    (note,) = found.notes
    assert note.startswith("every dispersion is a choice, so there is nothing to go down: ")
    assert note.endswith("combinations, all flown")
    assert "That is effort, not proof" in found.sentence


@pytest.mark.slow
@pytest.mark.parametrize(("name", "most"), [("wheel_fault", 3), ("funnel_below_noise", 60)])
def test_a_planted_failure_is_found_and_flies_as_one(tmp_path, name, most):
    """Of dispersed flights about one in two hundred meets the first, and one in a thousand the second."""
    planted = PLANTED[name]
    out = tmp_path / "broken.toml"
    found = gnc.falsify(planted.write(tmp_path / "m.toml"), "P", over=planted.over, flights=400, out=out)
    assert found.first <= most
    for file in (out, tmp_path / "broken.minimal.toml"):
        assert gnc.fly(file).verdicts["P"].word == "not met"
    cause = {"wheel_fault": "fault.1.effectiveness", "funnel_below_noise": "sensors.mrp_deviation"}[name]
    assert cause in [each.key for each in found.minimal.moved]
