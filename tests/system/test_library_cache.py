"""What is loaded is what was built: entries that were cut short, changed, or that others can write are built again.

Truth: a function that returns 42; a library in whose place somebody put one that returns 13.
"""

import ctypes
import json
import os
import shutil
import signal
import stat
import subprocess
import sys
import time
from pathlib import Path

import pytest

import casadi_gnc
from casadi_gnc.system import assets, compilers, folders, library_cache, temporary

SOURCE = "int answer(void);\nint answer(void) { return 42; }\n"
INCLUDE = assets.folder("codegen") / "runtime"
ASK = f"""
from pathlib import Path
from casadi_gnc.system import compilers
import logging; logging.basicConfig(format="casadi-gnc: %(message)s")
library = compilers.load({SOURCE!r}, include=Path({str(INCLUDE)!r}))
print(library.answer())
"""


@pytest.fixture
def own(tmp_path):
    folder = tmp_path / "cache"
    folder.mkdir(mode=0o700)
    return folder


def ask(own, **variables):
    """Return answer and complaint of a fresh process."""
    known = {**os.environ, "PYTHONPATH": str(Path(casadi_gnc.__file__).parents[1]), "CASADI_GNC_CACHE": str(own)}
    return subprocess.run([sys.executable, "-c", ASK], env={**known, **variables}, capture_output=True, text=True)


def library(own):
    (found,) = own.glob("*.so")
    return found


@pytest.fixture(scope="module")
def poison(tmp_path_factory):
    place = tmp_path_factory.mktemp("poison")
    (place / "a.c").write_text(SOURCE.replace("42", "13"))
    subprocess.run(["gcc", "-shared", "-fPIC", "-o", place / "a.so", place / "a.c"], check=True)
    assert ctypes.CDLL(str(place / "a.so")).answer() == 13
    return (place / "a.so").read_bytes()


def cut(path):
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def flip(path):
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(bytes(content))


@pytest.mark.parametrize("damage", [cut, flip, lambda path: path.write_bytes(b""), Path.unlink])
def test_a_damaged_library_is_built_again(damage, own):
    assert ask(own).stdout == "42\n"
    whole = library(own).read_bytes()
    damage(library(own))
    done = ask(own)
    assert (done.returncode, done.stdout) == (0, "42\n"), done.stderr
    assert library(own).read_bytes() == whole
    assert ask(own).stderr == ""


def test_another_library_in_its_place_is_not_loaded(own, poison):
    assert ask(own).stdout == "42\n"
    library(own).write_bytes(poison)
    done = ask(own)
    assert done.stdout == "42\n"
    assert "is not as it was built; it is not used, and built again" in done.stderr


@pytest.mark.parametrize(
    "record",
    ["", "[]", "{}", '{"sha256": 3}', '{"size": 1, "sha256": "../../x"}', "\ud800", '{"size": "1", "sha256": ""}'],
)
def test_a_record_that_is_none(record, own):
    assert ask(own).stdout == "42\n"
    (place,) = own.glob("*.json")
    before = place.read_text()
    place.write_bytes(record.encode("utf-8", "surrogatepass"))
    done = ask(own)
    assert (done.returncode, done.stdout) == (0, "42\n"), done.stderr
    assert place.read_text() == before


def test_only_the_user_may_look_into_it(tmp_path):
    own = tmp_path / "deep" / "cache"
    assert ask(own).stdout == "42\n"
    assert stat.S_IMODE(own.stat().st_mode) == 0o700
    assert {stat.S_IMODE(path.stat().st_mode) for path in own.glob("*.so")} == {0o700}


@pytest.mark.parametrize("mode", [0o777, 0o770, 0o722])
def test_a_folder_that_others_can_write_is_not_used(mode, own, poison):
    """Neither what lies in it nor what was once built there."""
    assert ask(own).stdout == "42\n"
    place = library(own)
    place.write_bytes(poison)
    record = {"size": len(poison), "sha256": library_cache._digest(place)}
    key = place.name.split("-")[0]
    (own / f"{key}.json").write_text(json.dumps(record))
    place.rename(own / library_cache._name(key, record["sha256"]))
    assert ask(own).stdout == "13\n"  # its own user may put there what he likes
    own.chmod(mode)
    before = sorted(path.name for path in own.iterdir())
    done = ask(own)
    assert done.stdout == "42\n"
    assert f"the cache {own} can be written by others (its mode is {mode:o}): nothing in it is used" in done.stderr
    assert sorted(path.name for path in own.iterdir()) == before


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give a folder away")
def test_a_folder_of_somebody_else_is_not_used(own):
    assert ask(own).stdout == "42\n"
    os.chown(own, 12345, 12345)
    done = ask(own)
    assert done.stdout == "42\n"
    assert f"the cache {own} belongs to another user: nothing in it is used" in done.stderr


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give a file away")
def test_a_library_of_somebody_else_is_not_used(own):
    assert ask(own).stdout == "42\n"
    os.chown(library(own), 12345, 12345)
    assert "is not used, and built again" in ask(own).stderr
    assert library(own).stat().st_uid == 0


def test_of_a_shared_folder_a_private_part_is_used(own):
    """As /tmp is shared: all may write, each only touch what is their own."""
    own.chmod(0o1777)
    done = ask(own)
    assert (done.stdout, done.stderr) == ("42\n", "")
    (part,) = own.iterdir()
    assert stat.S_IMODE(part.stat().st_mode) == 0o700
    assert library(part)
    part.chmod(0o777)
    assert f"the cache {part} can be written by others" in ask(own).stderr


def test_a_library_of_another_machine_is_built_again(own, monkeypatch):
    """Its hash is right, and still it cannot be loaded."""
    monkeypatch.setenv("CASADI_GNC_CACHE", str(own))
    place = compilers.compiled(SOURCE, include=INCLUDE)
    real, asked = ctypes.CDLL, []

    def picky(path):
        asked.append(path)
        if len(asked) == 1:
            raise OSError("wrong ELF class")
        return real(path)

    monkeypatch.setattr(compilers.ctypes, "CDLL", picky)
    assert compilers.load(SOURCE, include=INCLUDE).answer() == 42
    assert asked == [str(place)] * 2


KILLED = """
import sys, time
from pathlib import Path
from casadi_gnc.system import temporary
with temporary.folder(Path(sys.argv[1])) as a, temporary.file(Path(sys.argv[1]), "record", ".csv") as b:
    (a / "inside").write_text("x"); b.write_text("half")
    print(a, b, flush=True)
    time.sleep(60)
"""


def test_what_a_killed_process_leaves_is_swept(tmp_path):
    """Not before it is dead, and nothing that somebody else gave a name like ours."""
    mine = [tmp_path / name for name in ("casadi-gnc-examples", "casadi-gnc-temporary-mine", ".record.casadi-gnc.csv")]
    for path in mine:
        path.mkdir()
    run = subprocess.Popen([sys.executable, "-c", KILLED, str(tmp_path)], stdout=subprocess.PIPE, text=True)
    left = [Path(name) for name in run.stdout.readline().split()]
    assert all(path.exists() for path in left)
    assert stat.S_IMODE(left[0].stat().st_mode) == 0o700
    temporary._swept.clear()
    assert temporary.sweep(tmp_path) == []
    run.send_signal(signal.SIGKILL)
    run.wait()
    run.stdout.close()
    temporary._swept.clear()
    with temporary.folder(tmp_path) as fresh:
        assert sorted(tmp_path.iterdir()) == sorted([*mine, fresh])
    assert sorted(tmp_path.iterdir()) == sorted(mine)


def test_a_killed_build_leaves_nothing_for_ever(own, tmp_path):
    slow = tmp_path / "slowcc"
    slow.write_text('#!/bin/sh\n[ "$1" = --version ] && echo "slow 1" && exit\nsleep 30\n')
    slow.chmod(0o755)
    known = {**os.environ, "CASADI_GNC_CACHE": str(own), "CC": str(slow)}
    run = subprocess.Popen([sys.executable, "-c", ASK], env=known, start_new_session=True, stderr=subprocess.DEVNULL)
    while not list(own.glob("casadi-gnc-temporary-*")):
        time.sleep(0.01)
        assert run.poll() is None
    os.killpg(run.pid, signal.SIGKILL)
    run.wait()
    assert list(own.glob("casadi-gnc-temporary-*"))
    assert ask(own).stdout == "42\n"
    assert not list(own.glob("casadi-gnc-temporary-*"))


def test_private_folders_go_with_their_process(own):
    own.chmod(0o777)
    place = own.parent / "temporary"
    place.mkdir()
    assert ask(own, TMPDIR=str(place)).stdout == "42\n"
    assert list(place.iterdir()) == []
    shutil.rmtree(place)


def test_a_folder_is_ours_or_not(tmp_path):
    assert folders.not_ours(tmp_path / "nothing") is None
    assert folders.not_ours(tmp_path) is None
    tmp_path.chmod(0o720)
    assert folders.not_ours(tmp_path) == "can be written by others (its mode is 720)"
    tmp_path.chmod(0o700)
