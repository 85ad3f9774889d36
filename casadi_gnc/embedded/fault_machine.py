"""What a package does with faults, by Python: the reference that compiled code is compared with."""

from __future__ import annotations

import numpy as np

from casadi_gnc.embedded.controller import Controller
from casadi_gnc.embedded.faults import LATCHED, SAFE_MODE, STALE, Faults


class HandledFaults:
    """Remember what the options of a controller's faults remember, from step to step."""

    def __init__(self, controller: Controller) -> None:
        self._own = controller.faults or Faults()
        self._rows = {name: controller.measured.place(name) for name, _ in self._own.ages}
        self._held = dict.fromkeys(self._rows, 0)
        self._is_safe, self._failed, self._good, self._is_latched = False, 0, 0, False
        rows = controller.limited.size
        #: What the tape of the law is given where gains could fade and never were changed.
        self.unfaded = {"last": [0.0] * rows, "offset": [0.0] * rows, "share": 0.0, "changed": 0.0}

    def aged(self, y: np.ndarray, accepted: np.ndarray) -> int:
        """Return the bit of a measurement that is held for too long."""
        status = 0
        for name, most in self._own.ages:
            same = (y[self._rows[name]] == accepted[self._rows[name]]).all()
            self._held[name] = 0 if same else self._held[name] + 1
            status |= STALE if self._held[name] > most else 0
        return status

    def guarded(
        self, status: int, told: np.ndarray, previous: np.ndarray, lower: np.ndarray, upper: np.ndarray
    ) -> tuple[np.ndarray, int]:
        """Return what the actuators are told, and the bit of safe mode."""
        own = self._own
        if own.safe is None:
            return told, 0
        fails = bool(status & own.failures)
        if own.release_after and self._good >= own.release_after and not fails:
            self._is_safe = False
        if own.safe_after and self._failed + fails >= own.safe_after:
            self._is_safe = True
        self._is_safe |= bool(status & STALE)
        if not self._is_safe:
            return told, 0
        return np.minimum(np.maximum(own.safe or previous, lower), upper), SAFE_MODE

    def noted(self, status: int) -> int:
        """Return the bit of the latch, at the end of a step with this status."""
        fails = bool(status & self._own.failures)
        self._failed, self._good = (self._failed + 1, 0) if fails else (0, self._good + 1)
        self._is_latched |= self._own.latch and fails
        return LATCHED if self._is_latched else 0
