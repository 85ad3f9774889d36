"""What a package does with faults, by Python: the reference that compiled code is compared with."""

from __future__ import annotations

import numpy as np

from casadi_gnc.embedded.faults import LATCHED, SAFE_MODE, STALE, Faults
from casadi_gnc.signals import Layout


class HandledFaults:
    """Remember what the options remember, from step to step.

    Parameters
    ----------
    faults : the options, None for none.
    measured : layout of what may be held.
    rows : of the effort.
    """

    def __init__(self, faults: Faults | None, measured: Layout, rows: int = 0) -> None:
        self._own, self._measured = faults or Faults(), measured
        self._held = {name: 0 for name, _ in self._own.ages}
        self._is_safe, self._failed, self._good, self._is_latched = False, 0, 0, False
        #: What the tape of the law is given where gains could fade and never were changed.
        self.unfaded = {"last": [0.0] * rows, "offset": [0.0] * rows, "share": 0.0, "changed": 0.0}

    def aged(self, y: np.ndarray, accepted: np.ndarray) -> int:
        """Return the bit of a measurement that is held for too long."""
        rows = {name: self._measured.place(name) for name in self._held}
        return self.held({name: not (y[place] == accepted[place]).all() for name, place in rows.items()})

    def held(self, held: dict[str, bool]) -> int:
        """Return the bit of what is held for too long; `held` tells of each whether it is held in this step."""
        self._held = {name: self._held[name] + 1 if is_held else 0 for name, is_held in held.items()}
        return STALE if any(self._held[name] > most for name, most in self._own.ages) else 0

    def guarded(
        self, status: int, told: np.ndarray, previous: np.ndarray, lower: np.ndarray, upper: np.ndarray
    ) -> tuple[np.ndarray, int]:
        """Return what the actuators are told, and the bit of safe mode."""
        if not self.is_safe(status):
            return told, 0
        return np.minimum(np.maximum(self._own.safe or previous, lower), upper), SAFE_MODE

    def is_safe(self, status: int) -> bool:
        """Enter or leave safe mode, and tell whether it is on."""
        own = self._own
        if own.safe is None:
            return False
        fails = bool(status & own.failures)
        if own.release_after and self._good >= own.release_after and not fails:
            self._is_safe = False
        if own.safe_after and self._failed + fails >= own.safe_after:
            self._is_safe = True
        self._is_safe |= bool(status & STALE)
        return self._is_safe

    def noted(self, status: int) -> int:
        """Return the bit of the latch, at the end of a step with this status."""
        fails = bool(status & self._own.failures)
        self._failed, self._good = (self._failed + 1, 0) if fails else (0, self._good + 1)
        self._is_latched |= self._own.latch and fails
        return LATCHED if self._is_latched else 0
