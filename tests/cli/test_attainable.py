"""`casadi-gnc attainable` on the paper's thrusters: its torque limit is not attainable."""

import json
import subprocess
import sys

import pytest

PROGRAM = [sys.executable, "-m", "casadi_gnc.cli.main", "attainable", "huang2020/allocation"]


def run(*arguments: str) -> subprocess.CompletedProcess:
    return subprocess.run([*PROGRAM, *arguments], capture_output=True, text=True, timeout=300)


def test_the_papers_limit_is_not_attainable():
    done = run()
    assert done.returncode == 0, done.stderr
    assert "not attainable" in done.stdout
    assert "34.4 %" in done.stdout


def test_json_and_picture(tmp_path):
    picture = tmp_path / "deep" / "attainable.png"
    done = run("--json", "--figures", str(picture.parent))
    found = json.loads(done.stdout)
    for kind, expected in (("nominal", 5.16e-4), ("each_vertex", 4.93e-4), ("common_forces", 3.55e-4)):
        assert found["sets"][kind]["box"] == pytest.approx([expected] * 3, rel=2e-3)
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_bad_target_is_told(tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("")
    done = run("--figures", str(blocked / "p"))
    assert done.returncode == 2
    assert "cannot write to the output folder" in done.stderr
