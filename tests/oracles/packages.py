"""Packages that several tests share: each is generated once a session."""

import atexit
import functools
import shutil
import subprocess
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


def needs_target(name: str) -> pytest.MarkDecorator:
    """Return the mark of a test that compiles for a target and runs in its emulator."""
    target = boards.find(name)
    return pytest.mark.tools(target.compiler, target.emulator[0])
