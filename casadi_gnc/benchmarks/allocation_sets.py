"""Families of the allocation contest, from sets, single problems and data from outside."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from casadi_gnc.benchmarks.contest import Family, digest
from casadi_gnc.benchmarks.families import random_family
from casadi_gnc.benchmarks.outside import Samples, boxed, read_commands, read_outside
from casadi_gnc.benchmarks.sets import AllocationFamily, load_set
from casadi_gnc.errors import BenchmarkError, GncError
from casadi_gnc.problem_files import document
from casadi_gnc.problem_files.allocation_file import load_allocation


def load_families(problems: list[str], samples: int | None) -> list[Family]:
    """Return the families of sets, single families as SET/FAMILY, allocation files and data from outside."""
    found: list[Family] = []
    for problem in problems:
        found += _families(problem, samples)
    names = [family.name for family in found]
    repeated = sorted({name for name in names if names.count(name) > 1})
    if repeated:
        raise BenchmarkError(f"families are named twice: {', '.join(repeated)}")
    return found


def _families(problem: str, samples: int | None) -> list[Family]:
    path = Path(problem)
    if path.is_dir() or path.suffix == ".mat":
        if not path.exists():
            raise BenchmarkError(f"there is no file {problem!r}")
        return [_family(path.stem, path.stem, f"from {path.name}", read_outside(path), samples)]
    name, only = problem, ""
    if not path.is_file() and "/" in problem and not _is_shipped(problem):
        name, _, only = problem.rpartition("/")
    if _kind(name) == "allocation" and not only:
        return [_of_problem(name, samples)]
    group, model, folder = load_set(name, "allocation")
    chosen = [one for one in model.family if only in ("", one.name)]
    if not chosen:
        raise BenchmarkError(
            f"the set {name!r} has no family {only!r}; it has {', '.join(f.name for f in model.family)}"
        )
    found = []
    for one in chosen:
        try:
            found.append(_family(one.name, group, one.title, _samples(one, folder), samples))
        except GncError as error:
            raise BenchmarkError(f"{name}, family {one.name!r}: {error}") from error
    return found


def _is_shipped(problem: str) -> bool:
    return problem in document.shipped() or f"benchmarks/{problem}" in document.shipped()


def _kind(name: str) -> str:
    return str(
        document.read(f"benchmarks/{name}" if f"benchmarks/{name}" in document.shipped() else name).data.get("kind")
    )


def _of_problem(name: str, samples: int | None) -> Family:
    """Return a family of an allocation file: commands that random forces would make, from a seed."""
    case = load_allocation(name)
    problem, rng = case.problem, np.random.default_rng(0)
    forces = rng.uniform(problem.lower, problem.upper, (41, problem.count))
    made = boxed(problem, forces[1:] @ problem.effectiveness.T, forces[:-1])
    return _family(case.name, case.name, case.title or case.name, made, samples)


def _samples(family: AllocationFamily, folder: Path) -> Samples:
    if family.random is not None:
        samples = boxed(*random_family(family.random))
    else:
        assert family.commands is not None
        if family.problem is None:
            return read_outside(folder / family.commands).first(family.samples)
        beside = folder / f"{family.problem}.toml"
        problem = load_allocation(beside if beside.is_file() else family.problem).problem
        samples = read_commands(folder / family.commands, problem).first(family.samples)
    return _certain(samples) if family.certain else samples


def _certain(samples: Samples) -> Samples:
    """Return the samples without uncertainty."""
    return replace(samples, problem=replace(samples.problem, coupling=None, errors=None))


def _family(name: str, group: str, title: str, samples: Samples, count: int | None) -> Family:
    kept = samples.first(count)
    p = kept.problem
    parts = [p.effectiveness, p.coupling, p.errors, p.effort_weight, p.change_weight, p.accuracy_weight, p.preferred]
    return Family(
        name=name,
        group=group,
        title=f"{title}; {p.effectiveness.shape[0]} x {p.count}, {len(p.errors)} vertices",
        count=len(kept.commands),
        data=kept,
        digest=digest(*parts, kept.commands, kept.previous, kept.lower, kept.upper),
    )
