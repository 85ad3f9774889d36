"""Campaigns: every case has the words of a single flight, whatever flies it; what is kept is whole, and goes on."""

from __future__ import annotations

import dataclasses
import errno
import hashlib
import json
import math
import platform
import random
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import casadi_gnc
from casadi_gnc.campaigns import DispersionTable
from casadi_gnc.campaigns.campaign import shard_size
from casadi_gnc.campaigns.engines import VECTORS, CompiledBatch, best_vectors
from casadi_gnc.errors import CampaignError
from casadi_gnc.missions.one_build import fly_case
from casadi_gnc.missions.parameters import vary
from casadi_gnc.missions.requirements import Requirement

#: Missions with what varies, sampled and continuous, with noise and without, each kind of allocation.
FLOWN = {
    "huang2020/detumble": ("observer_pinv", ["truth.inertia_factor", "initial.*"]),
    "huang2020/slew": ("funnel_robust", ["truth.inertia_factor", "initial.rate_rad_per_s"]),
    "huang2019/wheel_faults": (None, ["fault.1.effectiveness", "initial.rate_rad_per_s"]),
    "shi2020/docking": ("iobc", ["spacecraft.target_mass_kg", "initial.position_m"]),
    "sun2018/circular_orbit": (None, ["spacecraft.mass_kg", "initial.position_error_m"]),
    "tao2019/case1": (None, ["spacecraft.mass_kg", "initial.mrp"]),
    "satellites/earth_pointing": (None, ["truth.inertia_factor"]),
}
KINDS = list(VECTORS)[: list(VECTORS).index(best_vectors()) + 1]

INERTIA = DispersionTable(key="truth.inertia_factor", normal={"mean": 1.0, "deviation": 0.03, "truncate": 3.0})
RATES = DispersionTable(key="initial.rate_rad_per_s", uniform=[-0.05, 0.05])


def few_quickly(names):
    """Return all names, of which the fast tests take the first two."""
    return [name if i < 2 else pytest.param(name, marks=pytest.mark.slow) for i, name in enumerate(names)]


def short(name, samples=200):
    mission = casadi_gnc.load(name)
    return mission.with_timing(duration=samples * mission.timing.sample_period)


def detumble(samples=400, **options):
    mission = short("huang2020/detumble", samples).with_scheme("observer_pinv")
    mission = dataclasses.replace(mission, metrics=(casadi_gnc.Metric("final_rate", "final", "rate"),))
    return {"mission": mission, "flights": 100, "dispersions": [INERTIA, RATES], **options}


def flown(**options):
    given = detumble(**options)
    return casadi_gnc.campaign(given.pop("mission"), given.pop("flights"), **given)


def every_mission():
    """Return the shipped missions that are not flown anyway."""
    found = (name for name in casadi_gnc.shipped() if casadi_gnc.problem_files.read(name).data["kind"] == "mission")
    return [pytest.param(name, marks=pytest.mark.long) for name in found if name not in FLOWN]


@pytest.mark.parametrize("name", [*few_quickly(FLOWN), *every_mission()])
def test_lanes_and_threads_have_the_words_of_single_flights(name):
    some = "truth.inertia_factor" if name.startswith("satellites/") else "initial.*"
    scheme, keys = FLOWN.get(name, (None, [some]))
    varied = vary(short(name, 60), keys, scheme)
    cases = 257  # no multiple of the lanes
    turns = np.sin(np.arange(cases * varied.parameters.size)).reshape(cases, -1)
    values, seeds = varied.parameters.nominal * (1 + 0.01 * turns), np.arange(cases, dtype=np.uint64) + 5
    runs = [CompiledBatch(varied, vectors=kind, threads=1).fly(values, seeds).words for kind in KINDS]
    runs.append(CompiledBatch(varied, threads=3).fly(values, seeds).words)
    assert all((words == runs[0]).all() for words in runs)
    batch = CompiledBatch(varied, vectors="none", threads=1).fly(values, seeds)
    alone = fly_case(varied, values[7], 12, decimation=10**9)
    from casadi_gnc.missions import metrics

    timing, mission = varied.nominal.timing, varied.nominal
    last = (timing.samples - 1) * timing.sample_period
    read = metrics.read(tuple(mission.metrics), varied.tapes.tally, batch.tally[7], last, timing.sample_period)
    assert read == alone.metrics
    assert metrics.statuses(varied.tapes.tally, batch.tally[7]) == alone.statuses


def vectorised(batch, folder):
    """Return the tapes whose loop over lanes gcc made of vectors of 32 bytes, by its own report and by the object."""
    from casadi_gnc.system import assets

    (folder / "lanes.c").write_text(batch.source)
    include = assets.folder("codegen") / "runtime"
    flags = ["-std=c99", "-ffp-contract=off", "-fPIC", *batch.flags, f"-I{include}", "-fopt-info-vec-optimized"]
    told = subprocess.run(
        ["gcc", *flags, "-c", "lanes.c"], check=True, cwd=folder, capture_output=True, text=True
    ).stderr
    assert (folder / "lanes.o").stat().st_size > 0
    starts = {m.start(): m[1] for m in re.finditer(r"^static void (\w+)\(", batch.source, re.MULTILINE)}
    owner, lines, at = {}, batch.source.splitlines(keepends=True), 0
    for number, line in enumerate(lines, 1):
        owner[number] = starts.get(at, owner.get(number - 1, ""))
        at += len(line)
    found = re.findall(r"lanes\.c:(\d+):\d+: optimized: +loop vectorized using 32 byte vectors", told)
    return {owner[int(number)] for number in found}


@pytest.mark.skipif(platform.machine().lower() not in ("x86_64", "amd64"), reason="AVX2 is of x86-64")
@pytest.mark.parametrize(
    "name", few_quickly(["huang2020/detumble", "shi2020/docking", "tao2019/case1", "sun2018/circular_orbit"])
)
def test_the_loops_over_lanes_are_vector_instructions(name, tmp_path):
    if "Free Software Foundation" not in subprocess.run(["gcc", "--version"], capture_output=True, text=True).stdout:
        pytest.skip("a report of GNU gcc")
    scheme, keys = FLOWN[name]
    varied = vary(short(name), keys, scheme)
    batch = CompiledBatch(varied, vectors="avx2", threads=1)
    hot = {"stage"} if "stage" in varied.tapes.functions else {"rate", "before", "allocate", "after"}
    hot |= {"observe", "tally"}
    assert hot <= vectorised(batch, tmp_path)


def test_a_case_depends_on_its_number_alone_whatever_the_split_and_the_threads(tmp_path, monkeypatch):
    monkeypatch.setattr("casadi_gnc.campaigns.campaign._SHARD_SAMPLES", 400 * 16)
    whole = flown(out=tmp_path / "whole", threads=1)
    for part in (3, 1, 2):
        flown(out=tmp_path / "parts", shard=(part, 3), threads=2, vectors="none")
    names = sorted(path.name for path in (tmp_path / "whole").iterdir())
    assert len([name for name in names if name.startswith("shard-") and not name.endswith(".json")]) == 7
    for name in names:
        assert (tmp_path / "whole" / name).read_bytes() == (tmp_path / "parts" / name).read_bytes()
    assert len(whole) == 100


def test_any_case_flies_again_word_for_word(tmp_path):
    found = flown(out=tmp_path, seed=3)
    case = found.worst("final_rate")
    again = case.fly()
    assert again.metrics["final_rate"] == found.column("metric.final_rate")[case.number]
    assert again.metrics["final_rate"] == found.column("metric.final_rate").max()
    assert found.case("best:final_rate").number == int(np.argmin(found.column("metric.final_rate")))
    assert found.case(7).row["truth.inertia_factor"] == found.column("truth.inertia_factor")[7]


def test_plans_and_seeds_give_other_cases_and_the_table_holds_what_was_flown():
    found = [flown(plan=plan, seed=seed) for plan, seed in (("sobol", 0), ("latin_hypercube", 0), ("sobol", 1))]
    columns = [one.column("initial.rate_rad_per_s.2") for one in found]
    assert all(np.abs(column).max() <= 0.05 for column in columns)
    assert not (columns[0] == columns[1]).any()
    assert not (columns[0] == columns[2]).any()
    assert found[0].table.num_rows == 100
    assert len(np.unique(found[0].column("noise_seed"))) == 100


def test_cases_that_no_craft_can_have_are_counted_and_not_redrawn():
    wild = DispersionTable(key="truth.inertia_factor", normal={"mean": 1.0, "deviation": 1.0})
    found = flown(dispersions=[wild, RATES])
    negative = found.column("truth.inertia_factor") <= 0
    assert 5 < negative.sum() < 40
    assert ((found.column("refused") != "") == negative).all()
    summary = found.summary()
    assert summary["refused"] == negative.sum()
    assert sum(summary["why"].values()) == negative.sum()
    assert np.isnan(found.column("metric.final_rate")[negative]).all()
    with pytest.raises(CampaignError, match="is refused: .*greater than 0|is refused"):
        found.case(int(np.flatnonzero(negative)[0])).fly()


def test_an_indefinite_inertia_is_refused():
    varied = vary(casadi_gnc.load("sun2018/circular_orbit"), ["spacecraft.inertia_kg_m2"])
    values = np.tile(varied.parameters.nominal, (8, 1))
    values[1:7] += np.diag([20.0, 20.0, 10.0, 20.0, 10.0, 10.0])  # one entry each, its mirror image with it
    values[7, 1] = 1e6  # off the diagonal
    told = varied.refusals(values)
    assert told[:7] == [""] * 7
    assert "positive definite" in told[7]


def test_a_start_beyond_what_sensors_tell_is_refused():
    found = flown(dispersions=[DispersionTable(key="initial.rate_rad_per_s", uniform=[5.0, 15.0])])
    fast = (np.abs(found.columns([f"initial.rate_rad_per_s.{i}" for i in (1, 2, 3)])) > 10.0).any(axis=1)
    assert ((found.column("refused") != "") == fast).all()
    assert any("beyond the largest credible" in why for why in found.column("refused"))


def test_requirements_of_many_flights_are_judged_by_their_share():
    mission = detumble()["mission"]
    asked = (
        Requirement("R-1", metric="final_rate", at_most=0.01, share=0.5, confidence=0.9),
        Requirement("R-2", formula="always(norm(rate) <= 0.04)", share=0.999),
    )
    found = flown(mission=dataclasses.replace(mission, requirements=asked))
    told = found.summary()["requirements"]
    margins = 0.01 - found.column("metric.final_rate")
    assert (found.column("requirement.R-1") == margins).all()
    assert told["R-1"]["met_by"] == (margins >= 0).sum()
    assert told["R-2"]["verdict"] == "not met"
    worst = found.case("failed:R-2")
    flight = worst.fly(decimation=1)
    norm = np.linalg.norm(flight["rate"], axis=1)
    assert worst.row["requirement.R-2"] == pytest.approx(0.04 - norm.max(), abs=1e-15)
    assert flight.verdicts["R-2"].robustness == worst.row["requirement.R-2"]


def test_a_corrupt_shard_is_flown_again(tmp_path, monkeypatch):
    monkeypatch.setattr("casadi_gnc.campaigns.campaign._SHARD_SAMPLES", 400 * 16)
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


def test_a_full_disk_is_told_and_loses_nothing(tmp_path, monkeypatch):
    """The third write finds no room: two shards are kept, and the same campaign goes on to the same bytes."""
    from casadi_gnc.campaigns import store

    monkeypatch.setattr("casadi_gnc.campaigns.campaign._SHARD_SAMPLES", 400 * 16)
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


def test_another_campaign_never_mixes_into_a_folder(tmp_path):
    flown(out=tmp_path)
    for change in ({"seed": 1}, {"plan": "sobol"}, {"dispersions": [INERTIA]}, {"samples": 300}):
        with pytest.raises(CampaignError, match="holds another campaign: its .* give another folder"):
            flown(out=tmp_path, **change)


def test_an_audit_finds_other_words(monkeypatch):
    fly = CompiledBatch.fly

    def wrong(self, values, seeds, told=None):
        found = fly(self, values, seeds, told)
        if self.vectors != "none" or self.lanes > 1:
            found.tally[:, 0] += 1e-12
        return found

    monkeypatch.setattr(CompiledBatch, "fly", wrong)
    monkeypatch.setattr("casadi_gnc.campaigns.engines.best_vectors", lambda: "baseline")
    with pytest.raises(CampaignError, match="other words when it is flown again"):
        flown()


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"dispersions": []}, "nothing differs from case to case"),
        ({"dispersions": [DispersionTable(key="truth.inertia", uniform=[0, 1])]}, "did you mean"),
        ({"dispersions": [RATES, RATES]}, "given by two keys"),
        ({"dispersions": [DispersionTable(key="initial.mrp", choice={"values": [[1.0, 2.0]]})]}, "stands for 3"),
        ({"plan": "random"}, "no plan 'random'; there is independent"),
        ({"plan": "corners"}, "ask for those"),
        ({"flights": 0}, "expected 1 to"),
        ({"shard": (4, 3)}, "the shard is 4/3"),
        ({"seed": -1}, "the seed is -1"),
        (
            {"dispersions": [DispersionTable(key="truth.inertia_factor", uniform=[-2, -1])]},
            "the first 64 cases are all refused; case 0: inertia_factor is -",
        ),
    ],
)
def test_what_cannot_be_flown_is_told_in_one_sentence(change, told):
    with pytest.raises(casadi_gnc.GncError, match=told) as error:
        flown(**change)
    assert "\n" not in str(error.value)


def test_an_allocation_outside_the_c_is_refused():
    from casadi_gnc.allocation.in_flight import SolverInFlight

    scheme = casadi_gnc.load("huang2020/slew").scheme("funnel_robust")
    mission = short("huang2020/slew")
    outside = dataclasses.replace(scheme.actuation, allocator=SolverInFlight(scheme.actuation.allocator.problem))
    with pytest.raises(CampaignError, match="called from Python at every sample"):
        flown(mission=mission.with_scheme("funnel_robust", actuation=outside))


def test_shards_are_seconds_of_work_and_the_same_everywhere():
    assert shard_size(15001) == 2048
    assert shard_size(10**9) == 16
    assert shard_size(1) == 65536


PROBLEM = """
[[dispersion]]
key = "truth.inertia_factor"
normal = { mean = 1.0, deviation = 0.03, truncate = 3.0 }

[[dispersion]]
key = "initial.rate_rad_per_s"
uniform = [-0.05, 0.05]

[[requirement]]
id = "DTB-1"
metric = "settling_time"
at_most = 120.0
share = 0.95
"""


@pytest.fixture
def problem(tmp_path):
    from casadi_gnc.system import assets

    text = (assets.folder("problems") / "huang2020" / "detumble.toml").read_text()
    place = tmp_path / "tumbling.toml"
    place.write_text(text.replace("duration_s = 1500.0", "duration_s = 150.0") + PROBLEM)
    return place


def command(*arguments):
    return [str(Path(sys.executable).with_name("casadi-gnc")), *map(str, arguments)]


def run(*arguments):
    return subprocess.run(command(*arguments), capture_output=True, text=True, timeout=300)


@pytest.mark.slow
def test_the_command_flies_shows_and_flies_a_case_again(problem, tmp_path):
    out = tmp_path / "mc"
    first = run("campaign", problem, "--flights", 200, "--scheme", "observer_pinv", "--out", out)
    assert first.returncode == 0, first.stderr
    assert "tumbling, observer_pinv: 200 flights of 200 cases" in first.stdout
    assert "DTB-1: " in first.stdout
    shutil.move(problem, tmp_path / "gone.toml")  # the folder is enough
    shown = json.loads(run("campaign", "show", out, "--json").stdout)
    worst = shown["metrics"]["settling_time"]["worst"][0]
    flight = run("fly", out, "--case", "worst:settling_time", "--out", tmp_path / "worst", "--json")
    assert flight.returncode == 0, flight.stderr
    value = json.loads(flight.stdout)["schemes"][0]["metrics"]["settling_time"]["value"]
    assert value == worst["value"]
    assert (tmp_path / "worst/observer_pinv.png").stat().st_size > 1e4
    told = run("fly", out, "--case", "worst:nothing")
    assert (told.returncode, told.stdout) == (2, "")
    assert "no metric 'nothing'; there is settling_time" in told.stderr
    assert run("campaign", "show", tmp_path).returncode == 2


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


def tables(folder):
    return {p.name: hashlib.sha256(p.read_bytes()).hexdigest() for p in folder.iterdir() if not p.name.startswith(".")}


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
@pytest.mark.parametrize("kills", [pytest.param(3, marks=pytest.mark.slow), pytest.param(100, marks=pytest.mark.long)])
def test_killed_at_any_moment_and_run_again_the_tables_are_those_of_an_undisturbed_run(problem, tmp_path, kills):
    subprocess.run(in_small_shards(problem, tmp_path / "calm"), check=True, capture_output=True)
    halfway = killed(problem, tmp_path / "killed", tmp_path / "calm", kills, random.Random(kills))
    assert halfway >= kills // 2


def test_the_summary_has_bounds_that_enclose_what_it_tells(tmp_path):
    summary = flown(flights=300).summary()
    final = summary["metrics"]["final_rate"]
    for one in final["percentiles"].values():
        assert one["low"] is None or one["low"] <= one["value"]
        assert one["high"] is None or one["value"] <= one["high"]
    assert final["drivers"][0]["key"].startswith("initial.rate_rad_per_s")
    assert math.isfinite(final["worst"][0]["value"])
    json.dumps(summary, allow_nan=False)


def test_chosen_cases_are_told_by_their_range_and_not_by_shares():
    found = flown(plan="one_at_a_time", flights=9)
    told = found.summary()
    assert not told["representative"]
    values = found.column("metric.final_rate")
    assert told["metrics"]["final_rate"]["range"] == [values.min(), values.max()]
    assert told["metrics"]["final_rate"]["percentiles"] == {}
    assert (told["requirements"], told["statuses"]) == ({}, {})
