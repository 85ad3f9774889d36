"""When things happen in a flight, and how its random numbers are drawn."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from casadi_gnc.errors import FlightError

Mode = Literal["sampled", "continuous"]


@dataclass(frozen=True)
class Timing:
    """Say when things happen.

    Parameters
    ----------
    mode : "sampled" (measure, hold, advance) or "continuous" (the law in every integrator stage).
    sample_period : [s].
    duration : [s].
    substeps : Runge-Kutta steps of the plant in one sample period.
    record_every : one sample of so many is kept.
    """

    mode: Mode
    sample_period: float
    duration: float
    substeps: int = 1
    record_every: int = 1

    def __post_init__(self) -> None:
        if self.mode not in ("sampled", "continuous"):
            raise FlightError(f"mode is {self.mode!r}, expected 'sampled' or 'continuous'")
        for name in ("sample_period", "duration", "substeps", "record_every"):
            value = getattr(self, name)
            if not (value > 0 and value < float("inf")):
                raise FlightError(f"{name} is {value}, expected a positive number")

    @property
    def samples(self) -> int:
        """Number of samples of a flight, both ends included."""
        return round(self.duration / self.sample_period) + 1


@dataclass(frozen=True)
class Noise:
    """Say how the random numbers of a flight are drawn.

    Parameters
    ----------
    seed : 0 to 2^64 - 1; the same seed gives the same flight on every machine.
    every : sample periods from draw to draw; the numbers are held in between.
    truncation : standard deviations beyond which a number is cut off.
    """

    seed: int = 1
    every: int = 1
    truncation: float = float("inf")
