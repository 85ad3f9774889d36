"""What a user gets wrong in a drag-free mission, and sweeps, on the command line."""

import json
import os
import subprocess
import sys

import pytest

from casadi_gnc.system import assets

pytestmark = pytest.mark.slow  # the functions behind the command have tests of their own

CASE = (assets.folder("problems") / "tao2019" / "case1.toml").read_text(encoding="utf-8")
SWEEP = """
[[sweep]]
name = "force"
key = "scheme.*.force_limit_N.*"
values = [10, 5]
show = "FUNNEL_LEFT"
"""


def run(*arguments: str) -> subprocess.CompletedProcess:
    command = [sys.executable, "-m", "casadi_gnc.cli.main", *arguments]
    environment = {**os.environ, "COLUMNS": "120"}
    return subprocess.run(command, capture_output=True, text=True, env=environment, timeout=300)


def fly(tmp_path, text: str, *options: str) -> subprocess.CompletedProcess:
    path = tmp_path / "case.toml"
    path.write_text(text, encoding="utf-8")
    return run("fly", str(path), "--out", str(tmp_path / "out"), *options)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "position_m = [0.03, -0.05, 0.03]",
            "position_m = [0.03, -0.56, 0.03]",
            "funnel[2].start: axis 2 starts at -0.56, outside its funnel from -0.55 to 0.55; widen start",
        ),
        (
            "floor = [0.001, 0.001, 0.001]",
            "floor = [0.001, 1.0, 0.001]",
            "axis 2: floor 1 is wider than start 0.9",
        ),
        (
            "mrp = [-0.3, 0.4, 0.3]",
            "mrp = [-0.8, 0.8, 0.3]",
            "initial.mrp: the MRPs have the length 1.17; expected less than 1",
        ),
        (
            "moment_box = [10.0, 30.0]",
            "moment_box = [19.0, 30.0]",
            "the believed inertia, element 1, starts at 18, outside its box [19, 30]; widen the box",
        ),
        (
            "mass_box = [10.0, 30.0]",
            "mass_box = [10.0, 15.0]",
            "the believed mass, element 1, starts at 18, outside its box [10, 15]; widen the box",
        ),
        (
            "product_box = 2.0",
            "product_box = 5.0",
            "allows a singular one: the least moment is 10 kg m^2, and two products together can be 10 kg m^2",
        ),
        ("filter_frequency = 15.0", "filter_frequency = 0.0", "law.filter_frequency: is 0.0, expected a number > 0"),
        (
            'mode = "continuous"\nsample_period_s = 5e-4\nduration_s = 100.0\nrecord_period_s = 0.01',
            'mode = "sampled"\nsample_period_s = 0.1\nduration_s = 100.0',
            "a sample period of 0.1 s is too long for filter_frequency 15 rad/s; use at most 0.0667 s",
        ),
        ("record_period_s = 0.01", "record_period_s = 7.7e-4", "record_period_s / sample_period_s is 1.54"),
        ("[[metric]]", SWEEP.replace("force_limit_N.*", "force.*") + "[[metric]]", "leads nowhere"),
        ("[[metric]]", SWEEP.replace("FUNNEL_LEFT", "left") + "[[metric]]", "show is 'left', expected one of"),
        ("[[metric]]", SWEEP.replace("5]", "-5]") + "[[metric]]", "with scheme.*.force_limit_N.* = -5.0: "),
    ],
)
def test_one_sentence_a_key_with_its_place(tmp_path, old, new, message):
    """Both schemes filter too fast; both have a limit for each of three axes."""
    assert old in CASE
    wrong_keys = 2 if "filter_frequency 15" in message else 6 if "with scheme.*" in message else 1
    done = fly(tmp_path, CASE.replace(old, new, 1))
    assert done.returncode == 2, (done.stdout, done.stderr)
    told = done.stderr.removeprefix("casadi-gnc: ").strip().splitlines()
    assert len(told) == len(set(told)) == wrong_keys
    assert all(message in line and line.startswith("case.toml, line") for line in told)


def test_a_sweep_is_a_table(tmp_path):
    """5 N cannot brake 0.5 m/s inside the funnel, in which about 7 N are needed; 10 N can."""
    short = CASE.replace("sample_period_s = 5e-4\nduration_s = 100.0", "sample_period_s = 1e-3\nduration_s = 3.0")
    done = fly(tmp_path, short.replace("[[metric]]", SWEEP + "[[metric]]", 1), "--scheme", "funnels")
    assert done.returncode == 0, done.stderr
    assert "funnel left [s]" in done.stdout
    rows = {row.split("│")[1].strip(): row.split("│")[2].strip() for row in done.stdout.splitlines() if "│" in row}
    assert rows["10.0"] == "never"
    assert 0.5 < float(rows["5.0"]) < 1.5
    (sweep,) = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert [entry["value"] for entry in sweep["values"]] == [10, 5]
    assert sweep["values"][0]["schemes"][0]["shown"] is None
    assert sweep["values"][1]["schemes"][0]["shown"] == float(rows["5.0"])
    assert sweep["values"][1]["schemes"][0]["scheme"] == "funnels"


def test_sampled_mode_warns_before_it_flies(tmp_path):
    short = CASE.replace("duration_s = 100.0", "duration_s = 0.05")
    done = fly(tmp_path, short, "--mode", "sampled", "--scheme", "funnels", "--engine", "vm")
    assert done.returncode == 0, done.stderr
    warned = done.stderr.strip().splitlines()
    assert len(warned) == 2
    assert "before the flight: Sampled every 0.0005 s the position is not stable in a funnel of 0.001 m" in warned[1]
    assert "sample every 1.57e-06 s" in warned[1]
    assert "funnels: note: Sampled every 0.0005 s" in done.stdout
