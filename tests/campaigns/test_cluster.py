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
from pathlib import Path

import pytest

import casadi_gnc
from casadi_gnc.campaigns import DispersionTable
from casadi_gnc.errors import CampaignError

RATES = DispersionTable(key="initial.rate_rad_per_s", uniform=[-0.05, 0.05])


def flown(out, samples=400, flights=200, **options):
    mission = casadi_gnc.load("huang2020/detumble").with_scheme("observer_pinv")
    short = mission.with_timing(duration=samples * mission.timing.sample_period)
    return casadi_gnc.campaign(short, flights, dispersions=[RATES], out=out, **options)


def tables(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.fixture
def small_shards(monkeypatch):
    monkeypatch.setattr("casadi_gnc.campaigns.campaign._SHARD_SAMPLES", 400 * 16)


@pytest.fixture
def scheduler(tmp_path):
    """The address of a scheduler, and its process."""
    command = [sys.executable, "-m", "distributed.cli.dask_scheduler", "--port", "0", "--no-dashboard"]
    with (tmp_path / "scheduler.log").open("w") as log:
        process = subprocess.Popen([*command, "--host", "127.0.0.1"], stderr=log, cwd=tmp_path)
    try:
        for _ in range(300):
            found = re.search(r"Scheduler at: +(tcp://\S+)", (tmp_path / "scheduler.log").read_text())
            if found:
                break
            time.sleep(0.1)
        yield found[1], process
    finally:
        process.terminate()
        process.wait()


@pytest.mark.packages("distributed")
@pytest.mark.slow
def test_workers_make_the_table_of_threads_though_they_are_killed(tmp_path, monkeypatch):
    monkeypatch.setattr("casadi_gnc.campaigns.campaign._SHARD_SAMPLES", 15000 * 128)  # some tenths of a second each
    whole = {"samples": 15000, "flights": 1024}
    flown(tmp_path / "c", engine="c", **whole)
    killed, here = [], os.getpid()

    def told(done, of):
        if 0 < done < of and len(killed) < 3:  # each worker, and then one that was started in its place
            killed.append(worker(here, killed))
            os.kill(killed[-1], signal.SIGKILL)

    flown(tmp_path / "dask", engine="dask", threads=2, told=told, **whole)
    assert len(set(killed)) == 3
    assert tables(tmp_path / "dask") == tables(tmp_path / "c")


def worker(parent, but):
    """Return the process of a worker: one that was spawned by a process of ours, and is no tracker of resources."""
    while True:
        for place in Path("/proc").glob("[0-9]*"):
            try:
                line = (place / "cmdline").read_bytes().split(b"\0")
                owner = int((place / "stat").read_text().rsplit(")", 1)[1].split()[1])
            except (OSError, IndexError):
                continue
            if owner == parent and b"--multiprocessing-fork" in line and int(place.name) not in but:
                return int(place.name)
        time.sleep(0.05)


@pytest.mark.packages("distributed")
@pytest.mark.slow
def test_a_scheduler_elsewhere_gives_the_same_table_and_a_lost_one_is_told(
    tmp_path, small_shards, scheduler, monkeypatch
):
    monkeypatch.setattr("casadi_gnc.campaigns.cluster._PATIENCE", 4.0)
    scheduler, process = scheduler
    flown(tmp_path / "c", engine="c")
    with pytest.raises(CampaignError, match=f"the dask scheduler {scheduler} has no worker; start some"):
        flown(tmp_path / "none", engine="dask", scheduler=scheduler)
    command = [sys.executable, "-m", "distributed.cli.dask_worker", scheduler, "--nthreads", "2", "--no-dashboard"]
    worker = subprocess.Popen([*command, "--no-nanny"], stderr=subprocess.DEVNULL, cwd=tmp_path)
    try:
        said = []
        flown(tmp_path / "dask", engine="auto", scheduler=scheduler, said=said.append)
        assert said == [f"engine dask: its scheduler {scheduler} is given"]
        assert tables(tmp_path / "dask") == tables(tmp_path / "c")
        with pytest.raises(CampaignError, match="connection to the dask scheduler is lost; .*the same command goes on"):
            flown(
                tmp_path / "lost",
                engine="dask",
                scheduler=scheduler,
                told=lambda done, of: process.kill() if done > 0 else None,
            )
    finally:
        worker.terminate()
        worker.wait()
    flown(tmp_path / "lost", engine="c")
    assert tables(tmp_path / "lost") == tables(tmp_path / "c")


@pytest.mark.packages("distributed")
def test_a_scheduler_that_does_not_answer_is_one_sentence_and_exit_code_2(tmp_path, monkeypatch):
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{free.getsockname()[1]}"
    monkeypatch.setattr("casadi_gnc.campaigns.cluster._PATIENCE", 0.5)
    for wrong in (address, "nowhere"):
        with pytest.raises(CampaignError, match=f"the dask scheduler {wrong} does not answer") as error:
            flown(tmp_path / "mc", engine="dask", scheduler=wrong)
        assert "\n" not in str(error.value)
    assert threading.active_count() < 50
