"""Requirements of a mission: read from its file, judged in its flights, told by `fly` and `check`."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

import casadi_gnc as gnc
from casadi_gnc.campaigns.engines import CompiledBatch
from casadi_gnc.cli.main import app
from casadi_gnc.errors import FlightError, ProblemError, RequirementError
from casadi_gnc.missions.one_build import fly_case
from casadi_gnc.missions.parameters import vary
from casadi_gnc.missions.tapes import tapes_of
from casadi_gnc.problem_files.document import locate

TABLES = """
[[requirement]]
id = "ACS-1"
text = "The craft comes to rest"
metric = "settling_time"
at_most = 600
share = 0.9973
confidence = 0.95

[[requirement]]
id = "ACS-2"
formula = "always[100, end](max(abs(rate)) <= 0.05)"

[[requirement]]
id = "ACS-3"
formula = "eventually[0, 200](held[5](norm(rate) <= 0.05))"

[[requirement]]
id = "ACS-4"
formula = "always(norm(rate) > 0.1 implies eventually[0, 60](norm(rate) <= 0.1))"
"""


def file(folder, tables=TABLES):
    path = folder / "mine.toml"
    path.write_text(locate("huang2020/detumble").read_text(encoding="utf-8") + tables)
    return path


def test_a_file_says_what_is_required(tmp_path):
    mission = gnc.load(file(tmp_path))
    assert [one.id for one in mission.requirements] == ["ACS-1", "ACS-2", "ACS-3", "ACS-4"]
    first = gnc.Requirement("ACS-1", "The craft comes to rest", "settling_time", 600.0, share=0.9973, confidence=0.95)
    assert mission.requirements[0] == first
    assert (mission.requirements[1].share, mission.requirements[1].confidence) == (1.0, 0.9)
    assert "required ACS-1: settling_time <= 600" in repr(mission)
    tighter = gnc.load(file(tmp_path), {"requirement.ACS-1.at_most": 500.0})
    assert tighter.requirements[0].at_most == 500
    assert tighter.digest != mission.digest


def test_what_is_required_is_part_of_the_digest_of_objects(detumble):
    bare = replace(detumble)
    asked = replace(detumble, requirements=[gnc.Requirement("R", metric="settling_time", at_most=1.0)])
    other = replace(detumble, requirements=[gnc.Requirement("R", metric="settling_time", at_most=2.0)])
    assert len({bare.digest, asked.digest, other.digest}) == 3


WRONG = {
    'id = "A"\nmetric = "setling_time"\nat_most = 1': (
        "requirement[1].metric: A bounds 'setling_time', which is no metric; did you mean 'settling_time'? There is settling_time"
    ),
    'id = "A"': "requirement[1]: A has neither: a metric with at_most or at_least, or a formula",
    'id = "A"\nmetric = "settling_time"\nformula = "always(time >= 0)"': "requirement[1]: A has both; keep one of them",
    'id = "A"\nmetric = "settling_time"': "requirement[1].metric: A bounds settling_time by nothing; give at_most or at_least",
    'id = "A"\nmetric = "settling_time"\nat_most = 1\nshare = 0': "requirement[1].share: is 0, expected a number > 0",
    'id = "A"\nmetric = "settling_time"\nat_most = 1\nshare = 1.5': "requirement[1].share: is 1.5, expected a number <= 1",
    'id = "A"\nmetric = "settling_time"\nat_most = 1\n[[requirement]]\nid = "A"\nmetric = "settling_time"\nat_most = 2': (
        "requirement[2].id: the id 'A' is given twice"
    ),
    'id = "A"\nformula = "always(norm(rat) <= 1)"': "there is no signal 'rat'; did you mean rate? (scheme damping_pinv)",
    'id = "A"\nformula = "always(norm(rate) <= )"': 'requirement[1].formula: A: at character 22 of the formula, after "always(norm(rate) <="',
    'id = "A"\nformula = "always[0.04, 0.06](norm(rate) <= 1)"': "no sample lies from 0.04 to 0.06 s; there is one every 0.1 s",
    'id = "A B"\nmetric = "settling_time"\nat_most = 1': "requirement[1].id: a requirement has the id 'A B', expected letters, digits, ., _ and -, the first a letter",
    'id = "A"\nmetrik = "settling_time"': "requirement[1].metrik: unknown key; did you mean metric?",
    'id = "A"\nformula = "always(observed_torque[1] <= 1)"': "there is no signal 'observed_torque'",
}


@pytest.mark.parametrize("table", WRONG)
def test_bad_tables_are_told_with_their_line(table, tmp_path):
    path = file(tmp_path, f"\n[[requirement]]\n{table}\n")
    with pytest.raises(ProblemError) as told:
        gnc.load(path)
    assert WRONG[table] in str(told.value)
    begins = len(locate("huang2020/detumble").read_text(encoding="utf-8").splitlines()) + 2
    line = int(str(told.value).split("line ")[1].split(",")[0])
    assert begins <= line <= begins + len(table.splitlines())


def test_objects_are_looked_at_too(detumble):
    asked = gnc.Requirement("A", metric="settling_time", at_most=1.0)
    with pytest.raises(RequirementError, match="the id 'A' is given to two requirements"):
        replace(detumble, requirements=[asked, asked])
    with pytest.raises(RequirementError, match="A bounds 'speed', which is no metric; there is settling_time, "):
        replace(detumble, requirements=[gnc.Requirement("A", metric="speed", at_most=1.0)])
    with pytest.raises(
        FlightError, match=r"a requirement is an object of type dict, expected .* casadi_gnc\.Requirement"
    ):
        replace(detumble, requirements=[{"id": "A"}])


@pytest.fixture(scope="module")
def mission(tmp_path_factory):
    return gnc.load(file(tmp_path_factory.mktemp("mission"))).with_timing(duration=300.0)


@pytest.mark.parametrize("scheme", ["damping_pinv", "observer_robust"])
def test_a_flight_has_the_verdict_of_its_record(mission, scheme):
    """By the definitions, over every sample, whatever is kept."""
    flight = gnc.fly(mission, scheme, decimation=1)
    rate = np.sqrt((flight["rate"] ** 2).sum(axis=1))
    largest, time = np.abs(flight["rate"]).max(axis=1), flight.time
    settled = [min(0.05 - rate[k - 50 : k + 1]) for k in range(50, 2001)]
    answers = [max(0.1 - rate[k], max(0.1 - rate[k : k + 601])) for k in range(len(rate))]
    expected = {
        "ACS-1": -math.inf,
        "ACS-2": min(0.05 - largest[time > 99.95]),
        "ACS-3": max(settled),
        "ACS-4": min(answers),
    }
    found = {name: verdict.robustness for name, verdict in flight.verdicts.items()}
    assert found == pytest.approx(expected, abs=1e-15)
    thin = gnc.fly(mission, scheme, decimation=11)
    assert thin.verdicts == flight.verdicts
    assert np.array_equal(thin.samples, flight.samples[::11])
    for one in mission.requirements:
        assert one.robustness(thin) == found[one.id]
        if one.formula:
            assert one.robustness(flight.signals) == found[one.id]


def test_engines_agree(mission):
    """With the C library's functions the virtual machine gives the same words; a formula needs no others."""
    short = mission.with_timing(duration=20.0)
    one = gnc.fly(short, "damping_pinv", maths="libm").verdicts
    assert gnc.fly(short, "damping_pinv", engine="vm").verdicts == one


def test_flights_that_are_judged_afterwards_are_recorded_in_pieces(mission, monkeypatch):
    whole = gnc.fly(mission, "damping_pinv", decimation=7)
    monkeypatch.setattr("casadi_gnc.missions.flying._CHUNK", 100)
    told = []
    pieces = gnc.fly(mission, "damping_pinv", decimation=7, progress=lambda done, total: told.append((done, total)))
    assert pieces.verdicts == whole.verdicts
    assert np.array_equal(pieces.samples, whole.samples)
    assert told[-1] == (3001, 3001)


def test_what_the_tally_holds_and_what_is_judged_afterwards(mission):
    watched = [watch.requirement.id for watch in tapes_of(mission, mission.scheme()).watches]
    assert watched == ["ACS-2", "ACS-3"]


def test_a_mission_without_requirements_has_the_tally_that_it_had(detumble):
    assert not any("requirement" in name for name in tapes_of(detumble, detumble.scheme()).tally.names)
    assert gnc.fly(detumble.with_timing(duration=1.0)).verdicts == {}


def test_a_flight_that_diverged_meets_nothing(detumble):
    """Half a minute between samples of a fast tumble: the integrator itself runs away, long after what is asked of."""
    asked = [
        gnc.Requirement("A", formula="always[0, 50](time <= 60)"),
        gnc.Requirement("B", metric="force_sample_sum", at_least=0),
    ]
    asked.append(gnc.Requirement("C", formula="always[0, 50](eventually[0, 50](time <= 200))"))
    flight = gnc.fly(
        replace(detumble.with_timing(sample_period=50.0, duration=5000.0), requirements=asked), "damping_pinv"
    )
    assert flight.diverged
    for one in asked:
        assert flight.verdicts[one.id].robustness == one.robustness(flight) == -math.inf


def test_margins_of_a_table_of_cases():
    asked = gnc.Requirement("A", metric="m", at_most=2.0, at_least=1.0)
    found = asked.margins({"m": [1.5, 2.5, 0.0, float("nan"), None]})
    assert found.tolist() == [0.5, -0.5, -1.0, -math.inf, -math.inf]
    assert gnc.Requirement("A", metric="m", at_least=1.0).margins({"m": np.array([1.0, math.inf])}).tolist() == [
        0,
        math.inf,
    ]
    with pytest.raises(RequirementError, match="A bounds 'm', which is no metric; there is other"):
        asked.margins({"other": [1.0]})


def test_fly_tells_the_verdicts(tmp_path):
    path = file(tmp_path)
    done = CliRunner().invoke(app, ["fly", str(path), "--scheme", "damping_pinv", "--out", str(tmp_path / "out")])
    assert done.exit_code == 0, done.output
    flat = " ".join(done.output.split())
    assert "ACS-1: The craft comes to rest (settling_time <= 600)" in flat
    assert "│ ACS-1 │ not met -inf │" in flat
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())["schemes"][0]["requirements"]
    assert [one["id"] for one in summary] == ["ACS-1", "ACS-2", "ACS-3", "ACS-4"]
    assert summary[0] == {
        "id": "ACS-1",
        "text": "The craft comes to rest",
        "asked": "settling_time <= 600",
        "robustness": "-inf",
        "unit": "s",
        "verdict": "not met",
    }
    flight = gnc.fly(path, "damping_pinv")
    assert summary[1]["robustness"] == flight.verdicts["ACS-2"].robustness
    assert summary[1]["unit"] == "rad/s"
    assert "ACS-2" in flight._repr_html_()


def found(mission, *asked, scheme=None):
    checks = gnc.check(replace(mission, requirements=asked), scheme)
    return {one.name.split(".")[1]: one for one in checks if one.name.startswith("requirement.")}


@pytest.mark.slow
def test_check_says_what_the_start_decides(detumble):
    start = np.array(detumble.start)[detumble.truth.state.place("rate")]
    norm = float(np.linalg.norm(start))
    cases = {
        "always(norm(rate) <= 0.01)": 0.01 - norm,
        "always[0, 10](norm(rate) <= 0.01 and wanted[1] <= 1)": 0.01 - norm,
        "not eventually(norm(rate) > 0.01)": 0.01 - norm,
        "norm(rate) <= 0.01 until norm(rate) <= 0.001": 0.01 - norm,
        "norm(rate) <= 0.01 and always(time >= 0)": 0.01 - norm,
        "always(held[10](time >= 0))": -math.inf,
        "eventually[2000, end](time >= 0)": -math.inf,
        "always(norm(rate) <= 1e3)": 1e3 - norm,
    }
    for text, most in cases.items():
        check = found(detumble, gnc.Requirement("A", formula=text), scheme="damping_pinv")["start"]
        assert check.value == pytest.approx(most, abs=1e-15), text
        assert check.verdict == ("fail" if most < 0 else "ok"), text
        short = replace(
            detumble.with_timing(duration=50.0), metrics=(), requirements=[gnc.Requirement("A", formula=text)]
        )
        if most < 0:  # what cannot be met is not
            assert gnc.fly(short, "damping_pinv").verdicts["A"].robustness <= most + 1e-15, text


def test_check_does_not_say_more_than_is_known(detumble):
    for text in (
        "always[10, end](norm(rate) <= 0.01)",
        "eventually(norm(rate) <= 0.01)",
        "always(norm(wanted) <= 0.01)",
        "norm(wanted) <= 1e3 until norm(rate) <= 0.001",
        "always(norm(rate) <= 0.01 or norm(force) >= 0)",
        "eventually(held[10](norm(rate) <= 0.01))",
    ):
        assert "start" not in found(detumble, gnc.Requirement("A", formula=text), scheme="damping_pinv"), text


def test_check_says_where_intervals_hold_nothing(detumble):
    for text in ("always[2000, 2100](norm(rate) <= 0)", "eventually(norm(rate) >= 0)", "always(eventually[2000, 2001](norm(rate) < 0)) or norm(rate) > 0 until[0] time >= 0"):  # fmt: skip
        assert found(detumble, gnc.Requirement("A", formula=text), scheme="damping_pinv")["content"].verdict == "warn"
    asked = gnc.Requirement("A", formula="always[0, 1400](norm(rate) > 1 implies eventually[0, 200](norm(rate) <= 1))")
    check = found(detumble, asked, scheme="damping_pinv")["interval"]
    assert (check.value, check.limit, check.verdict) == (pytest.approx(1600), pytest.approx(1500), "warn")


def test_check_of_bounds_on_metrics(detumble):
    rate = float(np.abs(np.array(detumble.start)[detumble.truth.state.place("rate")]).max())
    peak, late = gnc.Metric("peak_rate", "peak", "rate"), gnc.Metric("late", "peak", "rate", after=1600.0)
    settling = gnc.Metric("settling", "settling", "rate", threshold=0.002)
    mission = replace(detumble, metrics=(peak, late, settling))

    def one(scheme="damping_pinv", **asked):
        return found(mission, gnc.Requirement("A", **asked), scheme=scheme)

    start = one(metric="peak_rate", at_most=0.01)["start"]
    assert (start.value, start.limit, start.verdict) == (rate, 0.01, "fail")
    assert one(metric="peak_rate", at_most=1e3)["start"].verdict == "ok"
    assert one(metric="late", at_most=1.0)["window"].verdict == "fail"
    assert one(metric="settling", at_most=600.0)["length"].verdict == "ok"
    assert one(metric="settling", at_most=1500.0)["length"].verdict == "warn"
    assert one(metric="settling", at_least=1600.0)["window"].verdict == "fail"


def test_check_compares_funnels_with_bounds():
    slew = gnc.load("huang2020/slew")
    steady = gnc.Metric("final_attitude", "final", "mrp", norm="two")
    bounds = slew.funnels[0].bounds
    share = np.maximum(np.array(bounds.below), np.array(bounds.above)).ravel()
    floor = np.array(bounds.floor).ravel() * share
    for share, verdict in ((0.99, "note"), (1.01, "ok")):
        bound = share * float(np.linalg.norm(floor))
        mission = replace(slew, metrics=(steady,))
        check = found(mission, gnc.Requirement("A", metric="final_attitude", at_most=bound), scheme="funnel_pinv")[
            "floor"
        ]
        assert check.verdict == verdict


def test_check_prints_them(tmp_path):
    path = file(tmp_path, '\n[[requirement]]\nid = "A"\nformula = "always(norm(rate) <= 0.01)"\n')
    done = CliRunner().invoke(
        app, ["check", str(path), "--scheme", "damping_pinv", "--figures", str(tmp_path), "--format", "svg"]
    )
    assert done.exit_code == 1
    assert "fail: requirement.start.A (damping_pinv): No flight can meet the requirement" in done.output


def test_a_batch_has_the_verdicts_of_its_flights(mission):
    """Requirements in the tally need no record: what a batch of dispersed cases says is what each flight says."""
    asked = [
        *mission.requirements[1:3],
        gnc.Requirement("A", formula="norm(rate) >= 0.05 until[0, 250] norm(rate) <= 0.2"),
    ]
    asked += [
        gnc.Requirement("B", formula="always[20](not raised(COMMAND_LIMITED)) or always[10, 20](norm(mrp) < 0.5)")
    ]
    short = replace(mission.with_timing(duration=250.0), requirements=asked)
    varied = vary(short, ["initial.rate_rad_per_s"], "damping_pinv")
    values = np.random.default_rng(3).uniform(-0.2, 0.2, (9, 3))
    seeds = np.arange(9, dtype=np.uint64)
    flown = CompiledBatch(varied, threads=1).fly(values, seeds)
    assert [watch.requirement.id for watch in varied.tapes.watches] == ["ACS-2", "ACS-3", "A", "B"]
    for watch in varied.tapes.watches:
        robustness = watch.read(flown.tally[:, varied.tapes.tally.place(watch.name)])
        alone = [fly_case(varied, row, 0).verdicts[watch.requirement.id].robustness for row in values[:3]]
        assert robustness[:3].tolist() == alone
        assert len(set(robustness.tolist())) > 1, watch.requirement
