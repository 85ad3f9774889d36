"""A folder changes at one moment, and what is somebody else's stays what and where it was: no copy."""

import os
import shutil
import signal
import subprocess
import sys
import time

import pytest

from casadi_gnc.system import exchange

OURS = {"a.c": "old", "test/b.c": "old", "gone.c": "old", "last.json": "old"}
NEW = {"a.c": "new", "test/b.c": "new", "added.c": "new", "last.json": "new"}


def written(folder, files):
    for path, text in files.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(text)
    return folder


def listing(folder):
    return {path.relative_to(folder).as_posix(): path.read_text() for path in folder.rglob("*") if path.is_file()}


@pytest.fixture(params=["at one moment", "file by file", "without links"])
def way(request, monkeypatch):
    """As it is here; as on systems that cannot exchange names; as on disks that know no second names."""
    if request.param == "file by file":
        monkeypatch.setattr(exchange, "_exchange", lambda *_: False)
    if request.param == "without links":

        def refuse(*_):
            raise OSError("no links")

        monkeypatch.setattr(exchange.os, "link", refuse)
    return request.param


def test_ours_are_replaced_and_others_stay(way, tmp_path):
    folder = written(tmp_path / "package", OURS)
    mine = {"notes.txt": "mine", "test/mine.c": "mine", ".git/HEAD": "mine"}
    written(folder, mine)
    (folder / "empty").mkdir()
    (folder / "link").symlink_to("nowhere")
    before = {path: (folder / path).stat().st_ino for path in mine}
    fresh = written(tmp_path / "fresh", NEW)
    exchange.replace_folder(fresh, folder, OURS, "last.json")
    assert listing(folder) == {**NEW, **mine}
    assert (folder / "empty").is_dir()
    assert os.readlink(folder / "link") == "nowhere"
    if way != "without links":
        assert {path: (folder / path).stat().st_ino for path in mine} == before
    if fresh.exists():
        shutil.rmtree(fresh)  # what was replaced; nothing of the others' depends on it
    assert listing(folder) == {**NEW, **mine}


def test_a_file_of_others_under_a_name_that_becomes_ours_is_not_lost(way, tmp_path):
    """The new folder has a file where somebody put his own: his is found in what was replaced, or stays."""
    folder = written(tmp_path / "package", {**OURS, "added.c": "mine"})
    fresh = written(tmp_path / "fresh", NEW)
    exchange.replace_folder(fresh, folder, OURS, "last.json")
    assert (folder / "added.c").read_text() == "mine" or (fresh / "added.c").read_text() == "mine"


@pytest.mark.parametrize("there", [False, True])
def test_nothing_or_an_empty_folder_is_replaced(there, tmp_path):
    folder = tmp_path / "package"
    if there:
        folder.mkdir()
    exchange.replace_folder(written(tmp_path / "fresh", NEW), folder, (), "last.json")
    assert listing(folder) == NEW


def test_a_folder_that_cannot_be_exchanged_stays(tmp_path, monkeypatch):
    folder = written(tmp_path / "package", OURS)

    def refuse(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(exchange, "_exchange", refuse)
    with pytest.raises(OSError, match="No space left"):
        exchange.replace_folder(written(tmp_path / "fresh", NEW), folder, OURS, "last.json")
    assert listing(folder) == OURS


LOOP = """
import sys, shutil
from pathlib import Path
from casadi_gnc.system.exchange import replace_folder
folder, fresh = Path(sys.argv[1]), Path(sys.argv[2])
print("on", flush=True)
for k in range(10**6):
    shutil.rmtree(fresh, ignore_errors=True)
    fresh.mkdir()
    for name in ("a", "b", "last"):
        (fresh / name).write_text(str(k))
    replace_folder(fresh, folder, ["a", "b"], "last")
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="only Linux is sure to exchange names at one moment")
def test_a_kill_at_any_moment_leaves_one_whole_folder(tmp_path):
    folder = written(tmp_path / "package", {"a": "-", "b": "-", "last": "-", "mine": "mine"})
    seen = set()
    for k in range(25):
        run = subprocess.Popen(
            [sys.executable, "-c", LOOP, folder, tmp_path / "fresh"], stdout=subprocess.PIPE, text=True
        )
        run.stdout.readline()
        time.sleep(0.03 + 0.007 * k)
        run.send_signal(signal.SIGKILL)
        run.wait()
        run.stdout.close()
        found = listing(folder)
        assert found.pop("mine") == "mine"
        assert len(found) == 3
        assert len(set(found.values())) == 1, found
        seen.update(found.values())
    assert len(seen) > 3  # the moments were different ones
