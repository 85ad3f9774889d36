"""Shared fixtures: random numbers with a seed, compilers, missions loaded once; markers `tools` and `packages`."""

import importlib.util
import os
import shutil
import sys
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command line does, before NumPy is imported

import hypothesis
import numpy as np
import pytest

import casadi_gnc
from casadi_gnc.system.compilers import Compiler, _probe

# Drawn examples are the same at every run, so that a change is judged by what it changes; who searches for new ones
# says --hypothesis-profile=default.
hypothesis.settings.register_profile("repeatable", derandomize=True, database=None)
hypothesis.settings.load_profile("repeatable")

# Independent implementations that tests and benchmarks compare with, and what measures, which imports its neighbours.
sys.path[:0] = [str(Path(__file__).parent / folder) for folder in ("oracles", "bench")]


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Without a program or module that a test is marked to need fail in CI, and skip by name elsewhere."""
    lacking = [name for mark in item.iter_markers("tools") for name in mark.args if shutil.which(name) is None]
    lacking += [name for mark in item.iter_markers("packages") for name in mark.args if not _importable(name)]
    if lacking:
        text = f"{', '.join(lacking)} is not installed; CONTRIBUTING.md says what `make test-all` needs"
        if os.environ.get("CI") == "true":
            pytest.fail(text, pytrace=False)
        pytest.skip(text)


def _importable(module: str) -> bool:
    try:
        return importlib.util.find_spec(module) is not None
    except ModuleNotFoundError:  # a part of a package that is not there
        return False


#: What needs a package of the extra `oracles` to be looked through for examples.
collect_ignore = [] if _importable("jax") else ["bench/jax_flight.py"]


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(20200106)


@pytest.fixture(scope="session", autouse=True)
def cache(tmp_path_factory: pytest.TempPathFactory):
    """Keep compiled libraries of a test run away from the user's cache."""
    folder = tmp_path_factory.getbasetemp()
    folder = (
        folder.parent if "PYTEST_XDIST_WORKER" in os.environ else folder
    ) / "cache"  # one for all processes of a run
    folder.mkdir(mode=0o700, exist_ok=True)
    before = os.environ.get("CASADI_GNC_CACHE")
    os.environ["CASADI_GNC_CACHE"] = str(folder)
    yield folder
    if before is None:
        del os.environ["CASADI_GNC_CACHE"]
    else:
        os.environ["CASADI_GNC_CACHE"] = before


@pytest.fixture(scope="session")
def detumble() -> casadi_gnc.Mission:
    return casadi_gnc.load("huang2020/detumble")


@pytest.fixture(params=["gcc", pytest.param("clang", marks=pytest.mark.tools("clang"))])
def compiler(request: pytest.FixtureRequest) -> Compiler:
    found = _probe((request.param,))
    assert found is not None, f"{request.param} cannot be run"
    return found
