"""Cases for back ends of the allocation, and their answers, each asked for once."""

import os
from functools import cache

import allocation_cases as oracle
import numpy as np
import pytest

from casadi_gnc.allocation import Answer, backends, solve

CASES = oracle.cases()
NAMES = backends.names()


def need(name: str) -> str:
    """Return the name of a back end that is installed; without it fail in CI and skip, by name, elsewhere."""
    lacking = backends.missing(name)
    if lacking:
        if os.environ.get("CI") == "true":
            pytest.fail(f"CI needs {', '.join(lacking)} for the back end {name}")
        pytest.skip(f"{', '.join(lacking)} is not installed, for the back end {name}")
    return name


@cache
def answer(name: str, label: str) -> Answer:
    case = CASES[label]
    return solve(case.problem, case.command, case.previous, backend=name)


def is_inside(case, forces) -> bool:
    lower, upper = case.problem.box(case.previous)
    return forces.shape == lower.shape and bool(np.all((lower <= forces) & (forces <= upper)))
