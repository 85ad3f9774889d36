"""`casadi-gnc check` as a user runs it: what it finds, draws, keeps whole, and refuses."""

import json
import os
import re
import subprocess
import sys

import pytest

from casadi_gnc.problem_files.document import read


def command(*arguments: str, columns: str = "100") -> subprocess.CompletedProcess:
    return subprocess.run(
        [sys.executable, "-m", "casadi_gnc.cli.main", "check", *arguments],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "COLUMNS": columns, "PYTHONIOENCODING": "utf-8"},
    )


def test_command_finds_the_slew_as_printed_and_draws(tmp_path):
    told = command("huang2020/slew_as_printed", "--json", "--figures", str(tmp_path))
    assert told.returncode == 1
    assert (tmp_path / "checks.png").stat().st_size > 10_000
    found = {(c["scheme"], c["name"]): c for c in json.loads(told.stdout)["checks"]}
    for name in ("gains.anti_windup", "funnel.floor.mrp", "sampling.closed_loop"):
        assert found["funnel_pinv", name]["verdict"] == "fail"
    assert found["funnel_pinv", "funnel.floor.mrp"]["value"] == "inf"
    box_share = found["funnel_pinv", "authority.virtual_control"]
    assert box_share["verdict"] == "note"
    assert box_share["value"] == pytest.approx(5.16e-4 / 1.5e-3, rel=1e-2)
    for theorem in ("compensation", "filter"):
        assert found["funnel_pinv", f"gains.theorem1.{theorem}"]["verdict"] == "note"


@pytest.mark.slow
def test_command_keeps_names_and_numbers_whole_in_80_columns():
    told = command("sun2018/circular_orbit", columns="80")
    assert told.returncode == 0
    table = [line for line in told.stdout.splitlines() if line.startswith(("│", "┃"))]
    assert max(map(len, table)) <= 80
    assert "numbers.resolution.position_error" in told.stdout
    assert "…" not in told.stdout
    assert "…" not in command("sun2018/circular_orbit", columns="40").stdout


def test_command_says_what_a_law_refuses(tmp_path):
    """Shi et al.'s baseline at 10 Hz: its gain of 2519 N s/m bears 2 x 28.57/2519.5 = 22.7 ms at most."""
    text = read("shi2020/docking_as_printed").text
    path = tmp_path / "slow.toml"
    path.write_text(
        re.sub(r'mode = "continuous"\nsample_period_s = \S+', 'mode = "sampled"\nsample_period_s = 0.1', text)
    )
    told = command(str(path), "--scheme", "dobc", "--json")
    assert told.returncode == 1
    found = {c["name"]: c for c in json.loads(told.stdout)["checks"]}
    assert found["sampling.hold"]["limit"] == pytest.approx(2 * 28.571 / 2519.5, rel=0.02)
    assert found["sampling.closed_loop"]["value"] == pytest.approx(7.8, abs=0.05)


@pytest.mark.slow
def test_command_reads_a_synthesis_and_names_what_cannot_be_met():
    told = command("shi2020/as_printed")
    assert told.returncode == 1
    assert "'(26) input'" in told.stdout
    assert command("shi2020/synthesis").returncode == 0


@pytest.mark.slow
def test_command_refuses_what_it_cannot_check(tmp_path):
    told = command("huang2020/allocation")
    assert (told.returncode, told.stdout) == (2, "")
    assert 'check takes a file of kind "mission" or "synthesis"' in told.stderr
    told = command("huang2020/detumble", "--scheme", "nobody")
    assert told.returncode == 2
    assert "no scheme 'nobody'" in told.stderr
    told = command("huang2020/detumble", "--figures", str(tmp_path), "--format", "txt")
    assert told.returncode == 2
    assert "'txt' is not one of 'png', 'svg', 'pdf'" in told.stderr
