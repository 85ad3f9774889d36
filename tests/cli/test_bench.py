"""`casadi-gnc bench`: what a user types, and what is said when it is wrong."""

import csv
import json
import os
import subprocess
import sys

import pytest

from casadi_gnc.benchmarks.summary import COLUMNS

pytestmark = pytest.mark.slow  # the functions behind the command have tests of their own

SMALL = (
    "plain/coils_4",
    "robust/thrusters_6_1cm",
    "--samples",
    "3",
    "--passes",
    "2",
    "--backends",
    "daqp,clarabel,pinv",
)


def bench(*arguments, **environment):
    return subprocess.run(
        [sys.executable, "-m", "casadi_gnc.cli.main", "bench", *map(str, arguments)],
        capture_output=True,
        text=True,
        env={**os.environ, "COLUMNS": "150", **environment},
    )


def assert_told(done, message):
    assert done.returncode == 2, (done.returncode, done.stderr)
    assert message in done.stderr
    assert "Traceback" not in done.stderr


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    out = tmp_path_factory.mktemp("bench") / "out"
    done = bench("allocation", *SMALL, "--out", out)
    assert done.returncode == 0, done.stderr
    return out, done.stdout


def test_a_run_writes_table_report_and_pictures(measured):
    out, told = measured
    names = {path.name for path in out.iterdir()}
    assert names >= {"results.jsonl", "summary.csv", "summary.json", "report.md", "plain.svg", "robust.svg", "logs"}
    assert "Allocation back ends: plain" in told
    assert "wrote to" in told
    with (out / "summary.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert tuple(rows[0]) == COLUMNS
    assert {row["contestant"] for row in rows if row["group"] == "plain"} == {"daqp", "clarabel", "pinv"}
    assert {row["contestant"] for row in rows if row["group"] == "robust"} == {"clarabel", "pinv"}
    daqp = next(row for row in rows if (row["contestant"], row["family"]) == ("daqp", "*"))
    assert float(daqp["success"]) == 1.0
    assert float(daqp["solver_us"]) < float(daqp["warm_us"])
    pinv = next(row for row in rows if (row["contestant"], row["family"]) == ("pinv", "*"))
    assert pinv["solver_us"] == ""  # it reports no time of its own
    report = (out / "report.md").read_text()
    for needed in (
        "governor",
        "load at the start",
        "## Known limitations",
        "shift 10 us",
        "not reported",
        "do not differ",
    ):
        assert needed in report or (needed == "do not differ" and "All differ" in report), needed
    assert "<svg" in (out / "plain.svg").read_text()


def test_json_is_the_only_output_and_nothing_is_measured_again(measured):
    out, _ = measured
    before = (out / "results.jsonl").read_bytes()
    done = bench("allocation", *SMALL, "--out", out, "--json")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["left_out"] == 0
    assert {one["contestant"] for one in found["ranking"]["plain"]} == {"daqp", "clarabel", "pinv"}
    assert (out / "results.jsonl").read_bytes() == before


def test_a_report_is_rebuilt_elsewhere(measured, tmp_path):
    out, _ = measured
    done = bench("report", out, "--out", tmp_path / "elsewhere")
    assert done.returncode == 0, done.stderr
    for name in ("report.md", "summary.csv", "plain.svg"):
        assert (tmp_path / "elsewhere" / name).read_bytes() == (out / name).read_bytes()


def test_corrupt_lines_are_named_and_the_rest_is_reported(measured, tmp_path):
    out, _ = measured
    copy = tmp_path / "copy"
    copy.mkdir()
    lines = (out / "results.jsonl").read_text().splitlines()
    lines.insert(2, "{oops")
    (copy / "results.jsonl").write_text("\n".join(lines) + "\n")
    done = bench("report", copy, "--json")
    assert done.returncode == 0
    assert "line 3 is not JSON" in done.stderr
    assert "the rest was kept" in done.stderr
    assert json.loads(done.stdout)["corrupt_lines"][0]["line"] == 3
    assert "**Line 3 of the results is not JSON" in (copy / "report.md").read_text()


def test_two_runs_are_compared(measured, tmp_path):
    out, _ = measured
    same = json.loads(bench("compare", out, out, "--json").stdout)
    for group in same:
        assert not group["swapped"]
        assert all(ratio["value"] == 1.0 for ratio in group["ratios"].values())
    # The same measurements, every pass as quick as the quickest, and again with every time of one contestant tripled.
    header, *cells = (out / "results.jsonl").read_text().splitlines()
    for name, factor in (("quiet", 1), ("slower", 3)):
        lines = [header]
        for cell in map(json.loads, cells):
            least = min(cell["seconds"]) * (factor if cell["contestant"] == "daqp" else 1)
            lines.append(json.dumps({**cell, "seconds": [least] * len(cell["seconds"])}))
        (tmp_path / name).mkdir()
        (tmp_path / name / "results.jsonl").write_text("\n".join(lines) + "\n")
    told = bench("compare", tmp_path / "quiet", tmp_path / "slower")
    assert told.returncode == 0
    line = next(line for line in told.stdout.splitlines() if line.strip().startswith("daqp"))
    assert line.endswith("slower")
    # The shift of 10 us keeps it a little below three.
    assert 2.5 < float(line.split(":")[1].split()[0]) <= 3.01


def test_settings_that_differ_are_not_compared(measured, tmp_path):
    out, _ = measured
    done = bench(
        "allocation", "plain/coils_4", "--samples", "2", "--passes", "1", "--backends", "daqp", "--out", tmp_path
    )
    assert done.returncode == 0, done.stderr
    assert_told(bench("compare", out, tmp_path), "the runs cannot be compared: samples is 3")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("allocation", "--backends", "nonsense"), "no allocation back end 'nonsense'"),
        (("allocation", "--backends", ","), "no back ends are named"),
        (("allocation", "nowhere"), "no problem file 'nowhere'"),
        (("allocation", "--time-limit", "-1"), "time_limit is -1.0"),
        (("allocation", "robust", "--backends", "daqp"), "no contestant can solve any of these"),
        (("allocation", "--out", "/dev/null/x"), "cannot write to the output folder"),
        (("synthesis", "plain"), "is a set for `bench allocation`"),
        (("step", "--engines", "turbo"), "no way turbo to run a step"),
        (("flight", "huang2020/nothing"), "no problem file"),
        (("report", "nowhere"), "no results in 'nowhere'"),
        (("compare", "nowhere", "nowhere"), "no results in 'nowhere'"),
    ],
)
def test_bad_input_is_told(arguments, message, tmp_path):
    out = () if arguments[0] in ("report", "compare") or "--out" in arguments else ("--out", tmp_path / "out")
    assert_told(bench(*arguments, *out), message)
    assert not (tmp_path / "out").exists()


def test_results_of_another_version_are_refused_and_left_alone(measured, tmp_path):
    out, _ = measured
    text = (out / "results.jsonl").read_text().replace('"format":1', '"format":99', 1)
    (tmp_path / "results.jsonl").write_text(text)
    assert_told(bench("allocation", *SMALL, "--out", tmp_path), "has results of format 99")
    assert_told(bench("report", tmp_path), "has results of format 99")
    assert (tmp_path / "results.jsonl").read_text() == text
