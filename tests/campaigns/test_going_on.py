"""What a campaign keeps is whole: it goes on after kills, a full disk, damage, and mixes with no other."""

from __future__ import annotations

import errno
import random
import shutil
import signal
import subprocess
import sys
import time

import pytest
from tumbling import INERTIA, command, flown, run, tables

import casadi_gnc
from casadi_gnc.errors import CampaignError


def test_a_corrupt_shard_is_flown_again(tmp_path, small_shards):
    found = flown(out=tmp_path)
    kept = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    second = next(path for path in tmp_path.iterdir() if path.name.startswith("shard-00001") and path.suffix != ".json")
    second.write_bytes(kept[second.name][:-40] + bytes(40))
    (tmp_path / "shard-00002.json").unlink()
    damaged = casadi_gnc.campaigns.result.Campaign(tmp_path, found.cases)
    assert len(damaged) == 100 - 2 * 16
    assert damaged.summary()["damaged"] == [f"{second.name} is not what was written: its hash differs"]
    told = []
    flown(out=tmp_path, said=told.append)
    assert told[:1] == [f"{second.name} is not what was written: its hash differs; it is flown again"]
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == kept


@pytest.mark.slow
def test_a_folder_in_the_place_of_a_file_is_named_and_loses_nothing(tmp_path, small_shards):
    flown(out=tmp_path)
    kept = tables(tmp_path)
    (table,) = [path for path in tmp_path.glob("shard-00001.*") if path.suffix != ".json"]
    for place in (table, table.with_suffix(".json")):
        place.unlink()
        place.mkdir()
        told = []
        with pytest.raises(CampaignError, match=f"{place.name}': Is a directory; what is finished is kept, and the sa"):
            flown(out=tmp_path, said=told.append)
        assert told[0] == f"{place.name} cannot be read: Is a directory; it is flown again"
        place.rmdir()
        flown(out=tmp_path)
        assert tables(tmp_path) == kept


@pytest.mark.parametrize("plan", ["independent", "sobol"])
def test_a_campaign_grows_to_what_one_of_more_flights_is(tmp_path, monkeypatch, plan):
    monkeypatch.setattr("casadi_gnc.campaigns.campaign._SHARD_SAMPLES", 400 * 32)
    flown(out=tmp_path / "grown", flights=40, plan=plan)
    flown(out=tmp_path / "grown", flights=100, plan=plan)
    flown(out=tmp_path / "at_once", flights=100, plan=plan)
    assert tables(tmp_path / "grown") == tables(tmp_path / "at_once")
    with pytest.raises(CampaignError, match="holds a campaign of 100 cases, and 40 are asked for; ask for as many"):
        flown(out=tmp_path / "grown", flights=40, plan=plan)


def test_a_plan_of_fixed_size_does_not_grow(tmp_path):
    flown(out=tmp_path, flights=40, plan="latin_hypercube")
    with pytest.raises(CampaignError, match="is made for its number of cases and cannot grow; give another folder"):
        flown(out=tmp_path, flights=41, plan="latin_hypercube")


def test_another_campaign_never_mixes_into_a_folder(tmp_path):
    flown(out=tmp_path)
    for change in ({"seed": 1}, {"plan": "sobol"}, {"dispersions": [INERTIA]}, {"samples": 300}):
        with pytest.raises(CampaignError, match="holds another campaign: its .* give another folder"):
            flown(out=tmp_path, **change)


def test_a_full_disk_is_told_and_loses_nothing(tmp_path, small_shards, monkeypatch):
    """The third write finds no room: two shards are kept, and the same campaign goes on to the same bytes."""
    from casadi_gnc.campaigns import store

    calm, write, count = tmp_path / "calm", store._write, []
    flown(out=calm)

    def full(place, columns, suffix):
        count.append(place)
        if len(count) == 3:
            write(place, columns, suffix)
            raise OSError(errno.ENOSPC, "No space left on device", str(place))
        write(place, columns, suffix)

    monkeypatch.setattr(store, "_write", full)
    with pytest.raises(CampaignError, match="cannot write to .*: No space left on device; what is finished is kept"):
        flown(out=tmp_path / "full")
    assert sorted(path.name for path in (tmp_path / "full").glob("shard-*.json")) == [
        "shard-00000.json",
        "shard-00001.json",
    ]
    flown(out=tmp_path / "full")
    assert tables(tmp_path / "full") == tables(calm)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="limits of Linux")
def test_a_file_that_may_not_grow_is_told_in_one_sentence(problem, tmp_path):
    """The kernel cuts every file at 16 KiB, as a full disk would: exit 2, a sentence, nothing half."""
    limit = "import resource, signal, os, sys; signal.signal(signal.SIGXFSZ, signal.SIG_IGN)"
    limit += "; resource.setrlimit(resource.RLIMIT_FSIZE, (16384, 16384)); os.execv(sys.argv[1], sys.argv[1:])"
    arguments = ("campaign", problem, "--flights", 400, "--scheme", "observer_pinv", "--out", tmp_path / "mc")
    assert run(*arguments[:-1], tmp_path / "calm").returncode == 0  # and what it compiled is at hand
    none = run(*arguments[:-1], tmp_path / "part", "--shard", "2/2")
    assert (none.returncode, none.stdout) == (0, "part 2/2 has no cases: the campaign is one file\n")
    done = subprocess.run(
        [sys.executable, "-c", limit, *command(*arguments)], capture_output=True, text=True, timeout=300
    )
    assert (done.returncode, done.stdout) == (2, "")
    line = done.stderr.strip().splitlines()[-1]
    assert "Traceback" not in done.stderr, done.stderr
    assert "cannot write to" in line, done.stderr
    assert "File too large; what is finished is kept" in line
    assert not list((tmp_path / "mc").glob("shard-*"))
    assert run(*arguments).returncode == 0
    assert tables(tmp_path / "mc") == tables(tmp_path / "calm")


#: The command line with shards of 16 flights, so that a kill finds some written and some not.
IN_SMALL_SHARDS = """
import importlib, sys
importlib.import_module("casadi_gnc.campaigns.campaign")
sys.modules["casadi_gnc.campaigns.campaign"]._SHARD_SAMPLES = 1500 * 16
from casadi_gnc.cli.entry import main
main()
"""


def in_small_shards(problem, out):
    options = ("campaign", problem, "--flights", "1600", "--scheme", "observer_pinv", "--json", "--out", out)
    return [sys.executable, "-c", IN_SMALL_SHARDS, *map(str, options)]


def finished(out):
    return len(list(out.glob("shard-*.json")))


def moment_comes(out, process, shards, rng):
    """Wait for a random moment: while the program begins, or soon after some more shards are written, if there are."""
    if rng.random() < 0.1:
        time.sleep(rng.uniform(0.0, 2.0))
        return True
    asked = finished(out) + rng.randint(1, shards // 4)
    while finished(out) < min(asked, shards) and process.poll() is None:
        time.sleep(0.002)
    time.sleep(rng.uniform(0.0, 0.02))
    return asked <= shards


def killed(problem, out, calm, kills, rng):
    """Kill campaigns at random moments, each going on where it was, and compare each that ends with `calm`.

    Return how many of the kills found some shards written and others not.
    """
    shards, halfway, left, ended = finished(calm), 0, kills, 0
    while left or not ended:
        process = subprocess.Popen(in_small_shards(problem, out), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        if left and moment_comes(out, process, shards, rng):
            process.kill()
        if process.wait() == -signal.SIGKILL:
            left -= 1
            halfway += 0 < finished(out) < shards
            continue
        assert process.returncode == 0
        assert tables(out) == tables(calm)
        assert {path.name for path in out.iterdir()} == set(tables(calm))  # nothing half is left lying
        shutil.rmtree(out)
        ended += 1
    return halfway


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
@pytest.mark.parametrize("kills", [pytest.param(3, marks=pytest.mark.slow), pytest.param(100, marks=pytest.mark.long)])
def test_killed_at_any_moment_and_run_again_the_tables_are_those_of_an_undisturbed_run(problem, tmp_path, kills):
    subprocess.run(in_small_shards(problem, tmp_path / "calm"), check=True, capture_output=True)
    halfway = killed(problem, tmp_path / "killed", tmp_path / "calm", kills, random.Random(kills))
    assert halfway >= kills // 2
