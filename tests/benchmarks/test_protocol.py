"""The protocol catches what is wrong, slow, stuck or dead, and charges it; nothing that was measured is lost."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from casadi_gnc.benchmarks import Settings, read_results, run
from casadi_gnc.benchmarks.results import FILE
from casadi_gnc.benchmarks.summary import ALL, overview
from casadi_gnc.errors import BenchmarkError, OutputError

BAD = Path(__file__).parent / "bad_back_ends.py"
#: Four thrusters in two axes; the first entry of the second command is what some back ends trip over.
SET = """
format = 1
kind = "benchmark"
title = "Four thrusters"
contest = "allocation"

[[family]]
name = "four"
title = "Four thrusters in a plane"
problem = "four"
commands = "four.csv"
"""
PROBLEM = """
format = 1
kind = "allocation"
title = "Four thrusters"
[matrices]
effectiveness = [[1.0, -1.0, 0.5, -0.2], [0.3, 0.2, -1.0, 0.9]]
lower = 0.0
upper = 1.0
"""
COMMANDS = "u1,u2\n0.1,0.2\n0.2,0.1\n0.3,-0.2\n-0.1,-0.3\n"
QUICK = Settings(passes=2, cold_passes=1, cold_every=2, time_limit=0.1, grace=0.3, run_limit=60.0, deaths=2)


@pytest.fixture
def four(tmp_path):
    for name, text in (("set.toml", SET), ("four.toml", PROBLEM), ("four.csv", COMMANDS)):
        (tmp_path / name).write_text(text)
    return str(tmp_path / "set.toml")


def bad(name):
    return f"{BAD}:{name}"


def rows_of(results):
    return {row["contestant"].rpartition(":")[2]: row for row in overview(results).rows if row["family"] == ALL}


def test_a_back_end_that_breaks_a_bound_by_a_millionth_and_claims_success_is_caught(four, tmp_path):
    """Also where clipping, as done in use, would leave the answer optimal."""
    chosen = ["clarabel", bad("LIAR"), bad("OVER"), bad("MODEST"), bad("NOTHING")]
    results = run("allocation", [four], tmp_path / "out", contestants=chosen, settings=QUICK)
    rows = rows_of(results)
    assert rows["clarabel"]["success"] == 1.0
    for liar in ("LIAR", "OVER"):
        assert rows[liar]["success"] == 0.0
        assert rows[liar]["correct"] == 0.0
        assert rows[liar]["mean_us"] == pytest.approx(1e6 * QUICK.time_limit)  # charged the limit, however quick
        # The millionth is of the reach, 1; what comes back through JSON has six digits.
        assert rows[liar]["violation"] == pytest.approx(1e-6, rel=1e-5)
    assert rows["OVER"]["gap"] <= 1e-6
    assert rows["MODEST"]["success"] == 1.0  # right, though it does not know
    assert rows["MODEST"]["correct"] == 0.0
    assert rows["NOTHING"]["success"] == rows["NOTHING"]["correct"] == 0.0
    assert math.isinf(rows["NOTHING"]["violation"])
    fastest = next(row["contestant"] for row in overview(results).rows if row["family"] == ALL)
    assert fastest in ("clarabel", bad("MODEST"))


@pytest.mark.slow
def test_one_that_hangs_dies_or_leaves_takes_nothing_along(four, tmp_path):
    chosen = ["clarabel", bad("HANGS"), bad("DIES"), bad("LEAVES"), bad("RAISES"), bad("REFUSES")]
    results = run("allocation", [four], tmp_path / "out", contestants=chosen, settings=QUICK)
    rows = rows_of(results)
    assert rows["clarabel"]["success"] == 1.0
    assert len(rows) == len(chosen)
    told = {
        cell.contestant.rpartition(":")[2]: set(cell.failures.values())
        for cell in results.cells.values()
        if cell.failures and cell.mode == "warm" and cell.number == 0
    }
    assert told["HANGS"] == {
        "hung: no end of a solve within 0.4 s; killed",
        "withdrawn: it had died or hung too often",
    }
    assert told["DIES"] == {"died: its process was ended by SIGABRT"}
    assert told["LEAVES"] >= {"died: its process ended with code 3"}
    assert told["RAISES"] == {"raised: ZeroDivisionError: it broke"}
    assert told["REFUSES"] == {"raised: ValueError: not today"}
    # What is not to blame is measured: only the second of four commands kills, only it raises.
    for name in ("DIES", "RAISES"):
        cell = results.of(bad(name), "four", "warm")[0]
        assert cell.good == [True, False, True, True]
        assert np.isfinite(cell.seconds).tolist() == [True, False, True, True]
    assert rows["LEAVES"]["success"] == rows["REFUSES"]["success"] == 0.0
    withdrawn = [cell for cell in results.of(bad("LEAVES"), "four", "warm") if cell.number == 1]
    assert set(withdrawn[0].failures.values()) == {"withdrawn: it had died or hung too often"}


def test_one_that_is_late_is_charged_and_not_killed(four, tmp_path):
    results = run("allocation", [four], tmp_path / "out", contestants=[bad("SLOW")], settings=QUICK)
    row = rows_of(results)["SLOW"]
    assert row["success"] == 0.0
    assert row["failures"] == 0
    assert row["max_us"] == pytest.approx(1e6 * QUICK.time_limit)


def test_one_that_leaks_is_started_anew(four, tmp_path):
    settings = Settings(passes=4, cold_passes=0, time_limit=1.0, memory_MB=150.0, share=60.0)
    results = run("allocation", [four], tmp_path / "out", contestants=[bad("LEAKS")], settings=settings)
    cells = results.of(bad("LEAKS"), "four", "warm")
    assert [not math.isnan(cell.load) for cell in cells] == [True, True, True, True]  # a new process each
    assert all(cell.memory_MB > 150 for cell in cells)
    assert max(cell.memory_MB for cell in cells) < 2 * min(cell.memory_MB for cell in cells)


def test_columns_are_times_of_what_they_say(four, tmp_path):
    """A back end whose set-up sleeps 30 ms and whose solves sleep 10 ms; the first of each 50 ms longer."""
    (tmp_path / "timed.py").write_text(
        "import time\n"
        "from casadi_gnc.allocation.backends import Capability, Found, module\n"
        "CAPABILITIES, REQUIRES, ACCURACY = Capability.ROBUST, (), (1, 1)\n"
        "class Solver:\n"
        "    def __init__(self, problem):\n"
        "        time.sleep(0.03)\n"
        "        self.honest, self.fresh = module('clarabel').set_up(problem), True\n"
        "    def find(self, *sample):\n"
        "        time.sleep(0.06 if self.fresh else 0.01)\n"
        "        self.fresh = False\n"
        "        found = self.honest.find(*sample)\n"
        "        return Found(found.forces, found.weights, 7, True, 0.004)\n"
        "set_up = Solver\n"
    )
    settings = Settings(passes=2, cold_passes=1, cold_every=1, time_limit=1.0)
    results = run("allocation", [four], tmp_path / "out", contestants=[str(tmp_path / "timed.py")], settings=settings)
    row = next(row for row in overview(results).rows if row["family"] == ALL)
    assert row["success"] == 1.0
    # A sleep is never shorter than asked, and longer by some milliseconds where the machine is busy.
    assert 30e3 <= row["setup_us"] < 120e3
    assert 60e3 <= row["first_us"] < 300e3
    assert 60e3 <= row["cold_us"] < 250e3
    assert 10e3 <= row["warm_us"] < 55e3  # without what the first takes longer
    assert row["load_us"] >= 30e3
    assert row["solver_us"] == pytest.approx(4e3)
    assert row["wrapper_us"] == pytest.approx(row["warm_us"] - 4e3, rel=0.3)  # medians of different things
    assert row["iterations"] == 7


def test_a_run_goes_on_where_it_was_ended_and_repeats_nothing(four, tmp_path):
    out = tmp_path / "out"
    seen = []

    def interrupt(done, total, what):
        seen.append(what)
        if len(seen) == 5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run("allocation", [four], out, contestants=["clarabel", "pinv"], settings=QUICK, progress=interrupt)
    before = (out / FILE).read_text().splitlines()
    assert len(before) == 1 + 4
    # As if the power had failed in the middle of a line.
    (out / FILE).write_text("\n".join(before)[:-40])
    lost = read_results(out)
    assert [number for number, _ in lost.corrupt] == [5]
    assert len(lost.cells) == 3
    results = run("allocation", [four], out, contestants=["clarabel", "pinv"], settings=QUICK)
    lines = (out / FILE).read_text().splitlines()
    assert lines[:4] == before[:4]
    assert [number for number, _ in results.corrupt] == [5]
    assert len(results.cells) == 2 * (2 + 1)  # two contestants, two warm passes and a cold one
    assert len(lines) == 1 + 6 + 1
    again = run("allocation", [four], out, contestants=["clarabel", "pinv"], settings=QUICK)
    assert (out / FILE).read_text().splitlines() == lines
    assert again.cells.keys() == results.cells.keys()


def test_contestants_take_turns(four, tmp_path):
    """Interleaved: between two cells of one contestant in a mode come those of all others."""
    settings = Settings(passes=4, cold_passes=0, time_limit=1.0)
    chosen = ["clarabel", "pinv", "sqpmethod"]
    results = run("allocation", [four], tmp_path / "out", contestants=chosen, settings=settings)
    cells = sorted(results.cells.values(), key=lambda cell: cell.started)
    turns = [tuple(cell.contestant for cell in cells[k : k + 3]) for k in range(0, 12, 3)]
    assert all(set(turn) == set(chosen) for turn in turns)
    assert len(set(turns)) > 1  # and not always in the same order


def test_the_run_limit_ends_a_run_that_can_be_gone_on_with(four, tmp_path):
    from casadi_gnc.benchmarks.running import left_out

    limits = {"passes": 1, "cold_passes": 0, "time_limit": 1.0}
    chosen = ["clarabel", "pinv"]
    part = run("allocation", [four], tmp_path, contestants=chosen, settings=Settings(run_limit=1e-9, **limits))
    assert left_out(part) == 2
    whole = run("allocation", [four], tmp_path, contestants=chosen, settings=Settings(run_limit=60.0, **limits))
    assert left_out(whole) == 0


@pytest.fixture
def measured(four, tmp_path):
    run("allocation", [four], tmp_path / "out", contestants=["pinv"], settings=QUICK)
    return tmp_path / "out"


def change_header(folder, **changes):
    lines = (folder / FILE).read_text().splitlines()
    lines[0] = json.dumps({**json.loads(lines[0]), **changes})
    (folder / FILE).write_text("\n".join(lines) + "\n")


def test_results_of_another_version_are_refused(measured, four):
    change_header(measured, format=0, casadi_gnc="0.0.1")
    before = (measured / FILE).read_bytes()
    with pytest.raises(BenchmarkError, match=r"results of format 0, written by casadi-gnc 0\.0\.1; this version reads"):
        read_results(measured)
    with pytest.raises(BenchmarkError, match="results of format 0"):
        run("allocation", [four], measured, contestants=["pinv"], settings=QUICK)
    change_header(measured, format=1)
    with pytest.raises(BenchmarkError, match=r"was written by casadi-gnc 0\.0\.1, this is"):
        run("allocation", [four], measured, contestants=["pinv"], settings=QUICK)
    assert (measured / FILE).read_bytes().count(b"\n") == before.count(b"\n")


def test_results_that_new_ones_cannot_stand_beside_are_refused(measured, four, tmp_path):
    low = Settings(accuracy="low", passes=2, cold_passes=1, cold_every=2, time_limit=0.1, deaths=2)
    with pytest.raises(BenchmarkError, match="was measured with accuracy mid, not low; choose another --out"):
        run("allocation", [four], measured, contestants=["pinv"], settings=low)
    with pytest.raises(BenchmarkError, match="without 'clarabel'"):
        run("allocation", [four], measured, contestants=["clarabel"], settings=QUICK)
    (tmp_path / "four.csv").write_text(COMMANDS.replace("0.3", "0.4"))
    with pytest.raises(BenchmarkError, match="other data for the family 'four'"):
        run("allocation", [four], measured, contestants=["pinv"], settings=QUICK)


def test_corrupt_lines_are_named_and_the_rest_kept(measured):
    lines = (measured / FILE).read_text().splitlines()
    short = {**json.loads(lines[2]), "seconds": [1.0]}
    lines[1:3] = ["{not json", json.dumps(short)]
    lines += ['{"contestant": "pinv"}', "\x00\xff", ""]
    (measured / FILE).write_text("\n".join(lines), encoding="latin-1")
    results = read_results(measured)
    assert [number for number, _ in results.corrupt] == [2, 3, 5, 6]
    assert "not JSON" in results.corrupt[0][1]
    assert "differ in length" in results.corrupt[1][1]
    assert len(results.cells) == 1


def test_what_is_no_results_file_is_told(tmp_path):
    with pytest.raises(BenchmarkError, match="no results in"):
        read_results(tmp_path)
    (tmp_path / FILE).write_text("hello\n")
    with pytest.raises(BenchmarkError, match="line 1: is not the header"):
        read_results(tmp_path)


def test_a_folder_that_is_a_file_is_told(four, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="cannot write to the output folder"):
        run("allocation", [four], tmp_path / "file" / "out", contestants=["pinv"], settings=QUICK)


@pytest.mark.parametrize(
    ("names", "message"),
    [
        (["nonsense"], "no allocation back end 'nonsense'; there is online"),
        (["qpsolvers:nonsense"], "qpsolvers does not find"),
        (["nowhere.py"], "there is no file 'nowhere.py'"),
        ([f"{BAD}:NOBODY"], "cannot be loaded: AttributeError"),
        ([], "no back ends are named"),
    ],
)
def test_unknown_contestants_are_told(four, tmp_path, names, message):
    with pytest.raises(BenchmarkError, match=message):
        run("allocation", [four], tmp_path / "out", contestants=names, settings=QUICK)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    "wrong", [{"passes": 0}, {"time_limit": -1.0}, {"accuracy": "best"}, {"samples": 0}, {"clock": "sun"}]
)
def test_settings_that_make_no_sense_are_told(wrong):
    with pytest.raises(BenchmarkError, match=next(iter(wrong))):
        Settings(**wrong)
