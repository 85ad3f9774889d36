"""What a recipe returns: gains, and the proof that they do what they promise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Any

import numpy as np

from casadi_gnc.errors import SynthesisError
from casadi_gnc.synthesis.analysis import Norm, fits, matrices, poles, stable_ratios
from casadi_gnc.synthesis.answer import LmiAnswer, LmiStatus
from casadi_gnc.synthesis.energy import Energy
from casadi_gnc.synthesis.peak import Peak, peak_command
from casadi_gnc.synthesis.regions import Region

#: Poles faster than this multiple of the plant's own rates: the gain runs to infinity.
RUNAWAY = 1e4
_TOLD = 0.01  # of the smallest gamma: how far its bounds may be apart without a word


class GainStatus(Enum):
    """How a synthesis ended; the value is the sentence for the reader."""

    CERTIFIED = "The gains keep what they promise: inequalities, poles, norm and peak recomputed from the data."
    INFEASIBLE = "No gains meet the inequalities, proved by multipliers; relax one in conflict."
    UNBOUNDED = "The inequalities leave the objective without a bound; bound the unknowns that run away."
    RUNS_AWAY = "The optimum is not attained, the gain runs to infinity: a bound is missing."
    NOT_CERTIFIED = (
        "No gain is certified: the solver's answer does not keep the inequalities; change the margin, units or the "
        "back end."
    )
    UNSTABLE = "The closed loop has a pole that is not in the left half plane."
    NORM_EXCEEDED = "The closed loop's H-infinity norm is larger than the certified bound."
    ENERGY_EXCEEDED = "The closed loop's H2 norm is larger than the certified bound."
    POLES_OUTSIDE = "A pole of the closed loop lies outside a region that was asked for."
    NOT_FOUND = "No gains were found, by a search that is local and proves nothing."
    INPUT_EXCEEDED = "The simulated command is larger than its limit."
    UNDECIDED = (
        "No gain is returned: neither gains nor a proof that there are none were found; change units, margins or the "
        "back end."
    )


_OF_LMIS = {
    LmiStatus.NOT_CERTIFIED: GainStatus.NOT_CERTIFIED,
    LmiStatus.INFEASIBLE: GainStatus.INFEASIBLE,
    LmiStatus.UNBOUNDED: GainStatus.UNBOUNDED,
    LmiStatus.UNDECIDED: GainStatus.UNDECIDED,
}


@dataclass(frozen=True, eq=False)
class Synthesis:
    """Hold gains with their certificate.

    Parameters
    ----------
    status : how it ended.
    gains : by name; what failed certification is kept for inspection in `candidate` only.
    candidate : as gains, whatever the status; empty if there are none.
    lmis : answer to the inequalities that the gains come from, or that have none.
    promised : bound on the H-infinity norm that the inequalities imply; NaN if they imply none.
    norm : true norm of the closed loop; None if it was not asked.
    poles : (n,), of the closed loop, [rad/s].
    peak : of the command from the worst start, by simulation; None if no starts were given.
    limit : of the command; NaN if none was given.
    ratios : interval of r = (assumed mass) / (true mass), or of any factor of the input matrix, about one
        within which the loop stays stable; None where the loop does not hold the input matrix.
    missing : what would bound a gain that runs away, how far gains were sought, or what a search did not find.
    smallest : between which the smallest gamma lies: a bound from the multipliers, without margins, and what was
        reached; None where it was not sought.
    energy : the H2 norm and what was promised of it; None if it was not asked.
    depths : by region of poles, how deep the poles lie in it, [rad/s]; negative outside.
    share : of the command that saturation may take, proved, above 0 and at most 1; NaN if it was not asked.
    """

    status: GainStatus
    candidate: dict[str, np.ndarray]
    lmis: LmiAnswer
    promised: float = float("nan")
    norm: Norm | None = None
    poles: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=complex))
    peak: Peak | None = None
    limit: float = float("nan")
    ratios: tuple[float, float] | None = None
    missing: str = ""
    smallest: tuple[float, float] | None = None
    energy: Energy | None = None
    depths: dict[str, float] = field(default_factory=dict)
    share: float = float("nan")

    @property
    def is_certified(self) -> bool:
        """Whether the gains may be used."""
        return self.status is GainStatus.CERTIFIED

    @property
    def gains(self) -> dict[str, np.ndarray]:
        """Return the gains; raise `SynthesisError` with the reason if they are not certified."""
        if not self.is_certified:
            raise SynthesisError(self.sentence())
        return self.candidate

    def sentence(self) -> str:
        """Return what happened and what to do."""
        said = self.status.value
        if self.status in _OF_LMIS.values():
            return said + self.lmis.details() + (f" {self.missing}" if self.missing else "")
        if self.status is GainStatus.NORM_EXCEEDED and self.norm is not None:
            where = f"at {self.norm.frequency_rad_s:.3g} rad/s"
            return f"{said} It is {self.norm.upper:.4g} {where}, promised {self.promised:.4g}."
        if self.status is GainStatus.ENERGY_EXCEEDED and self.energy is not None:
            return f"{said} It is {self.energy.upper:.4g}, promised {self.energy.promised:.4g}."
        if self.status is GainStatus.POLES_OUTSIDE:
            left = ", ".join(f"{name!r} by {-depth:.2g}" for name, depth in self.depths.items() if not depth > 0)
            return f"{said} It leaves {left} rad/s."
        if self.status is GainStatus.NOT_FOUND:
            return f"{said} {self.missing}"
        if self.status is GainStatus.UNSTABLE or self.status is GainStatus.RUNS_AWAY:
            slowest, fastest = self.poles[0], self.poles[np.argmax(np.abs(self.poles))]
            found = f"{said} Slowest pole {slowest:.3g}, fastest {fastest:.3g} rad/s."
            found = f"{found} {self.missing}" if self.missing and self.status is GainStatus.RUNS_AWAY else found
            return found + self._between()
        if self.status is GainStatus.INPUT_EXCEEDED and self.peak is not None:
            return f"{said} It may reach {self.peak.bound:.4g} at {self.peak.time_s:.3g} s, limit {self.limit:.4g}."
        return said + self._between()

    def _between(self) -> str:
        """Return a sentence where the smallest gamma, or what else was minimised, is not known well, else nothing."""
        if self.energy is not None and self.energy.least < (1 - _TOLD) * self.energy.promised:
            low, high = self.energy.least, self.energy.promised
            return f" The smallest bound on the H2 norm is not known well: it lies between {low:.4g} and {high:.4g}."
        if np.isnan(self.promised) and self.lmis.gap > _TOLD * abs(self.lmis.objective):
            return f" What was minimised, {self.lmis.objective:.4g}, may be smaller, by up to {self.lmis.gap:.2g}."
        if self.smallest is None or self.smallest[0] >= (1 - _TOLD) * self.smallest[1]:
            return ""
        low, high = self.smallest
        return f" The smallest gamma is not known well: it lies between {low:.4g} and {high:.4g}."


def failed(lmis: LmiAnswer, missing: str = "") -> Synthesis:
    """Return the synthesis for inequalities without a certified answer; `missing` says how far they were sought."""
    return Synthesis(_OF_LMIS[lmis.status], {}, lmis, missing=missing)


def certify_gains(
    candidate: dict[str, np.ndarray],
    lmis: LmiAnswer,
    loop: np.ndarray,
    rate: float,
    *,
    promised: float = float("nan"),
    norm: Norm | None = None,
    energy: Energy | None = None,
    regions: Sequence[Region] = (),
    peak: Peak | None = None,
    limit: float = float("nan"),
    parts: tuple[np.ndarray, np.ndarray] | None = None,
    missing: str = "",
) -> Synthesis:
    """Return the synthesis with the first failure as its status.

    Parameters
    ----------
    loop : (n, n), the closed loop's matrix, built from the gains and the plant's data.
    rate : the plant's own, [rad/s], against which a gain that runs away is measured.
    parts : (n, n) twice, the loop is fixed + r scaled for a plant whose input matrix is r times the
        assumed one; see `stable_ratios`.
    regions : in which the poles are to lie.
    promised, norm, energy, peak, limit, missing : as in `Synthesis`.
    """
    if not lmis.status.holds:
        return failed(lmis)
    found = poles(loop) if np.all(np.isfinite(loop)) else np.array([np.nan + 0j])
    depths = {region.name: min(map(region.depth, found)) for region in regions} if np.all(np.isfinite(found)) else {}
    status = GainStatus.CERTIFIED
    if not np.all(np.isfinite(found)) or found[0].real >= 0:
        status = GainStatus.UNSTABLE
    elif np.max(np.abs(found)) > RUNAWAY * rate:
        status = GainStatus.RUNS_AWAY
    elif norm is not None and not norm.upper <= promised:
        status = GainStatus.NORM_EXCEEDED
    elif energy is not None and not energy.upper <= energy.promised:
        status = GainStatus.ENERGY_EXCEEDED
    elif not all(depth > 0 for depth in depths.values()):
        status = GainStatus.POLES_OUTSIDE
    elif peak is not None and peak.bound > limit:
        status = GainStatus.INPUT_EXCEEDED
    tolerated = None
    if parts is not None and status not in (GainStatus.UNSTABLE, GainStatus.RUNS_AWAY):
        tolerated = stable_ratios(*parts)
    return Synthesis(
        status, candidate, lmis, promised, norm, found, peak, limit, tolerated, missing, energy=energy, depths=depths
    )


def peak_from(
    loop: np.ndarray, command: np.ndarray, vertices: Any, rate: float, *, per_channel: bool = False
) -> Peak | None:
    """Return the peak of the command from the worst vertex; None without vertices, or of a loop that is no success."""
    if vertices is None or not np.all(np.isfinite(loop)):
        return None
    found = poles(loop)
    if found[0].real >= 0 or np.max(np.abs(found)) > RUNAWAY * rate:
        return None
    return peak_command(loop, command, vertices, per_channel=per_channel)


def starts(vertices: Any, limit: float | None, count: int) -> tuple[np.ndarray | None, float]:
    """Return checked starts, (V, count), and the limit, NaN for none; raise `SynthesisError`."""
    if vertices is None and limit is not None:
        raise SynthesisError(f"limit is {limit} but no starts are given; a command's peak needs vertices to start from")
    if limit is not None and not (np.isfinite(limit) and limit > 0):
        raise SynthesisError(f"limit is {limit}, expected a positive number")
    if vertices is not None:
        (vertices,) = matrices(vertices=vertices)
        fits("vertices", vertices, len(vertices), count)
    return vertices, float("nan") if limit is None else float(limit)


def plant_rate(A: np.ndarray, B: np.ndarray) -> float:
    """Return the plant's own rate, [rad/s]: the larger of its matrices' norms."""
    return float(max(np.linalg.norm(A, 2), np.linalg.norm(B, 2)))
