"""Back ends are imported when first used, and print nothing."""

import os
import subprocess
import sys
from importlib import metadata
from pathlib import Path

import pytest
from installed_backends import NAMES, need, oracle

from casadi_gnc.allocation import backends


def run(code: str, *arguments: str) -> subprocess.CompletedProcess:
    folder = {"PYTHONPATH": str(Path(oracle.__file__).parent)}
    command = [sys.executable, "-c", code, *arguments]
    return subprocess.run(command, capture_output=True, text=True, env={**os.environ, **folder})


def test_solvers_are_imported_when_first_used():
    heavy = ["clarabel", "cvxpy", "daqp", "highspy", "osqp", "piqp", "proxsuite", "qpsolvers", "scipy", "scs"]
    code = "import sys, casadi_gnc.allocation as a; a.backends.names(); print([m for m in %r if m in sys.modules])"
    done = run(code % heavy)
    assert done.stdout.strip() == "[]", done.stderr
    code = "import sys; from casadi_gnc.allocation import backends as b; b.available(); "
    code += "print([m for m in %r if m in sys.modules])"
    done = run(code % [m for m in heavy if m != "scipy"])
    assert done.stdout.strip() == "[]", done.stderr


QUIET = """
import sys, warnings; warnings.simplefilter("error")
import allocation_cases as oracle
from casadi_gnc.allocation import Allocator, backends
name = sys.argv[1]
robust = backends.Capability.ROBUST in backends.module(name).CAPABILITIES
problems = [oracle.huang2020(0.0, effort_weight=0.0, change_weight=0.0)]
problems += [oracle.huang2020(), oracle.huang2020(max_step=2e-4)] if robust and name != "sdp_scs" else []
for problem in problems:
    Allocator(problem, name).solve(oracle.COMMAND, [1e-3] * 12)
"""


def made_of(name: str) -> str:
    """Name a back end with the packages it is made of and their versions: what to look at when it changes."""
    known = metadata.packages_distributions()
    imported = ("casadi", *backends.module(name).REQUIRES)
    if name.startswith(backends.QPSOLVERS):
        imported += (name.removeprefix(backends.QPSOLVERS),)
    found = sorted({one for package in imported for one in known.get(package, [])})
    return f"{name}, made of {', '.join(f'{one} {metadata.version(one)}' for one in found)}"


def assert_quiet(name: str, code: str) -> None:
    """Banners and complaints of C libraries go around sys.stdout, so look at the process."""
    done = run(code, name)
    said = done.stdout + done.stderr
    assert done.returncode == 0, f"{made_of(name)}, ended with {done.returncode}: {said}"
    assert not said, f"{made_of(name)}, is not quiet: {said}"


@pytest.mark.parametrize("made", [one for one in NAMES if backends.module(one).REQUIRES or one == "online"])
def test_each_is_quiet(made):
    """Those that are made of something: Python alone prints what it is told to."""
    assert_quiet(need(made), QUIET)


def test_highs_is_quiet_by_its_name_in_qpsolvers():
    need("highs")
    assert_quiet("qpsolvers:highs", QUIET)


def test_one_that_is_not_quiet_is_told_with_its_version():
    """The package to blame stands in the message, with its version and what it said."""
    version = metadata.version("highspy")
    with pytest.raises(AssertionError, match=rf"^highs, made of .*highspy {version}, .*is not quiet: Copyright"):
        assert_quiet("highs", "print('Copyright')")
