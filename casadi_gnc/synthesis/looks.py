"""Ask a back end for a point or a proof, and look again, scaled otherwise, where its answer is worth neither."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from casadi_gnc.errors import SynthesisError
from casadi_gnc.synthesis.answer import LmiStatus, Verdict, judge
from casadi_gnc.synthesis.backends import Claim, Found
from casadi_gnc.synthesis.conic import ConicData
from casadi_gnc.synthesis.proofs import Reach
from casadi_gnc.synthesis.rays import ray_data
from casadi_gnc.synthesis.scaling import Scaled, scale, tightened

_MANY = 100  # unknowns from which every further look takes its time
_TIGHTER = (4.0, 64.0)  # how many times what a point lacks is asked for on top, if the answer does not hold


@dataclass(frozen=True, eq=False)
class Look:
    """Hold scaled data, what a back end found, and what we make of it."""

    scaled: Scaled
    found: Found
    verdict: Verdict


@dataclass(frozen=True, eq=False)
class Looks:
    """Look at conic data by a back end, a module as `casadi_gnc.synthesis.backends` describes.

    Parameters
    ----------
    within, prove : as of `casadi_gnc.synthesis.answer.judge`.
    options : of the back end.
    """

    module: Any
    within: Reach | None
    prove: bool
    options: dict[str, Any]

    def at(self, scaled: Scaled) -> Look:
        """Return one look at scaled data."""
        found = self.module.solve(scaled, **self.options)
        return Look(scaled, found, self._judge(scaled, found))

    def best(self, scaled: Scaled) -> Look:
        """Return the best of as many looks as are needed, the first of them at scaled data as `scale` returns."""
        look, data = self.at(scaled), scaled.data
        if look.verdict.status is LmiStatus.NOT_CERTIFIED and len(data.cost) > _MANY:  # mostly it lacks next to nothing
            look = self._tighter(look, _TIGHTER[-1], refuted=False)
        if look.verdict.is_lacking:
            look = self._elsewhere(look)
        if (look.verdict.is_lacking or look.verdict.status is LmiStatus.FEASIBLE) and _is_finite(look):
            look = _better(look, self.at(scale(data, look.verdict.point)))
        for factor in _TIGHTER:
            if not look.verdict.is_lacking or not _is_finite(look):
                break
            look = self._tighter(look, factor, refuted=True)
        if look.verdict.is_lacking and np.any(data.cost):  # an objective that runs away hides what is in conflict
            plain = replace(look.scaled, cost=np.zeros_like(look.scaled.cost))
            found = self.module.solve(plain, **self.options)
            if found.claim is Claim.INFEASIBLE:
                verdict = self._judge(look.scaled, found)
                if verdict.status is LmiStatus.INFEASIBLE or verdict.excluded:
                    look = Look(look.scaled, found, verdict)
        return look

    def _judge(self, scaled: Scaled, found: Found) -> Verdict:
        return judge(scaled, found, self.within, prove=self.prove)

    def _tighter(self, look: Look, factor: float, *, refuted: bool) -> Look:
        """Return what asking for more gives, if it holds or, where that is wanted, refutes; else the look at hand."""
        asked = tightened(look.scaled, look.verdict.point / look.scaled.unit, factor)
        found = self.module.solve(asked, **self.options)
        if found.claim is Claim.INFEASIBLE and not refuted:
            return look
        verdict = self._judge(look.scaled, found)
        if verdict.status.holds or (refuted and (verdict.status is LmiStatus.INFEASIBLE or verdict.excluded)):
            return Look(look.scaled, found, verdict)
        return look

    def _elsewhere(self, look: Look) -> Look:
        """Return the better of an answer that proves nothing and what other scaling, or a deeper ray, makes of it."""
        try:
            other = self.at(scale(look.scaled.data, middle=len(look.scaled.cost) <= _MANY))
        except SynthesisError:  # a margin drowns in that scaling; the one at hand is what there is
            return look
        look = _better(look, other)
        if look.verdict.is_lacking and Claim.UNBOUNDED in (look.found.claim, other.found.claim):
            for tried in (look.scaled, other.scaled):
                deep = self.module.solve(ray_data(tried), **self.options).point[:-1]
                found = Found(deep, np.full(len(tried.right), np.nan), Claim.UNBOUNDED)
                verdict = self._judge(tried, found)
                if verdict.status is LmiStatus.UNBOUNDED:
                    return Look(tried, look.found, verdict)
        return look


def _better(look: Look, other: Look) -> Look:
    return other if other.verdict.rank > look.verdict.rank else look


def _is_finite(look: Look) -> bool:
    return bool(np.all(np.isfinite(look.verdict.point)))


def first_scaling(data: ConicData) -> Scaled:
    """Return data as they are scaled for the first look."""
    return scale(data, middle=len(data.cost) > _MANY)
