"""Machines that lack something: a home, a user's name, room, the right to write or to run what was built.

Truth: an answer does not depend on where libraries are built, so it is the one of a sound machine; where nothing can be
built there is one sentence, exit code 2, that names the folders and the variables that choose others. The folders are
file systems of their own, mounted in a name space that only the command sees.
"""

import functools
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

import casadi_gnc

#: A user number that no list of users has, and no home: what a container is started with.
UNKNOWN_USER = """
import pwd
def nobody(*_): raise KeyError("no such user")
pwd.getpwuid = pwd.getpwnam = nobody
"""
RUN = "from casadi_gnc.cli.main import main; main()"
COMMANDS = "u1,u2,u3\n1e-4,2e-4,-3e-4\n"
ALLOCATE = ("allocate", "huang2020/allocation", "--commands", "u.csv")
GENERATE = ("generate", "huang2020/slew", "--scheme", "pd_pinv", "--steps", "40", "--out", "pk")
UNIT = ("generate", "huang2020/slew", "--scheme", "pd_pinv", "--format", "fmu", "--out", "pk.fmu")


def can_mount():
    if shutil.which("unshare") is None:
        return False
    tried = ["unshare", "-m", "sh", "-c", "mount -t tmpfs -o size=64k tmpfs /tmp"]
    return subprocess.run(tried, capture_output=True).returncode == 0


@pytest.fixture
def place(tmp_path):
    """Return a working folder with a table of commands, and folders to mount on."""
    (tmp_path / "u.csv").write_text(COMMANDS)
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
    return tmp_path


def run(place, words, *, mounts=None, prelude="", **variables):
    """Run a command; `mounts` are options of file systems by folder: "full" is one without room."""
    known = {key: value for key, value in os.environ.items()
             if key not in ("HOME", "XDG_CACHE_HOME", "CASADI_GNC_CACHE", "TMPDIR", "TEMP", "TMP")}  # fmt: skip
    known |= {"PYTHONPATH": str(Path(casadi_gnc.__file__).parents[1]), "PYTHONDONTWRITEBYTECODE": "1", **variables}
    command = [sys.executable, "-c", prelude + RUN, *words]
    if mounts:
        script = ["set -e"]
        for folder, options in mounts.items():
            room = "size=16k" if options == "full" else options
            script.append(f"mount -t tmpfs -o {room} tmpfs {folder}")
            if options == "full":
                script.append(f"dd if=/dev/zero of={folder}/filler bs=4k count=8 2>/dev/null || true")
        command = ["unshare", "-m", "sh", "-c", "\n".join([*script, 'exec "$@"']), "sh", *command]
    return subprocess.run(command, cwd=place, env=known, capture_output=True, text=True, timeout=300)


@functools.cache
def answer():
    place = Path(tempfile.mkdtemp(prefix="answer-"))
    (place / "u.csv").write_text(COMMANDS)
    done = run(place, ALLOCATE, CASADI_GNC_CACHE=str(place / "sound"))
    shutil.rmtree(place)
    assert done.returncode == 0, done.stderr
    return done.stdout


def assert_sentence(done, *words):
    assert done.returncode == 2, done.stdout + done.stderr
    assert done.stderr.startswith("casadi-gnc: ")
    assert done.stderr.count("\n") == 1, done.stderr
    for word in words:
        assert str(word) in done.stderr


@pytest.mark.slow
def test_no_home_and_an_unknown_user(place):
    assert run(place, ALLOCATE, prelude=UNKNOWN_USER).stdout == answer()
    assert run(place, ALLOCATE, prelude=UNKNOWN_USER, HOME="").stdout == answer()
    done = run(place, ("doctor",), prelude=UNKNOWN_USER)
    assert done.returncode == 0, done.stderr
    done = run(place, GENERATE, prelude=UNKNOWN_USER)
    assert done.returncode == 0, done.stderr


@pytest.mark.slow
def test_a_home_that_is_not_there(place):
    assert run(place, ALLOCATE, HOME="/nonexistent").stdout == answer()


def test_no_temporary_folder_is_needed_where_the_cache_serves(place):
    assert run(place, ALLOCATE, TMPDIR="/nonexistent", CASADI_GNC_CACHE=str(place / "a")).stdout == answer()


@pytest.mark.tools("mount", "unshare")
@pytest.mark.skipif(not can_mount(), reason="no file system can be mounted here")
class TestFileSystems:
    @pytest.mark.parametrize("options", ["noexec", "ro", "full", "size=1m"])
    def test_another_folder_serves(self, options, place):
        """Of cache and temporary folder one is sound; the other does not let run, is read-only or full, or fills up."""
        bad, good = str(place / "a"), str(place / "b")
        for words, cache, temporary in ((ALLOCATE, bad, good), (GENERATE, good, bad), (UNIT, good, bad)):
            done = run(place, words, mounts={bad: options}, CASADI_GNC_CACHE=cache, TMPDIR=temporary)
            assert done.returncode == 0, (words, done.stderr)
            assert words is not ALLOCATE or done.stdout == answer()

    @pytest.mark.parametrize(
        ("options", "cause"),
        [("noexec", "mounted noexec"), ("size=1m", "no space left")],
    )
    def test_no_folder_serves(self, options, cause, place):
        bad, worse = str(place / "a"), str(place / "b")
        for words in (ALLOCATE, GENERATE, UNIT):
            done = run(place, words, mounts={bad: options, worse: options}, CASADI_GNC_CACHE=bad, TMPDIR=worse)
            assert_sentence(done, cause, "TMPDIR", "to ")
            assert bad in done.stderr or worse in done.stderr
            assert "--out" not in done.stderr
            assert not (place / "pk").exists()
            assert not (place / "pk.fmu").exists()

    def test_an_output_folder_without_room(self, place):
        out = place / "a"
        done = run(
            place, (*GENERATE[:-1], str(out / "pk")), mounts={str(out): "full"}, CASADI_GNC_CACHE=str(place / "b")
        )
        assert_sentence(done, out / "pk", "No space left on device", "--out")

    def test_a_cache_that_was_filled_and_is_read_only_now(self, place):
        """What is in it is used; nothing needs to be built."""
        cache = place / "a"
        done = run(place, ALLOCATE, CASADI_GNC_CACHE=str(cache))
        built = [path.name for path in cache.iterdir()]
        assert built
        script = f'mount --bind {cache} {cache} && mount -o remount,bind,ro {cache} && exec "$@"'
        done = subprocess.run(
            ["unshare", "-m", "sh", "-c", script, "sh", sys.executable, "-c", RUN, *ALLOCATE],
            cwd=place, capture_output=True, text=True,
            env={**os.environ, "CASADI_GNC_CACHE": str(cache), "CC": "", "TMPDIR": "/nonexistent"},
        )  # fmt: skip
        assert done.stdout == answer(), done.stderr
        assert [path.name for path in cache.iterdir()] == built
