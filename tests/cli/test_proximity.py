"""Proximity missions at the command line: what a flight's summary says, and bad input."""

import json
import os
import subprocess
import sys

import pytest

from casadi_gnc.problem_files.document import read

pytestmark = pytest.mark.slow  # the functions behind the command have tests of their own

PRINTED = read("sun2018/as_printed").text
LOW = read("sun2018/circular_orbit").text


def run(*arguments: str) -> subprocess.CompletedProcess:
    command = [sys.executable, "-m", "casadi_gnc.cli.main", *arguments]
    return subprocess.run(command, capture_output=True, text=True, env={**os.environ, "COLUMNS": "120"}, timeout=300)


def test_summary_says_how_near_the_chaser_came(tmp_path):
    path = tmp_path / "short.toml"
    path.write_text(PRINTED.replace("duration_s = 250.0", "duration_s = 50.0"), encoding="utf-8")
    done = run("fly", str(path), "--scheme", "tracking", "--out", str(tmp_path / "out"))
    assert done.returncode == 0, done.stderr
    text = " ".join(done.stdout.split())
    assert "first at 30.59 s: The craft was inside the keep-out sphere of its target." in text
    assert (
        "note: The target is on no orbit but on a hyperbola: eccentricity 46.56 and perigee radius 1.11039e+06 km."
        in text
    )
    assert "2.51" in text
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())["schemes"][0]
    assert summary["metrics"]["closest_to_centre"]["value"] == pytest.approx(2.51, abs=0.01)
    assert "KEEP_OUT_ENTERED" in {entry["status"] for entry in summary["statuses"]}
    assert any("eccentricity 46.56" in note for note in summary["notes"])


@pytest.mark.parametrize(
    ("right", "wrong", "message"),
    [
        (
            "mass_kg = 58.2\ninertia_kg_m2 = [[598.3,",
            "mass_kg = 58.2\ninertia_kg_m2 = [[-598.3,",
            "not positive definite",
        ),
        ("keep_out_radius_m = 4.0", "keep_out_radius_m = 8.0", "inside the keep-out sphere of 8 m; move the point out"),
        ("attitude_deviation = 1e-4", "attitude_deviation = -1e-4", "is -0.0001, expected a number >= 0"),
        ("-6016.869676500585] # circular", "0.0]", "eccentricity 0.87"),
    ],
    ids=["inertia", "hold point", "noise", "orbit"],
)
def test_bad_input_is_told_in_one_line(right, wrong, message, tmp_path):
    assert LOW.count(right) == 1
    path = tmp_path / "bad.toml"
    path.write_text(LOW.replace(right, wrong), encoding="utf-8")
    done = run("fly", str(path), "--out", str(tmp_path / "out"))
    assert done.returncode == 2, done.stdout
    assert message in done.stderr
    assert "bad.toml, line" in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
    assert not (tmp_path / "out").exists()


def test_an_orbit_that_hits_the_earth_is_a_warning_where_it_need_not_be_circular(tmp_path):
    path = tmp_path / "falling.toml"
    text = LOW.replace("circular = true\n", "").replace("-6016.869676500585]", "0.0]")
    path.write_text(text.replace("duration_s = 250.0", "duration_s = 1.0"), encoding="utf-8")
    done = run("fly", str(path), "--out", str(tmp_path / "out"))
    assert done.returncode == 0, done.stderr
    assert "note: The target's orbit hits the body it is about (6378.14 km): eccentricity 0.87" in done.stdout
