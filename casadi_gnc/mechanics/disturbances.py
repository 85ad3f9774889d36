"""What comes from outside or from sensors: a constant plus a few harmonics."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

from casadi_gnc.mathematics.exact import array, is_zero


@dataclass(frozen=True)
class Harmonics:
    """Model d(t) = constant + sum_k amplitude_k sin(frequency_k t + phase_k), of any unit.

    Huang, Biggs, Duan (2020), section 5.1, has it for a torque.

    Parameters
    ----------
    constant : (3,).
    frequencies : K numbers, [rad/s].
    amplitudes : K rows of three numbers, unit of the constant.
    phases : K angles, [rad]; all zero if left out.
    """

    constant: tuple[float, ...] = (0.0, 0.0, 0.0)
    frequencies: tuple[float, ...] = ()
    amplitudes: tuple[tuple[float, ...], ...] = ()
    phases: tuple[float, ...] = ()

    def at(self, t: Any) -> Any:
        """Return d(t), (3,), at time t [s]."""
        total = array(self.constant)
        phases = self.phases or (0.0,) * len(self.frequencies)
        for frequency, amplitude, phase in zip(self.frequencies, self.amplitudes, phases, strict=True):
            total = total + array(amplitude) * ca.sin(frequency * t + phase)
        return total


@dataclass(frozen=True)
class OrbitalDisturbance:
    """Model d(t) = constant + sine sin(w_o t) + cosine cos(w_o t) + deviation n(t), force [N] and torque [N m].

    The chaser's orbital rate w_o = sqrt(mu) follows from where it is; n is standard normal and held
    as the engine holds it.

    Parameters
    ----------
    constant, sine, cosine : (6,), force and torque, chaser frame.
    deviation : (6,), standard deviation of the random part.
    """

    constant: tuple[float, ...] = (0.0,) * 6
    sine: tuple[float, ...] = (0.0,) * 6
    cosine: tuple[float, ...] = (0.0,) * 6
    deviation: tuple[float, ...] = (0.0,) * 6

    @property
    def is_random(self) -> bool:
        """Whether there is a random part."""
        return not all(is_zero(value) for value in self.deviation)

    def effort(self, t: Any, orbit_rate: Any) -> Any:
        """Return d(t) without its random part, (6,)."""
        phase, columns = orbit_rate * t, (array(part) for part in (self.constant, self.sine, self.cosine))
        constant, sine, cosine = columns
        return constant + sine * ca.sin(phase) + cosine * ca.cos(phase)
