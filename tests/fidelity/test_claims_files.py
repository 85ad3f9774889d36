"""Verdicts are computed: a changed number changes them, and what fails is a row, not the end."""

import json
import re
import subprocess
import sys
from dataclasses import replace

import pytest

from casadi_gnc import fidelity
from casadi_gnc.errors import FlightError, ProblemError
from casadi_gnc.fidelity.claims import ClaimModel, read_claims
from casadi_gnc.fidelity.verdict import Answer, Verdict

HEAD = 'format = 1\nkind = "claims"\npaper = "a paper"\ndoi = "10.1/1"\n'
CUBE = """
[[claim]]
id = "cube"
text = "the largest cube"
where = "here"
printed = {printed}
tolerance = 0.01
computation = {{ name = "{name}" }}
"""


def run(*arguments: str) -> subprocess.CompletedProcess:
    return subprocess.run(
        [sys.executable, "-m", "casadi_gnc.cli.main", "reproduce", *arguments],
        capture_output=True,
        text=True,
        check=False,
    )


def written(folder, printed=5.16e-4, name="huang2020.attainable_cube", more="") -> str:
    path = folder / "claims.toml"
    path.write_text(HEAD + CUBE.format(printed=printed, name=name) + more)
    return str(path)


def claim(**changes) -> ClaimModel:
    plain = {"id": "a", "text": "t", "where": "w", "printed": 2.0, "computation": {"name": "huang2020.inertia_trace"}}
    return ClaimModel.model_validate({**plain, **changes})


@pytest.mark.parametrize(
    ("changes", "ours", "verdict"),
    [
        ({"tolerance": 0.1}, 2.1, Verdict.REPRODUCED),
        ({"tolerance": 0.1}, 2.3, Verdict.NOT_REPRODUCED),
        ({"tolerance": 0.1, "assumption": "x"}, 2.1, Verdict.UNDER_ASSUMPTION),
        ({"relation": "at_most"}, 1.0, Verdict.REPRODUCED),
        ({"relation": "at_most"}, 2.5, Verdict.NOT_REPRODUCED),
        ({"relation": "at_least"}, 2.5, Verdict.REPRODUCED),
        ({"relation": "at_least", "tolerance_absolute": 0.6}, 1.5, Verdict.REPRODUCED),
        ({}, None, Verdict.NOT_REPRODUCED),
        ({"relation": "at_most"}, float("nan"), Verdict.NOT_REPRODUCED),
    ],
)
def test_verdict_follows_from_the_numbers(changes, ours, verdict):
    assert Answer(claim(**changes), ours).verdict is verdict


def test_a_bound_makes_a_number_impossible_only_where_it_is_passed():
    low = Answer(claim(), 5.0, bound=3.0)
    assert low.verdict is Verdict.IMPOSSIBLE
    assert replace(low, bound=1.0).verdict is Verdict.NOT_REPRODUCED
    assert replace(low, claim=claim(bound_is="highest")).verdict is Verdict.NOT_REPRODUCED
    assert replace(low, claim=claim(bound_is="highest"), bound=1.0).verdict is Verdict.IMPOSSIBLE
    assert replace(low, failure="it broke").verdict is Verdict.FAILED


def test_a_changed_printed_number_flips_its_verdict(tmp_path):
    told = run(written(tmp_path), "--json")
    assert told.returncode == 0, told.stderr
    (row,) = json.loads(told.stdout)["papers"][0]["claims"]
    assert row["verdict"] == "reproduced"
    told = run(written(tmp_path, printed=6e-4), "--json")
    assert json.loads(told.stdout)["papers"][0]["claims"][0]["verdict"] == "not reproduced"


@pytest.mark.slow
def test_what_cannot_be_flown_is_a_row_and_the_rest_goes_on(tmp_path):
    broken = """
[[claim]]
id = "broken"
text = "a flight of nobody"
where = "nowhere"
printed = 1.0
flight = { problem = "huang2020/detumble", scheme = "nobody" }
metric = { kind = "peak", signal = "rate" }
"""
    told = run(written(tmp_path, more=broken), "--json")
    assert told.returncode == 1
    cube, nobody = json.loads(told.stdout)["papers"][0]["claims"]
    assert cube["verdict"] == "reproduced"
    assert nobody["verdict"] == "failed"
    assert "no scheme 'nobody'" in nobody["failure"]


@pytest.mark.slow
def test_a_computation_that_breaks_is_a_row(tmp_path):
    asked = 'computation = { name = "shi2020.slowest_pole", arguments = { mass_ratio = 1e308 } }'
    path = tmp_path / "claims.toml"
    path.write_text(HEAD + CUBE.format(printed=1.0, name="x").replace('computation = { name = "x" }', asked))
    told = run(str(path), "--json")
    assert told.returncode == 1
    (row,) = json.loads(told.stdout)["papers"][0]["claims"]
    assert row["verdict"] == "failed"
    assert row["failure"].startswith("cannot be computed of these arguments")


@pytest.mark.slow
def test_a_changed_problem_file_is_flown_again(tmp_path):
    """The cache knows a user's own problem file by its content."""
    from casadi_gnc.system import assets

    problem = tmp_path / "mine.toml"
    text = (assets.folder("problems") / "sun2018" / "circular_orbit.toml").read_text()
    text = text.replace("duration_s = 250.0", "duration_s = 0.02")
    claim = (
        HEAD
        + f"""
[[claim]]
id = "speed"
text = "the first speed"
where = "here"
printed = 1.0
flight = {{ problem = "{problem}", scheme = "tracking" }}
metric = {{ kind = "peak", signal = "velocity_error" }}
"""
    )
    (tmp_path / "claims.toml").write_text(claim)
    found = []
    for speed in (0.5, 4.0):
        problem.write_text(text.replace("velocity_error_m_per_s = [0.5,", f"velocity_error_m_per_s = [{speed},"))
        (answered,) = fidelity.answer(fidelity.read_claims(str(tmp_path / "claims.toml")), processes=1)
        found.append(answered.ours)
    assert found[0] == pytest.approx(0.5, rel=0.05)
    assert found[1] == pytest.approx(4.0, rel=0.05)


@pytest.mark.parametrize(
    "kept",
    [
        b"", b"half", b"\xff\xfe", b"[]", b"{}", b'{"values": {"value": "5"}}', b'{"values": {"value": true}}',
        b'{"values": {"value": 5.0}, "failure": "x"}',
    ],
)  # fmt: skip
def test_an_answer_of_another_form_is_none(kept, tmp_path):
    from casadi_gnc.fidelity import answering

    (tmp_path / "a.json").write_bytes(kept)
    assert answering._remembered(tmp_path / "a.json") is None


@pytest.mark.slow
@pytest.mark.parametrize("kept", [b"\xff\xfe", b'{"values": {"other": 5.0}}'])
def test_an_answer_that_is_not_as_it_was_kept_is_found_anew(kept, tmp_path, monkeypatch):
    monkeypatch.setenv("CASADI_GNC_CACHE", str(tmp_path))
    file = fidelity.read_claims(written(tmp_path))
    (first,) = fidelity.answer(file, processes=1)
    (place,) = (tmp_path / "claims").glob("*.json")
    right = place.read_bytes()
    place.write_bytes(b'{"values": {"value": 5.0}}')  # what is as we write it is believed
    assert fidelity.answer(file, processes=1)[0].ours == 5.0
    place.write_bytes(kept)
    assert fidelity.answer(file, processes=1)[0].ours == first.ours
    assert place.read_bytes() == right


@pytest.mark.parametrize("number", [float("nan"), float("inf"), -0.0, None])
def test_any_number_is_remembered(number, tmp_path):
    from casadi_gnc.fidelity import answering

    place = tmp_path / "cache" / "claims" / "a.json"
    answering._remember(place, {"values": {"value": number}})
    assert repr(answering._remembered(place)) == repr({"values": {"value": number}})
    assert {folder.stat().st_mode & 0o777 for folder in place.parents[:2]} == {0o700}


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["nobody2020"], "no paper 'nobody2020'; there is huang20"),
        (["{bad computation}"], "claim[1].computation.name: no computation 'huang2020.nothing'"),
        (["{bad metric}"], "claim[1]"),
    ],
)
def test_bad_input_is_one_sentence(arguments, sentence, tmp_path):
    if arguments == ["{bad computation}"]:
        arguments = [written(tmp_path, name="huang2020.nothing")]
    elif arguments == ["{bad metric}"]:
        path = tmp_path / "claims.toml"
        flight = 'flight = { problem = "huang2020/detumble", scheme = "damping_pinv" }\n'
        flight += 'metric = { kind = "most", signal = "rate" }'
        path.write_text(HEAD + CUBE.format(printed=1.0, name="x").replace('computation = { name = "x" }', flight))
        arguments = [str(path)]
    told = run(*arguments)
    assert (told.returncode, told.stdout) == (2, "")
    assert sentence in told.stderr
    assert "Traceback" not in told.stderr


def test_equal_flights_are_flown_once():
    from casadi_gnc.fidelity.answering import _questions

    claims = fidelity.read_claims("huang2020").claim
    flights = [question for question in _questions(claims) if question.kind == "flight"]
    asked = [claim.flight.model_dump_json() for claim in claims if claim.flight is not None]
    assert len(flights) == len(set(asked)) < len(asked)


@pytest.mark.parametrize("paper", sorted(fidelity.papers()))
def test_shipped_claims_are_many_and_name_what_exists(paper):
    """Twenty or more a paper; every flight names a shipped problem and one of its schemes."""
    import casadi_gnc

    claims = fidelity.read_claims(paper).claim
    assert len(claims) >= 20
    for problem, scheme in {(c.flight.problem, c.flight.scheme) for c in claims if c.flight is not None}:
        casadi_gnc.load(problem, strict=False).scheme(scheme)


def test_unknown_claims_file_names_what_there_is():
    with pytest.raises(ProblemError, match="no paper 'x'"):
        fidelity.read_claims("x")


FLOWN = """
[[claim]]
id = "{id}"
text = "a flight"
where = "here"
printed = 1.0
flight = {{ problem = "{problem}", scheme = "damping_pinv" }}
metric = {{ kind = "final", signal = "rate"{more} }}
"""


def test_problems_are_looked_for_beside_the_claims(tmp_path, monkeypatch):
    """What lies beside the file is meant, by its name or its file's, wherever the command is run."""
    from casadi_gnc.problem_files.document import read

    folder = tmp_path / "paper"
    folder.mkdir()
    (folder / "mine.toml").write_text(read("huang2020/detumble").text)
    text = "".join(FLOWN.format(id=f"c{k}", problem=name, more="") for k, name in enumerate(("mine", "mine.toml")))
    argument = FLOWN.format(id="shipped", problem="huang2020/detumble", more="")
    (folder / "claims.toml").write_text(HEAD + text + argument)
    monkeypatch.chdir(tmp_path)
    flights = [each.flight.problem for each in fidelity.read_claims("paper/claims.toml").claim]
    assert flights == [str(folder / "mine.toml")] * 2 + ["huang2020/detumble"]


@pytest.mark.parametrize(
    ("more", "message"),
    [
        (FLOWN.format(id="a", problem="p", more=', name = "b"'), r"line \d+, claim\[2\].metric.name: unknown key"),
        (FLOWN.format(id="a", problem="p", more=", after_s = -1"), r"metric.after_s: is -1, expected a number >= 0"),
        (FLOWN.format(id="a", problem="p", more=", threshold = 1.0"), "settling and reaching, and nothing else"),
    ],
)
def test_metrics_of_claims_are_those_of_missions_without_a_name(tmp_path, more, message):
    with pytest.raises(ProblemError, match=message):
        fidelity.read_claims(written(tmp_path, more=more))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("after_s = 07:32:00", "computation.arguments.after_s: is the date or time 07:32:00; no key takes one"),
        ('after_s = "x"', "computation.arguments.after_s: is 'x', expected a number"),
        ("", "computation.arguments.after_s: is missing"),
        ("after_s = 1.0, until_s = 2.0", "computation.arguments.until_s: unknown key"),
        ("after_s = inf", "computation.arguments.after_s: is inf, expected a finite number"),
    ],
)
def test_arguments_of_computations_are_checked_when_read(tmp_path, arguments, message):
    text = CUBE.format(printed=1.0, name="shi2020_docking.disturbance_error")
    path = tmp_path / "claims.toml"
    path.write_text(HEAD + text.replace(" }", f", arguments = {{ {arguments} }} }}"))
    with pytest.raises(ProblemError, match=r"claims.toml, line \d+, claim\[1\]") as caught:
        fidelity.read_claims(str(path))
    assert message in str(caught.value)


def test_a_condition_that_a_law_does_not_have_is_a_row(tmp_path):
    from casadi_gnc.fidelity.computations.sun2018 import condition

    with pytest.raises(FlightError, match=r"ProximityTracking has no condition 'nothing'; there is gains\."):
        condition("nothing")


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ("tolerance = 1e300", "tolerance is 1e+300, expected at most 1;"),
        ("tolerance = 1.01", "tolerance is 1.01, expected at most 1;"),
        ("tolerance_absolute = 1e300", "tolerance_absolute is 1e+300, expected at most 0.00055;"),
    ],
)
def test_a_tolerance_that_takes_any_answer_is_told(given, says, tmp_path):
    """Zero, and twice what is printed, are within it: the claim could not fail."""
    path = tmp_path / "claims.toml"
    text = HEAD + CUBE.format(printed=5.5e-4, name="huang2020.attainable_cube")
    path.write_text("\n".join(given if line.startswith("tolerance") else line for line in text.splitlines()))
    with pytest.raises(ProblemError, match=re.escape(says)) as told:
        read_claims(str(path))
    place = 1 + path.read_text().splitlines().index(given)
    assert f"claims.toml, line {place}" in str(told.value) or f"claims.toml:{place}" in str(told.value), told.value
