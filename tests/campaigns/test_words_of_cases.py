"""Every case has the words of a single flight, whatever flies it: lanes, threads, parts of a campaign, workers."""

from __future__ import annotations

import platform
import re
import subprocess
import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from shipped_flights import FLOWN, missions, what_varies
from tumbling import flown, short

from casadi_gnc.campaigns.engines import VECTORS, CompiledBatch, best_vectors
from casadi_gnc.errors import CampaignError
from casadi_gnc.missions import metrics
from casadi_gnc.missions.one_build import fly_case
from casadi_gnc.missions.parameters import vary

KINDS = list(VECTORS)[: list(VECTORS).index(best_vectors()) + 1]


def few_quickly(names):
    """Return all names, of which the fast tests take the first two."""
    return [name if i < 2 else pytest.param(name, marks=pytest.mark.slow) for i, name in enumerate(names)]


def others():
    return [pytest.param(name, marks=pytest.mark.long) for name in missions() if name not in FLOWN]


@pytest.mark.parametrize("name", [*few_quickly(FLOWN), *others()])
def test_lanes_and_threads_have_the_words_of_single_flights(name):
    scheme, keys = what_varies(name)
    varied = vary(short(name, 60), keys, scheme)
    cases = 257  # no multiple of the lanes
    turns = np.sin(np.arange(cases * varied.parameters.size)).reshape(cases, -1)
    values, seeds = varied.parameters.nominal * (1 + 0.01 * turns), np.arange(cases, dtype=np.uint64) + 5
    runs = [CompiledBatch(varied, vectors=kind, threads=1).fly(values, seeds).words for kind in KINDS]
    runs.append(CompiledBatch(varied, threads=3).fly(values, seeds).words)
    assert all((words == runs[0]).all() for words in runs)
    batch = CompiledBatch(varied, vectors="none", threads=1).fly(values, seeds)
    alone = fly_case(varied, values[7], 12, decimation=10**9)
    timing, mission = varied.nominal.timing, varied.nominal
    last = (timing.samples - 1) * timing.sample_period
    read = metrics.read(tuple(mission.metrics), varied.tapes.tally, batch.tally[7], last, timing.sample_period)
    assert read == alone.metrics
    assert metrics.statuses(varied.tapes.tally, batch.tally[7]) == alone.statuses


@pytest.mark.slow
def test_one_engine_flies_for_several_threads_at_once():
    """Threads of a cluster's worker share it: in each call the on-board solver has a workspace of its own."""
    scheme, keys = what_varies("huang2020/slew")
    varied = vary(short("huang2020/slew", 60), keys, scheme)
    engine = CompiledBatch(varied, threads=1)
    values = varied.parameters.nominal * (1 + 0.01 * np.sin(np.arange(16.0)))[:, None]
    seeds = np.arange(16, dtype=np.uint64)
    alone, fly, used, both = engine.fly(values, seeds).words, engine._fly, set(), threading.Barrier(2)

    def meet(batch):
        both.wait()
        used.add(batch._obj.allocation_work)
        fly(batch)

    engine._fly = meet
    with ThreadPoolExecutor(2) as pool:
        found = list(pool.map(lambda _: engine.fly(values, seeds).words, range(2)))
    assert len(used) == 2
    assert all((words == alone).all() for words in found)


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


def test_a_case_depends_on_its_number_alone_whatever_the_split_and_the_threads(tmp_path, small_shards):
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
