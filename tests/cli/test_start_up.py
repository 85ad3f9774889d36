"""What a command costs before it does anything: what it imports, and its processor time."""

import os
import resource
import subprocess
import sys

import pytest

PROGRAM = [sys.executable, "-m", "casadi_gnc.cli.main"]


def imported(tmp_path, *words: str) -> set[str]:
    """Return the modules that a command has imported when it ends."""
    told = "import atexit, sys; atexit.register(lambda: print(*sys.modules, file=open('modules', 'w')))\n"
    code = f"{told}sys.argv[1:] = {list(words)!r}\nfrom casadi_gnc.cli.main import main\nmain()"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=tmp_path, timeout=300)
    assert done.returncode == 0, done.stderr
    return set((tmp_path / "modules").read_text().split())


def test_help_imports_no_mathematics(tmp_path):
    assert not imported(tmp_path, "--help") & {"numpy", "casadi", "scipy", "pydantic", "rich", "matplotlib"}


def test_a_flight_imports_what_it_needs_alone(tmp_path):
    flying = ("fly", "huang2020/detumble", "--scheme", "damping_pinv", "--out", "out")
    imported(tmp_path, *flying)  # its library is compiled now
    found = imported(tmp_path, *flying)
    assert "casadi" in found
    assert not found & {"matplotlib", "scipy.optimize", "clarabel", "scs"}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "most"), [(("--help",), 0.2), (("fly", "huang2020/detumble", "--out", "out"), 2.0)], ids=["help", "fly"]
)
def test_processor_time(words, most, tmp_path):
    """The best of some, each with compiled modules and flight libraries as any second run has them [s]."""
    own = dict(os.environ, PYTHONPYCACHEPREFIX=str(tmp_path / "compiled"))
    own.pop("PYTHONDONTWRITEBYTECODE", None)
    taken = []
    while len(taken) < 7 and min(taken, default=most) >= most:
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([*PROGRAM, *words], check=True, capture_output=True, cwd=tmp_path, env=own, timeout=300)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        taken.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    assert min(taken) < most
