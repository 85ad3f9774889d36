"""The contest of back ends for matrix inequalities: conic data in, a point or a proof out.

A success is the verdict that is right by construction, proved by our certificate from what the back
end returned, with the gap to its own dual bound below the accuracy where something is minimised.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from casadi_gnc.benchmarks.contest import Accuracy, Family, Judgement, digest
from casadi_gnc.benchmarks.lmi_families import LmiSample, lmi_samples
from casadi_gnc.benchmarks.machine import version
from casadi_gnc.errors import BenchmarkError, SynthesisError
from casadi_gnc.synthesis import backends
from casadi_gnc.synthesis.answer import LmiStatus, judge
from casadi_gnc.synthesis.backends import Claim, Found
from casadi_gnc.synthesis.scaling import scale

NAME = "synthesis"
TITLE = "Back ends for matrix inequalities"
SETS = ("lmis",)
RESIDUALS = (
    "largest lack of a constraint, in units of its margin or, without one, of the rounding of its check",
    "objective less the bound from the multipliers, over the objective's size",
)
LIMITATIONS = (
    "Back ends start from nothing every time, so that warm and cold differ by what the processor remembers only.",
    "Set-up is the scaling of a whole family, the same for all; posing the inequalities is not timed.",
    "The second look that `Lmis.solve` takes at poor answers is left out: this compares solvers.",
    "Times that solvers report are theirs: what they leave out differs.",
)
#: Largest gap, over the size of the objective, by accuracy.
GAPS = {"low": 1e-3, "mid": 1e-6, "high": 1e-8}
#: Largest distance from the optimum known by other means, over its size; margins move the optimum by less.
WITNESS = 1e-3
_SAID = {Claim.SOLVED: (LmiStatus.CERTIFIED,), Claim.INFEASIBLE: (LmiStatus.INFEASIBLE,)}
_DISTRIBUTIONS = {"barrier": "casadi-gnc"}


def contestants(wanted: list[str] | None) -> list[str]:
    """Return the back ends wanted, or all that are installed; raise `BenchmarkError` for an unknown one."""
    if wanted is None:
        return [name for name in backends.names() if not _missing(name)]
    if not wanted:
        raise BenchmarkError("no back ends are named; leave --backends out for all")
    for name in wanted:
        try:
            backends.module(name)
        except SynthesisError as error:
            raise BenchmarkError(str(error)) from None
    return list(dict.fromkeys(wanted))


def _missing(name: str) -> bool:
    try:
        backends.module(name)
    except SynthesisError:
        return True
    return False


def absent() -> list[str]:
    """Return a sentence for each back end that is not installed."""
    return [f'{name}; pip install "casadi-gnc[solvers]"' for name in backends.names() if _missing(name)]


def families(problems: list[str], samples: int | None) -> list[Family]:
    """Return the families of sets, or single ones as SET/FAMILY."""
    from casadi_gnc.benchmarks.sets import load_set

    found = []
    for problem in problems:
        name, only = problem, ""
        if not problem.endswith(".toml") and "/" in problem.removeprefix("benchmarks/"):
            name, _, only = problem.rpartition("/")
        group, model, _ = load_set(name, NAME)
        chosen = [one for one in model.lmi_family if only in ("", one.name)]
        if not chosen:
            known = ", ".join(one.name for one in model.lmi_family)
            raise BenchmarkError(f"the set {name!r} has no family {only!r}; it has {known}")
        for one in chosen:
            count = min(one.samples, samples or one.samples)
            data = lmi_samples(one.kind, one.seed, count, one.size)
            parts = [part for each in data for part in (each.data.matrix.toarray(), each.data.offset, each.data.cost)]
            title = f"{one.title}; {len(data[0].data.cost)} unknowns, {len(data[0].data.offset)} rows"
            found.append(Family(one.name, group, title, count, data, digest(*parts)))
    return found


def able(contestant: str, family: Family) -> bool:
    """Return True: every back end takes every set of inequalities."""
    return True


def versions(contestant: str) -> dict[str, str]:
    """Return the version of the package behind a back end."""
    package = _DISTRIBUTIONS.get(contestant, contestant)
    return {package: version(package)}


def runner(contestant: str, family: Family, accuracy: Accuracy) -> LmiRunner:
    """Return a back end and the family's data, scaled."""
    return LmiRunner(backends.module(contestant), family.data, accuracy)


class LmiRunner:
    """Call one back end on scaled data, once a sample, and keep what it says as it says it."""

    def __init__(self, back_end: Any, samples: list[LmiSample], accuracy: Accuracy) -> None:
        self._solve, self._samples, self._accuracy = back_end.solve, samples, accuracy
        self._scaled = [scale(sample.data) for sample in samples]

    def run(self, k: int) -> Found:
        """Return what the solver says of sample k."""
        return self._solve(self._scaled[k])

    def judge(self, k: int, said: Found) -> Judgement:
        """Return its worth by the certificate; a wrong objective is caught by the known one as well."""
        sample, verdict = self._samples[k], judge(self._scaled[k], said)
        good, gap = verdict.status is sample.expected, 0.0
        if np.isfinite(sample.objective):
            size = max(abs(sample.objective), 1e-12)
            gap = max(float(verdict.gap), 0.0) / size
            near = abs(verdict.objective - sample.objective) <= WITNESS * size
            good = verdict.status.holds and gap <= GAPS[self._accuracy] and near
        lacking = max((check.lacking for check in verdict.checks), default=0.0)
        claimed = sample.expected in _SAID.get(said.claim, ())
        return Judgement(claimed, bool(good), max(float(lacking), 0.0), gap, said.seconds, said.iterations)
