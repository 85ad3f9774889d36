"""Engine dask: the tables of engine c, whatever becomes of the workers; a scheduler that is not there is told."""

from __future__ import annotations

import os
import re
import signal
import socket
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
from shipped_flights import missions, what_varies
from tumbling import flown, short, tables

import casadi_gnc
from casadi_gnc.campaigns import DispersionTable
from casadi_gnc.errors import CampaignError
from casadi_gnc.missions.parameters import vary

#: Seconds in which what happens in tenths of one must have happened, on a machine that does much else.
LONG_ENOUGH = 120.0


def waited(look):
    """Return the first answer of `look` that is true."""
    end = time.monotonic() + LONG_ENOUGH
    while not (found := look()):
        assert time.monotonic() < end, "it does not happen"
        time.sleep(0.05)
    return found


def program(name, *arguments, **options):
    quiet = ("--no-dashboard", "--dashboard-address", "127.0.0.1:0")  # pages on any free port
    return subprocess.Popen([sys.executable, "-m", f"distributed.cli.{name}", *arguments, *quiet], **options)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("cluster")


@pytest.fixture(scope="module")
def started(folder):
    """A function that starts a scheduler, and returns its address and its process."""
    processes = []

    def start():
        place = folder / f"scheduler-{len(processes)}.log"
        with place.open("w") as log:
            processes.append(program("dask_scheduler", "--port", "0", "--host", "127.0.0.1", stderr=log, cwd=folder))
        return waited(lambda: re.search(r"Scheduler at: +(tcp://\S+)", place.read_text()))[1], processes[-1]

    yield start
    for process in processes:
        process.terminate()
        process.wait()


@pytest.fixture(scope="module")
def working(folder):
    """A function that starts a worker of a scheduler, and waits until it works."""
    from distributed import Client

    processes = []

    def start(scheduler):
        options = ("--nthreads", "2", "--no-nanny")
        processes.append(program("dask_worker", scheduler, *options, stderr=subprocess.DEVNULL, cwd=folder))
        with Client(scheduler, timeout=LONG_ENOUGH, set_as_default=False) as client:
            client.wait_for_workers(1, timeout=LONG_ENOUGH)

    yield start
    for process in processes:
        process.terminate()
        process.wait()


def dispersions(name, scheme, keys):
    """Return what a mission's file disperses, or a hundredth of each number of some keys."""
    mission = casadi_gnc.load(name)
    if mission.dispersions:
        return mission.dispersions
    found = vary(mission, keys, scheme).parameters
    spread = 0.01 * np.abs(found.nominal) + 1e-6
    bounds = zip(found.nominal - spread, found.nominal + spread, strict=True)
    return [DispersionTable(key=key, uniform=[*map(float, each)]) for key, each in zip(found.keys, bounds, strict=True)]


@pytest.fixture(scope="module")
def cluster(started, working):
    """The address of a scheduler with a worker of two threads, for the whole file."""
    address, _ = started()
    working(address)
    return address


@pytest.mark.packages("distributed")
@pytest.mark.parametrize("name", [pytest.param(name, marks=pytest.mark.long) for name in missions()])
def test_every_mission_has_one_table_in_whatever_parts_it_is_flown(name, cluster, tmp_path, monkeypatch):
    """Serial scalar C, two parts on threads in lanes, and a cluster: the same bytes."""
    samples = 60
    monkeypatch.setattr("casadi_gnc.campaigns.cluster._ANSWER", LONG_ENOUGH)
    monkeypatch.setattr("casadi_gnc.campaigns.campaign._SHARD_SAMPLES", samples * 16)
    mission, (scheme, keys) = short(name, samples), what_varies(name)
    asked = {"scheme": scheme, "dispersions": dispersions(name, scheme, keys), "seed": 3}
    serial = casadi_gnc.campaign(mission, 260, out=tmp_path / "serial", vectors="none", threads=1, **asked)
    for part in (2, 1):
        casadi_gnc.campaign(mission, 260, out=tmp_path / "parts", shard=(part, 2), threads=3, **asked)
    casadi_gnc.campaign(mission, 260, out=tmp_path / "dask", engine="dask", scheduler=cluster, **asked)
    found = tables(tmp_path / "serial")
    assert len([each for each in found if each.startswith("shard-") and not each.endswith(".json")]) == 17
    assert tables(tmp_path / "parts") == found
    assert tables(tmp_path / "dask") == found
    assert serial.flew.sum() >= 256
    told = np.unique(serial.columns([each for each in serial.names if each.startswith("metric.")]), axis=0)
    assert len(told) > 1 or name == "tao2019/sweeps"  # which has no metric


@pytest.mark.packages("distributed")
@pytest.mark.slow
def test_workers_make_the_table_of_threads_though_they_are_killed(tmp_path, monkeypatch):
    import distributed

    monkeypatch.setattr("casadi_gnc.campaigns.campaign._SHARD_SAMPLES", 15000 * 128)  # some tenths of a second each
    whole = {"samples": 15000, "flights": 1024}
    flown(out=tmp_path / "c", engine="c", **whole)
    killed, clusters, local = [], [], distributed.LocalCluster

    def kept(**options):
        clusters.append(local(**options))
        return clusters[-1]

    def ready():
        """Return the processes of workers that have begun to work, but for those that were killed."""
        nannies = list(clusters[0].workers.values())
        running = [each.process for each in nannies if each.process and each.process.status.name == "running"]
        return [each.pid for each in running if each.pid not in {None, *killed}]

    def told(done, of):
        if 0 < done < of and len(killed) < 3:  # each worker, and then one that was started in its place
            killed.append(waited(ready)[0])
            os.kill(killed[-1], signal.SIGKILL)

    monkeypatch.setattr(distributed, "LocalCluster", kept)
    flown(out=tmp_path / "dask", engine="dask", threads=2, told=told, **whole)
    assert len(set(killed)) == 3
    assert tables(tmp_path / "dask") == tables(tmp_path / "c")


@pytest.mark.packages("distributed")
@pytest.mark.slow
def test_a_scheduler_elsewhere_gives_the_same_table_and_a_lost_one_is_told(
    tmp_path, small_shards, started, working, monkeypatch
):
    monkeypatch.setattr("casadi_gnc.campaigns.cluster._ANSWER", LONG_ENOUGH)
    scheduler, process = started()
    flown(out=tmp_path / "c", engine="c")
    with monkeypatch.context() as soon:
        soon.setattr("casadi_gnc.campaigns.cluster._WORKER", 0.5)
        with pytest.raises(CampaignError, match=f"the dask scheduler {scheduler} has no worker; start some"):
            flown(out=tmp_path / "none", engine="dask", scheduler=scheduler)
    working(scheduler)
    said = []
    flown(out=tmp_path / "dask", engine="auto", scheduler=scheduler, said=said.append)
    assert said == [f"engine dask: its scheduler {scheduler} is given"]
    assert tables(tmp_path / "dask") == tables(tmp_path / "c")
    with pytest.raises(CampaignError, match="connection to the dask scheduler is lost; .*the same command goes on"):
        flown(
            out=tmp_path / "lost",
            engine="dask",
            scheduler=scheduler,
            told=lambda done, of: process.kill() if done > 0 else None,
        )
    flown(out=tmp_path / "lost", engine="c")
    assert tables(tmp_path / "lost") == tables(tmp_path / "c")


@pytest.mark.packages("distributed")
def test_a_scheduler_that_does_not_answer_is_one_sentence_and_exit_code_2(tmp_path, monkeypatch):
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{free.getsockname()[1]}"
    monkeypatch.setattr("casadi_gnc.campaigns.cluster._ANSWER", 0.5)
    for wrong in (address, "nowhere"):
        with pytest.raises(CampaignError, match=f"the dask scheduler {wrong} does not answer") as error:
            flown(out=tmp_path / "mc", engine="dask", scheduler=wrong)
        assert "\n" not in str(error.value)
    assert threading.active_count() < 50
