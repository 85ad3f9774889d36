"""A process that runs foreign code may do what it likes: whoever asked gets an answer or a sentence, in time.

Truth: what each function below does, and the system's list of processes.
"""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import casadi_gnc
from casadi_gnc.errors import PackageError
from casadi_gnc.system import apart

FOREIGN = """
import os, sys, time
from pathlib import Path
from casadi_gnc.errors import PackageError

def add(shop, given):
    print("to nobody", file=sys.stderr)
    return {"sum": sum(given["numbers"]), "where": os.getpid()}

def refuse(shop, given):
    raise PackageError("not so")

def fail(shop, given):
    raise KeyError("inside")

def crash(shop, given):
    os.abort()

def leave(shop, given):
    os._exit(0)

def hang(shop, given):
    (shop / "began").write_text(str(os.getpid()))
    while True:
        pass

def leave_a_child(shop, given):
    if os.fork() == 0:
        (shop / "child").write_text(str(os.getpid()))
        time.sleep(60)
    while not (shop / "child").exists():
        time.sleep(0.01)

def lie(shop, given):
    (shop / "answer.json").write_bytes(bytes.fromhex(given["answer"]))
    os._exit(0)

def flood(shop, given):
    (shop / "answer.json").write_text('{"found": "' + "x" * 2**25 + '"}')
    os._exit(0)
"""


@pytest.fixture
def call(tmp_path, monkeypatch):
    (tmp_path / "foreign.py").write_text(FOREIGN)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    shop = tmp_path / "shop"
    shop.mkdir()

    def ask(name, given=None, limit=60.0):
        return apart.call(f"foreign:{name}", shop, given or {}, limit=limit)

    return ask


def is_alive(process):
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
    except OSError:
        return False


def gone(process, within=10.0):
    until = time.monotonic() + within
    while is_alive(process) and time.monotonic() < until:
        time.sleep(0.02)
    return not is_alive(process)


def test_an_answer_comes_from_another_process(call, capfd):
    found = call("add", {"numbers": [1, 2, 3.5]})
    assert found["sum"] == 6.5
    assert found["where"] != os.getpid()
    assert capfd.readouterr() == ("", "")


def test_errors_keep_their_kind_and_sentence(call):
    with pytest.raises(PackageError, match="^not so$"):
        call("refuse")
    with pytest.raises(apart.ApartError, match="^failed: KeyError: 'inside'$"):
        call("fail")


@pytest.mark.parametrize(
    ("name", "sentence"),
    [("crash", "was ended by SIGABRT"), ("leave", "ended with code 0 and without an answer"),
     ("flood", "without an answer"), ("nothing", "failed: AttributeError")],
)  # fmt: skip
def test_what_gives_no_answer_is_a_sentence(name, sentence, call):
    with pytest.raises(apart.ApartError, match=sentence):
        call(name)


@pytest.mark.parametrize(
    "answer", [b"", b"[]", b"null", b"\xff", b"[" * 100_000, b'{"error": "Exception", "said": "x"}', b'{"error": 3}']
)
def test_lies_are_no_answers(answer, call):
    with pytest.raises(apart.ApartError):
        call("lie", {"answer": answer.hex()})


def test_an_old_answer_is_not_taken_for_a_new_one(call):
    assert call("add", {"numbers": [1]})["sum"] == 1
    with pytest.raises(apart.ApartError, match="without an answer"):
        call("leave")


@pytest.mark.slow
def test_what_does_not_end_is_ended(call, tmp_path):
    since = time.monotonic()
    with pytest.raises(apart.ApartError, match="did not end within 4 s"):
        call("hang", limit=4.0)
    assert time.monotonic() - since < 20.0
    if sys.platform == "linux":
        assert gone(int((tmp_path / "shop" / "began").read_text()))


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_what_a_process_started_ends_with_it(call, tmp_path):
    call("leave_a_child")
    assert gone(int((tmp_path / "shop" / "child").read_text()))


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_it_ends_with_the_process_that_asked(call, tmp_path):
    shop = tmp_path / "shop"
    code = f"""
from pathlib import Path
from casadi_gnc.system import apart
apart.call("foreign:hang", Path({str(shop)!r}), {{}}, limit=60)
"""
    known = {**os.environ, "PYTHONPATH": f"{tmp_path}:{Path(casadi_gnc.__file__).parents[1]}"}
    run = subprocess.Popen([sys.executable, "-c", code], env=known)
    while not (shop / "began").exists() or not (shop / "began").read_text():
        time.sleep(0.02)
        assert run.poll() is None
    run.send_signal(signal.SIGKILL)
    run.wait()
    assert gone(int((shop / "began").read_text()))


def test_files_of_the_folder_are_no_modules(call, tmp_path):
    """A package may have a file that is called as a module of Python is."""
    for name in ("json", "casadi_gnc", "numpy", "sitecustomize"):
        (tmp_path / "shop" / f"{name}.py").write_text("open('trace', 'w').close()\n")
    assert call("add", {"numbers": [2]})["sum"] == 2
    assert not (tmp_path / "shop" / "trace").exists()
