"""The search for the numbers of an output feedback: from several starts, the smallest norm, then the smallest gain."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from casadi_gnc.synthesis.balancing import regulator
from casadi_gnc.synthesis.descent import descend
from casadi_gnc.synthesis.output_loop import OutputLoop
from casadi_gnc.synthesis.pattern import Pattern
from casadi_gnc.synthesis.performance import Performance

COST = 1e-4  # share of the norm that margins of its proof may cost
_DECADES = 1.5  # about the plant's rate, of the starts


@dataclass(frozen=True, eq=False)
class Found:
    """Hold the end of a descent: how far poles miss their regions, the norm's logarithm, numbers, and the start."""

    out: float
    value: float
    numbers: np.ndarray
    start: np.ndarray


def sought(loop: OutputLoop, tries: int) -> Found:
    """Return the best end of all starts."""
    rng, plant, count = np.random.default_rng(0), loop.plant, loop.pattern.shape[1]
    wanted = regulator(plant.A, plant.B, plant.C, plant.D) @ np.linalg.pinv(loop.M)
    begun = [np.linalg.lstsq(loop.pattern, wanted.ravel(), rcond=None)[0]]
    begun += [rng.normal(size=count) * 10.0 ** rng.uniform(-_DECADES, _DECADES) for _ in range(tries - 1)]
    ends = []
    for start in begun:
        out, inside = descend(loop.outside, start, enough=0.0)
        end = descend(loop.priced, inside)[1] if out <= 0 else inside
        ends.append(Found(max(loop.outside(end)[0], 0.0), loop.norm(end)[0], end, inside))
    return min(ends, key=lambda end: (end.out, end.value))


def smaller(loop: OutputLoop, best: Found, gamma: float) -> np.ndarray:
    """Return small numbers whose norm stays below gamma, and whose poles stay in their regions."""
    bound = (1 - COST) * gamma  # what the proof may cost
    near = descend(loop.priced, best.start, enough=float(np.log(bound)))[1]
    small = descend(lambda numbers: loop.size(numbers, bound), near)[1] if np.any(near) else near
    for numbers in (small, near):
        if loop.outside(numbers)[0] <= 0 and loop.norm(numbers)[0] <= np.log(gamma):
            return numbers
    return best.numbers


def in_units(
    plant: Performance, T: np.ndarray, M: np.ndarray, pattern: Pattern, rate: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the pattern for numbers near one, (m r, k), and the units of those numbers, (k,); T is of `balanced`."""
    pushed, seen = np.linalg.norm(T @ plant.B, axis=0), np.linalg.norm(M @ np.linalg.inv(T), axis=1)
    size = np.outer(np.where(pushed > 0, pushed, 1.0), np.where(seen > 0, seen, 1.0)).ravel()
    units = np.array([rate / np.exp(np.mean(np.log(size[column != 0]))) for column in pattern.entries.T])
    return pattern.entries * units, units
