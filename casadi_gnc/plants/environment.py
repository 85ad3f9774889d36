"""Disturbances from outside: torque that is constant plus a few harmonics."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca


@dataclass(frozen=True)
class HarmonicTorque:
    """Model d(t) = constant + sum_k amplitude_k sin(frequency_k t), body frame.

    Huang, Biggs, Duan (2020), section 5.1.

    Parameters
    ----------
    constant : (3,), [N m].
    frequencies : K numbers, [rad/s].
    amplitudes : K rows of three numbers, [N m].
    """

    constant: tuple[float, ...] = (0.0, 0.0, 0.0)
    frequencies: tuple[float, ...] = ()
    amplitudes: tuple[tuple[float, ...], ...] = ()

    def torque(self, t: Any) -> Any:
        """Return d(t), (3,), [N m]."""
        total = ca.DM(list(self.constant))
        for frequency, amplitude in zip(self.frequencies, self.amplitudes, strict=True):
            total = total + ca.DM(list(amplitude)) * ca.sin(frequency * t)
        return total
