"""The contest of allocation back ends: commands in, forces out, judged by bounds and duality gap.

Contestants are the back ends of `casadi_gnc.allocation`, every other solver that qpsolvers finds here, and
back ends of one's own as `path/to/file.py` or `path/to/file.py:OBJECT`.

A success is an answer that is within its bounds and whose relative duality gap, after moving it into
them, is below the accuracy, whatever the back end says of it. Unlike in use, where forces are always
moved into their bounds first, a violation counts here.
"""

from __future__ import annotations

import importlib.util
import inspect
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from casadi_gnc.allocation import ACCURACIES, AllocationProblem, backends, certify
from casadi_gnc.allocation.backends import QPSOLVERS, Capability, Found
from casadi_gnc.benchmarks.contest import Accuracy, Family, Judgement
from casadi_gnc.benchmarks.machine import version
from casadi_gnc.benchmarks.outside import Samples
from casadi_gnc.errors import AllocationError, BenchmarkError

NAME = "allocation"
TITLE = "Allocation back ends"
SETS = ("plain", "robust")
RESIDUALS = (
    "largest violation of a bound, over the actuator's reach",
    "duality gap over cost after moving the forces into their bounds, 0 at the rounding floor",
)
MISSED = (
    "effort not made, |u - (A + D_v E) F| under the worst error, over the largest effort of the actuators, of the "
    "forces moved into their bounds; median and largest over samples. It does not decide: the cost weighs it against "
    "effort"
)
LIMITATIONS = (
    "Back ends are called from Python, as `Allocator` calls them: for those of a few microseconds most of the "
    "time is the call. Only back ends that report a time of their own can be told apart from it; the on-board "
    "allocator does not (its time inside a C loop is in the ratios of the documentation).",
    "Times that solvers report are theirs: what they leave out differs.",
    "Tolerances are the back ends' own defaults, which aim beyond 1e-6; for accuracy low they are asked for 1e-5.",
    "A cold solve includes whatever a back end puts off from its set-up to its first solve.",
    "Linear algebra runs on one thread.",
)
#: Largest violation of a bound, over the actuator's reach, by accuracy.
BOUNDS = {"low": 1e-4, "mid": 1e-7, "high": 1e-9}
_LOW_TOLERANCE = 1e-5
#: Solvers of qpsolvers that have names of their own here.
_THROUGH_QPSOLVERS = ("osqp", "highs", "piqp")
#: Distribution of each package, where its name differs from the one that is imported.
_DISTRIBUTIONS = {"highs": "highspy", "proxqp": "proxsuite"}
_EXTRA = "solvers"


def contestants(wanted: list[str] | None) -> list[str]:
    """Return the back ends wanted, or all that can take part here; raise `BenchmarkError` for an unknown one."""
    if wanted is None:
        return [*backends.available(), *_others()]
    found = []
    for name in dict.fromkeys(wanted):
        try:
            lacking = [] if ".py" in name else backends.missing(name)
            _module(name)
        except AllocationError as error:
            raise BenchmarkError(str(error)) from None
        if name.startswith(QPSOLVERS) and name.removeprefix(QPSOLVERS) not in _found_by_qpsolvers():
            known = ", ".join(_found_by_qpsolvers())
            raise BenchmarkError(f"qpsolvers does not find {name.removeprefix(QPSOLVERS)!r}; it finds {known}")
        if lacking:
            raise BenchmarkError(f"back end {name!r} needs {', '.join(lacking)}, which is not installed")
        found.append(name)
    if not found:
        raise BenchmarkError("no back ends are named; leave --backends out for all")
    return found


def absent() -> list[str]:
    """Return a sentence for each back end that is not installed, with the extra that brings it."""
    return [
        f'{name}: needs {", ".join(lacking)}; pip install "casadi-gnc[{_EXTRA}]"'
        for name in backends.names()
        if (lacking := backends.missing(name))
    ]


@cache
def _found_by_qpsolvers() -> tuple[str, ...]:
    return tuple(importlib.import_module("qpsolvers").available_solvers)


def _others() -> list[str]:
    return [f"{QPSOLVERS}{name}" for name in _found_by_qpsolvers() if name not in _THROUGH_QPSOLVERS]


@cache
def _module(name: str) -> Any:
    """Return a back end by its name, or by the file it is in."""
    path, _, attribute = name.rpartition(":") if ".py:" in name else (name, "", "")
    if not path.endswith(".py"):
        return backends.module(name)
    spec = importlib.util.spec_from_file_location(Path(path).stem, path)
    if not Path(path).is_file() or spec is None or spec.loader is None:
        raise BenchmarkError(f"no back end {name!r}: there is no file {path!r}")
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
        found = getattr(module, attribute) if attribute else module
        for needed in ("CAPABILITIES", "REQUIRES", "set_up"):
            getattr(found, needed)
    except Exception as error:
        raise BenchmarkError(f"back end {name!r} cannot be loaded: {type(error).__name__}: {error}") from error
    return found


def families(problems: list[str], samples: int | None) -> list[Family]:
    """Return the families of sets, single families as SET/FAMILY, allocation files and data from outside."""
    from casadi_gnc.benchmarks.allocation_sets import load_families  # reading files is not the contestants' work

    return load_families(problems, samples)


def able(contestant: str, family: Family) -> bool:
    """Return whether a back end takes such problems: those for quadratic programs take no uncertainty."""
    return Capability.ROBUST in _module(contestant).CAPABILITIES or not family.data.problem.is_robust


def objective_of(contestant: str) -> str:
    """Return what a back end minimises in the place of the problem's cost; empty where it is that cost."""
    return str(getattr(_module(contestant), "OBJECTIVE", ""))


def versions(contestant: str) -> dict[str, str]:
    """Return the versions of the packages behind a back end."""
    if ".py" in contestant:
        return {}
    required: tuple[str, ...] = _module(contestant).REQUIRES
    names = [_DISTRIBUTIONS.get(name, name) for name in required]
    if contestant.startswith(QPSOLVERS):
        solver = contestant.removeprefix(QPSOLVERS)
        names.append(_DISTRIBUTIONS.get(solver, solver))
    return {name: version(name) for name in names or ["casadi-gnc"]}


@cache
def _options(contestant: str, accuracy: Accuracy) -> dict[str, Any]:
    """Return what a back end is asked for: its own defaults, but where little is asked, little."""
    back_end = _module(contestant)
    if accuracy != "low" or "tolerance" not in inspect.signature(back_end.set_up).parameters:
        return {}
    wanted = {"tolerance": _LOW_TOLERANCE}
    try:
        back_end.set_up(AllocationProblem(np.array([[1.0, -1.0]]), 0.0, 1.0), **wanted)
    except AllocationError:
        return {}
    return wanted


def runner(contestant: str, family: Family, accuracy: Accuracy) -> AllocationRunner:
    """Return a back end freshly set up for the family's problem."""
    return AllocationRunner(_module(contestant), family.data, accuracy, _options(contestant, accuracy))


class AllocationRunner:
    """Call one solver as `Allocator` does, and keep what it says as it says it."""

    def __init__(self, back_end: Any, samples: Samples, accuracy: Accuracy, options: dict[str, Any]) -> None:
        self._accuracy, self._samples = accuracy, samples
        self._solver = back_end.set_up(samples.problem, **options)
        self._rows = list(zip(samples.commands, samples.previous, samples.lower, samples.upper, strict=True))

    def run(self, k: int) -> Found:
        """Return what the solver says of sample k."""
        return self._solver.find(*self._rows[k])

    def judge(self, k: int, said: Found) -> Judgement:
        """Return its worth by bounds and certificate."""
        problem, (command, previous, lower, upper) = self._samples.problem, self._rows[k]
        forces = np.asarray(said.forces, dtype=float)
        if forces.shape != lower.shape or not np.all(np.isfinite(forces)):
            return Judgement(bool(said.claimed), False, np.inf, np.inf, said.seconds, said.iterations)
        reach = np.maximum(np.abs(problem.lower), np.abs(problem.upper))
        outside = np.maximum(lower - forces, forces - upper) / np.where(reach > 0, reach, 1.0)
        violation = max(float(outside.max()), 0.0)
        inside = np.clip(forces, lower, upper)
        accuracy = ACCURACIES[self._accuracy]
        cost, gap, _, status = certify(problem, command, previous, inside, said.weights, accuracy, (lower, upper))
        good = status.is_certified and violation <= BOUNDS[self._accuracy]
        relative = 0.0 if status.name == "AT_ROUNDING" else max(gap, 0.0) / cost if cost > 0 else float(gap > 0)
        missing = float(np.linalg.norm(problem.missing(inside, command), axis=1).max())
        missed = missing / problem.full_effort if problem.full_effort > 0 else np.nan
        return Judgement(bool(said.claimed), good, violation, relative, said.seconds, said.iterations, missed)
