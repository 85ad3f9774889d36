"""Commands that are killed at any moment, a hundred times each: nothing half done, nothing lost, nobody left behind.

Truth: what an undisturbed run leaves, the user's own files, and the system's list of processes. What a kill leaves over
is gone after the next run. The moments are spread over the whole length of a run by a fixed seed.
"""

import contextlib
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

import casadi_gnc
from casadi_gnc.embedded import package

#: Seconds in which processes that work for a killed one must be gone; a compiler of one file ends by itself.
PATIENCE = 20.0
CLAIMS = """
format = 1
kind = "claims"
paper = "a paper"
doi = "10.1/1"
[[claim]]
id = "cube"
text = "the largest cube"
where = "here"
printed = 5.16e-4
tolerance = 0.01
computation = { name = "huang2020.attainable_cube" }
[[claim]]
id = "speed"
text = "the first speed"
where = "here"
printed = 1.0
flight = { problem = "sun2018/circular_orbit", scheme = "tracking", changes = { "timing.duration_s" = 1.0 } }
metric = { kind = "peak", signal = "velocity_error" }
"""


def of_session(session: int) -> list[int]:
    """Return the living processes of a session."""
    found = []
    for place in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError, ValueError, IndexError):
            fields = (place / "stat").read_text().rpartition(")")[2].split()
            if fields[0] not in "ZX" and int(fields[3]) == session:
                found.append(int(place.name))
    return found


def parsed(path: Path) -> bool:
    """Tell whether a file is whole: JSON, by lines where it is one of lines, a page, a picture, a table of numbers."""
    if path.suffix == ".json":
        json.loads(path.read_text())
    elif path.suffix == ".jsonl":  # the last line may be cut, as long as the next run mends it
        for line in path.read_text().splitlines()[:-1]:
            json.loads(line)
    elif path.suffix == ".npz":
        with np.load(path) as content:
            _ = {name: content[name] for name in content}
    elif path.suffix == ".html":
        assert path.read_text().rstrip().endswith("</html>"), path
    elif path.suffix in (".svg", ".png"):
        content = path.read_bytes()
        assert content.rstrip().endswith((b"</svg>", b"IEND\xaeB`\x82")), path
    return True


@dataclass
class Case:
    """A command, what it starts from, and what must hold after it was killed."""

    words: tuple[str, ...]
    begin: Callable[[Path], None] = lambda place: None
    holds: Callable[[Path], None] = lambda place: None
    #: Words of each run in turn, where two runs must not be the same.
    turns: tuple[tuple[str, ...], ...] = field(default=((),))
    kills: int = 100
    #: The command goes on with a folder that is there; it is taken away before every second run.
    goes_on: bool = False

    def renew(self, place: Path) -> None:
        if self.goes_on:
            shutil.rmtree(place / "out", ignore_errors=True)


def with_package(place: Path) -> None:
    casadi_gnc.generate("huang2020/slew", place / "pk", scheme="pd_pinv", steps=40)
    (place / "pk" / "notes.txt").write_text("mine")
    (place / "pk" / "mine").mkdir()
    (place / "pk" / "mine" / "more.txt").write_text("mine too")


def package_is_whole(place: Path) -> None:
    """The old package or the new one, and the user's files beside it."""
    strange = package.edited(place / "pk")
    assert strange == ["mine/more.txt (added)", "notes.txt (added)"], strange
    assert (place / "pk" / "notes.txt").read_text() == "mine"
    assert (place / "pk" / "mine" / "more.txt").read_text() == "mine too"


def fresh_package_is_whole(place: Path) -> None:
    """All of it, or nothing."""
    assert not (place / "pk").exists() or package.edited(place / "pk") == []


def files_are_whole(place: Path) -> None:
    assert all(parsed(path) for path in (place / "out").rglob("*") if path.is_file() and path.name[0] != ".")


GENERATE = ("generate", "huang2020/slew", "--scheme", "pd_pinv", "--out", "pk")
CASES = {
    "generate": Case(GENERATE, with_package, package_is_whole, (("--steps", "40"), ("--steps", "41"))),
    "generate anew": Case((*GENERATE, "--steps", "40"), holds=fresh_package_is_whole, kills=25),
    "fmu": Case((*GENERATE[:-1], "out/slew.fmu", "--format", "fmu"), kills=25),
    "reproduce": Case(
        ("reproduce", "claims.toml", "--fresh", "--out", "out"),
        lambda place: (place / "claims.toml").write_text(CLAIMS) and None,
        files_are_whole,
    ),
    "synthesize": Case(("synthesize", "shi2020/synthesis", "--json")),
    "bench": Case(
        ("bench", "allocation", "benchmarks/plain", "--backends", "online", "--samples", "2", "--passes", "1",
         "--out", "out"),
        holds=files_are_whole,
        goes_on=True,
    ),
    "campaign": Case(
        ("campaign", "sun2018/circular_orbit", "--flights", "3", "--out", "out", "--audit", "0"),
        holds=files_are_whole,
        goes_on=True,
    ),
}  # fmt: skip


def start(place: Path, words: tuple[str, ...]) -> subprocess.Popen:
    known = {**os.environ, "PYTHONPATH": str(Path(casadi_gnc.__file__).parents[1])}
    known |= {"CASADI_GNC_CACHE": str(place / "cache"), "TMPDIR": str(place / "temporary")}
    command = [sys.executable, "-m", "casadi_gnc.cli.main", *words]
    return subprocess.Popen(
        command, cwd=place, env=known, start_new_session=True, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
    )


def left_over(place: Path) -> list[str]:
    found = [path for path in place.rglob("*") if "casadi-gnc-temporary" in path.name]
    return [str(path) for path in [*found, *(place / "temporary").iterdir()]]


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
@pytest.mark.parametrize(
    "share", [pytest.param(0.08, marks=pytest.mark.slow), pytest.param(1.0, marks=pytest.mark.long)]
)
@pytest.mark.parametrize("name", CASES)
def test_killed_at_any_moment(name, share, tmp_path):
    case, rng = CASES[name], np.random.default_rng(2020)
    kills = max(6, round(share * case.kills))
    (tmp_path / "temporary").mkdir()
    case.begin(tmp_path)
    for _ in range(2):  # the first compiles what the cache keeps then
        case.renew(tmp_path)
        since = time.monotonic()
        with start(tmp_path, (*case.words, *case.turns[0])) as run:
            assert run.wait() == 0, run.stderr.read()
    length, killed = time.monotonic() - since, 0
    case.holds(tmp_path)
    for k in range(kills):
        if k % 2:
            case.renew(tmp_path)
        with start(tmp_path, (*case.words, *case.turns[k % len(case.turns)])) as run:
            with contextlib.suppress(subprocess.TimeoutExpired):
                run.wait(length * rng.random())
            killed += run.poll() is None
            run.send_signal(signal.SIGKILL)
            run.wait()
            until = time.monotonic() + PATIENCE
            while (left := of_session(run.pid)) and time.monotonic() < until:
                time.sleep(0.02)
            for process in left:
                os.kill(process, signal.SIGKILL)
            assert left == [], f"kill {k} left processes"
        case.holds(tmp_path)
    assert killed >= kills / 4  # the others had ended before
    with start(tmp_path, (*case.words, *case.turns[0])) as run:
        assert run.wait() == 0, run.stderr.read()
    case.holds(tmp_path)
    assert left_over(tmp_path) == []
