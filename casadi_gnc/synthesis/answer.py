"""What a set of LMIs returns: unknowns in original units, and our own word on them."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

import numpy as np

from casadi_gnc.errors import SynthesisError, offer
from casadi_gnc.synthesis.backends import Claim, Found
from casadi_gnc.synthesis.certificate import Check, check, onto_equalities
from casadi_gnc.synthesis.objective_bound import bound
from casadi_gnc.synthesis.proofs import Infeasibility, Reach, covers, promising, prove_infeasible
from casadi_gnc.synthesis.rays import Ray, prove_unbounded
from casadi_gnc.synthesis.scaling import Scaled

_GAP = 1e-4  # of the objective's terms: what counts as optimal; SCS reaches about 1e-6

_LARGEST = 1e100  # scaled unknowns beyond are no numbers


class LmiStatus(Enum):
    """How a set of LMIs ended; the value is the sentence for the reader."""

    CERTIFIED = "Every constraint holds, by eigenvalues computed from the data, and the objective is optimal."
    FEASIBLE = (
        "Every constraint holds, by eigenvalues computed from the data, but the objective may be improved: see gap."
    )
    NOT_CERTIFIED = (
        "The solver's answer does not keep the constraints; change margins or units, or take another back end."
    )
    INFEASIBLE = "No unknowns in the stated range meet all constraints, proved by multipliers; relax one in conflict."
    UNBOUNDED = "The objective falls without end along a ray; bound the unknowns that run away."
    UNDECIDED = (
        "Neither a point nor a proof that there is none was found for the range asked for; "
        "change units, margins or the back end."
    )

    @property
    def holds(self) -> bool:
        """Whether every constraint is certified."""
        return self in (LmiStatus.CERTIFIED, LmiStatus.FEASIBLE)


@dataclass(frozen=True, eq=False)
class LmiAnswer:
    """Hold the answer to a set of LMIs.

    Parameters
    ----------
    status : how it ended, by our certificate.
    point : (N,), scalar unknowns in original units; NaN if there are none.
    unknowns : matrices by name.
    objective : at the point; NaN without one.
    gap : objective less a lower bound from the multipliers, in its unit, for points whose unknowns, in natural
        sizes, are at most ten times the largest at hand; infinite without a bound.
    checks : of every constraint at the point.
    infeasibility : proof that there is no point in a range of the unknowns, which it states. With the status
        UNDECIDED it covers less than was asked for. None if there is none.
    ray : proof that there is no minimum, or None.
    least : lower bound on the objective without any margins, in its unit: what margins cost is the objective less
        this, at most; minus infinity without a bound.
    conflict : names of constraints that cannot be met together although any others of them can;
        empty if not sought.
    far : names of unknowns far beyond their natural size: the minimum may not be attained.
    backend, iterations, seconds, claim : the solver's name and what it said.
    """

    status: LmiStatus
    point: np.ndarray
    unknowns: dict[str, np.ndarray]
    objective: float
    gap: float
    checks: tuple[Check, ...]
    infeasibility: Infeasibility | None
    ray: Ray | None
    backend: str
    iterations: int
    seconds: float
    claim: Claim
    conflict: tuple[str, ...] = field(default=())
    far: tuple[str, ...] = field(default=())
    least: float = float("-inf")

    def __getitem__(self, name: str) -> np.ndarray:
        """Return an unknown; raise `SynthesisError` if it is not certified, or not there."""
        if not self.status.holds:
            raise SynthesisError(self.sentence())
        if name not in self.unknowns:
            raise SynthesisError(f"no unknown {name!r}; {offer(name, self.unknowns)}")
        return self.unknowns[name]

    @property
    def worst(self) -> Check | None:
        """Return the constraint that keeps least of its margin; None without a point."""
        return max(self.checks, key=lambda one: one.lacking, default=None)

    def sentence(self) -> str:
        """Return what happened, where, and what to do."""
        return self.status.value + self.details()

    def details(self) -> str:
        """Return where, and what to do, after a sentence that says what happened."""
        said, worst = "", self.worst
        if self.status is LmiStatus.NOT_CERTIFIED and worst is not None:
            return (
                f" The worst is {worst.name!r}: smallest eigenvalue or element {worst.smallest:.3g} "
                f"where {worst.margin:.3g} was asked for (rounding {worst.allowance:.1g})."
            )
        if self.status.holds and self.far:
            said += f" {', '.join(self.far)} may run to infinity: add a constraint that bounds them, or price them."
        if self.infeasibility is not None and self.status is LmiStatus.UNDECIDED:
            said += f" What is proved: there is no point with entries of {self.infeasibility.sentence()}."
        elif self.infeasibility is not None:
            said += f" The range: entries of {self.infeasibility.sentence()}."
            carried = [f"{name!r} {share:.0%}" for name, share in self.infeasibility.shares.items() if share > 0.01]
            said += f" The multipliers lie on {', '.join(carried)}."
            if self.conflict:
                together = " and ".join(repr(name) for name in self.conflict)
                verb = "cannot be met together" if len(self.conflict) > 1 else "cannot be met by itself"
                said += f" {together} {verb}: relax {'one of them' if len(self.conflict) > 1 else 'it'}."
        if self.ray is not None:
            names = sorted({label.split("[")[0] for label in self.ray.direction})
            said += f" Those are entries of {', '.join(names)}: add a constraint that bounds them."
        return said


@dataclass(frozen=True, eq=False)
class Verdict:
    """Hold what we make of what a solver found; fields as in `LmiAnswer`.

    `excluded` marks an undecided one whose multipliers exclude all points of ordinary size, but no proof was asked for.
    """

    status: LmiStatus
    point: np.ndarray
    checks: tuple[Check, ...] = ()
    objective: float = float("nan")
    gap: float = float("inf")
    infeasibility: Infeasibility | None = None
    ray: Ray | None = None
    least: float = float("-inf")
    excluded: bool = False

    @property
    def is_lacking(self) -> bool:
        """Whether another look may be worth more: neither a point that holds nor a reason to believe in none."""
        return self.status in (LmiStatus.NOT_CERTIFIED, LmiStatus.UNDECIDED) and not self.excluded

    @property
    def rank(self) -> tuple[int, float]:
        """Order verdicts: proofs, then points that hold, the smaller gap first, then points that lack least."""
        if self.excluded or self.status in (LmiStatus.INFEASIBLE, LmiStatus.UNBOUNDED, LmiStatus.CERTIFIED):
            return 3, 0.0
        if self.status is LmiStatus.FEASIBLE:
            return 2, -self.gap
        return (1, -max(one.lacking for one in self.checks)) if self.checks else (0, 0.0)


def judge(scaled: Scaled, found: Found, within: Reach | None = None, *, prove: bool = True) -> Verdict:
    """Return what a solver's answer is worth; its claim only says which proof to try first.

    Parameters
    ----------
    within : range of the unknowns that a proof of infeasibility has to cover; see `Lmis.solve`.
    prove : whether to seek a proof of infeasibility where multipliers promise one, or to note that they do.
    """
    data, nothing = scaled.data, np.full(len(scaled.cost), np.nan)
    if found.claim is Claim.UNBOUNDED:
        ray = prove_unbounded(scaled, found.point)
        if ray is not None:
            return Verdict(LmiStatus.UNBOUNDED, nothing, ray=ray)
    if found.claim is Claim.INFEASIBLE:
        if not prove and promising(scaled, found.dual):
            return Verdict(LmiStatus.UNDECIDED, nothing, excluded=True)
        return _refuted(scaled, found, within) or Verdict(LmiStatus.UNDECIDED, nothing)
    if np.shape(found.point) != np.shape(scaled.cost) or not np.all(np.abs(found.point) <= _LARGEST):
        return Verdict(LmiStatus.UNDECIDED, nothing)
    y = onto_equalities(scaled, found.point)
    point = scaled.original(y)
    checks = check(data, point)
    if not all(one.holds for one in checks):
        promised = promising(scaled, found.dual)
        if promised and not prove:
            return Verdict(LmiStatus.UNDECIDED, nothing, excluded=True)
        refuted = _refuted(scaled, found, within) if promised else None
        if refuted is not None and refuted.status is LmiStatus.INFEASIBLE:
            return refuted
        proof = None if refuted is None else refuted.infeasibility
        if found.claim is not Claim.SOLVED:
            return Verdict(LmiStatus.UNDECIDED, point, checks, infeasibility=proof)
        return Verdict(LmiStatus.NOT_CERTIFIED, point, checks)
    objective = float(data.cost @ point) + data.constant
    if not np.any(data.cost):
        return Verdict(LmiStatus.CERTIFIED, point, checks, objective, 0.0, least=objective)
    gap, least = objective - bound(scaled, found.dual, y), bound(scaled, found.dual, y, margins=False)
    size = float(np.abs(data.cost) @ np.abs(point)) + abs(data.constant)
    status = LmiStatus.CERTIFIED if gap <= _GAP * size else LmiStatus.FEASIBLE
    return Verdict(status, point, checks, objective, gap, least=least)


def _refuted(scaled: Scaled, found: Found, within: Reach | None) -> Verdict | None:
    """Return the verdict that multipliers of no point deserve; None if they exclude nothing."""
    proof = prove_infeasible(scaled, found.dual, within)
    if proof is None:
        return None
    status = LmiStatus.INFEASIBLE if covers(proof, within) else LmiStatus.UNDECIDED
    return Verdict(status, np.full(len(scaled.cost), np.nan), infeasibility=proof)
