"""Bounds on the linear loop that tuned gains keep: a disk margin, and a region of poles."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from casadi_gnc.checking.broken_loops import scheme_margins
from casadi_gnc.checking.linear import loop_at
from casadi_gnc.checking.sampling import settled
from casadi_gnc.errors import GncError, TuningError
from casadi_gnc.missions.mission import Mission

#: What can be bounded from below, with its unit.
KNOWN = {"disk": "-", "decay_1_s": "1/s", "damping": "-"}


@dataclass(frozen=True)
class LoopBounds:
    """Hold the least that a loop must have.

    Parameters
    ----------
    least : by name: `disk`, the disk margin of all efforts at once (`casadi_gnc.checking.margins`); `decay_1_s`, of
        the slowest pole; `damping`, of the least damped pole.

    Raises
    ------
    TuningError
        For another name, and a bound that is not above 0.
    """

    least: Mapping[str, float]

    def __post_init__(self) -> None:
        for name, value in self.least.items():
            if name not in KNOWN:
                raise TuningError(f"a loop has no {name!r} to keep; there is {', '.join(KNOWN)}")
            if not 0 < value < np.inf:
                raise TuningError(f"{name} to be kept is {value:g}, expected a number above 0")

    def short(self, mission: Mission, scheme: str) -> list[str]:
        """Return what the loop of a scheme has too little of, a few words each; all where it has no linear loop."""
        if not self.least:
            return []
        try:
            found = self._found(mission, scheme)
        except GncError as error:
            return [str(error)]
        return [
            f"{name} {found[name]:.4g}, less than {value:g}"
            for name, value in self.least.items()
            if not found[name] >= value
        ]

    def refuse(self, mission: Mission, scheme: str) -> None:
        """Raise `TuningError` where the gains of a mission do not keep the bounds to begin with."""
        lacking = self.short(mission, scheme)
        if lacking:
            raise TuningError(
                f"the loop of the first gains does not keep what is asked: {'; '.join(lacking)}; begin with gains that "
                "do, or ask for less"
            )

    def _found(self, mission: Mission, scheme: str) -> dict[str, float]:
        chosen, found = mission.scheme(scheme), {}
        if "disk" in self.least:
            found["disk"] = scheme_margins(mission, chosen).disk_of_efforts
        if len(found) < len(self.least):
            loop = loop_at(mission, chosen, settled(mission))
            if not loop.exists or not loop.moving.size:
                raise TuningError("the loop has no slope at its target, so no poles")
            poles = np.linalg.eigvals(loop.moving).astype(complex)
            if loop.sampled:
                with np.errstate(divide="ignore"):  # a pole at 0 is gone after a sample
                    poles = np.log(poles) / mission.timing.sample_period
            found["decay_1_s"] = float(-np.real(poles).max())
            sizes = np.abs(poles)
            finite = np.isfinite(sizes) & (sizes > 0)
            found["damping"] = float((-np.real(poles)[finite] / sizes[finite]).min(initial=1.0))
        return found
