"""Packages that several tests share: each is generated once a session."""

import atexit
import functools
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from casadi_gnc.delivery.packaging import generate
from casadi_gnc.embedded import boards

STRICT = ["-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-Wdouble-promotion", "-pedantic", "-Werror"]
C99 = ["-std=c99", "-Wmissing-prototypes", "-ffp-contract=off", "-fno-math-errno"]


@functools.cache
def made(
    problem: str, scheme: str, real: str = "float64", tunable: tuple[str, ...] = (), name: str = "", steps: int = 1024
):
    """Return the folder of a package; tests that change it take a copy."""
    folder = Path(tempfile.mkdtemp(prefix="package-")) / "package"
    atexit.register(shutil.rmtree, folder.parent, ignore_errors=True)
    generate(problem, folder, scheme=scheme, real=real, tunable=tunable, name=name or None, steps=steps)
    return folder


def copied(folder: Path, place: Path) -> Path:
    """Return a copy of a package that a test may change."""
    return Path(shutil.copytree(folder, place / "copy"))


def units(folder: Path) -> list[Path]:
    """Return the C files that fly."""
    return sorted(folder.glob("*.c"))


def run(*command, folder: Path | None = None, environment: dict | None = None) -> subprocess.CompletedProcess:
    """Run a command and return what it said."""
    return subprocess.run(
        [str(word) for word in command], cwd=folder, env=environment, capture_output=True, text=True, timeout=600
    )


#: What a package must not depend on: locale, time zone, seed of hashes, kernels of BLAS, which round otherwise.
SURROUNDINGS = (
    {"LC_ALL": "C", "TZ": "UTC", "PYTHONHASHSEED": "0", "OPENBLAS_CORETYPE": "Haswell"},
    {"LC_ALL": "de_DE.UTF-8", "TZ": "Asia/Tokyo", "PYTHONHASHSEED": "1", "OPENBLAS_CORETYPE": "Prescott"},
)


def made_in_surroundings(script: str, folder: Path) -> tuple[dict[Path, bytes], ...]:
    """Return the files that a script, which is told a folder as its argument, writes in each of them."""
    found = []
    for number, surroundings in enumerate(SURROUNDINGS):
        place = folder / str(number)
        done = run(sys.executable, "-c", script, place, environment={**os.environ, **surroundings})
        assert done.returncode == 0, done.stderr
        found.append({path.relative_to(place): path.read_bytes() for path in place.rglob("*") if path.is_file()})
    return tuple(found)


def needs_target(name: str) -> pytest.MarkDecorator:
    """Return the mark of a test that compiles for a target and runs in its emulator."""
    target = boards.find(name)
    return pytest.mark.tools(target.compiler, target.emulator[0])
