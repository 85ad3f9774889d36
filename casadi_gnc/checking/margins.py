"""Stability margins of a linear loop: how much gain, phase and delay it bears, one channel or all at once.

=========  =====================================================================================
symbol     meaning
=========  =====================================================================================
P, K       plant and controller, linear, held at the sample period h [s]; h = 0 is continuous
L          the loop broken at a channel, the others closed: L = -K P there, or -P K at a sensor
S, T       sensitivity 1/(1 + L) and its complement
=========  =====================================================================================

*Gain* margins are the nearest factors of L below and above 1 at which a pole reaches the boundary; *phase* margin is
the least turn of L that does so; *delay* margin that turn as a time, phase over frequency, exact for whole sample
periods. The *modulus* margin is the least distance of L from -1. The *disk* margin alpha is 1/max abs((S - T)/2): L may
be multiplied by any f with abs((f - 1)/(f + 1)) < alpha/2, gain and phase at once: gains from
(2 - alpha)/(2 + alpha) to its inverse, turns up to 2 atan(alpha/2). With all channels broken at once, each by its own
f, the largest singular value in place of the magnitude gives a value that is safe, and may be small.

Every finite gain and phase margin is confirmed by poles: with a factor a little beyond it one is outside. Modulus and
disk margins are of a grid of frequencies, refined where they are least.

Source: Seiler, Packard, Gahinet, An Introduction to Disk Margins, IEEE Control Systems Magazine 40(5), 2020,
doi:10.1109/MCS.2020.3005277.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

#: Frequencies looked at, and the largest factor of gain that is called infinite.
_GRID, _ENDLESS = 3000, 1e6
#: Poles slower than this part of the fastest are taken for integrators.
_SLOW = 1e-6
#: A pole this far outside the boundary has left it, relative; poles that start on it may stay.
_OUTSIDE = 1e-9
#: A margin is confirmed this far on both of its sides, relative.
_BESIDE = 1e-4


@dataclass(frozen=True, eq=False)
class Margins:
    """Hold the margins of one channel.

    Parameters
    ----------
    gain_low, gain_high : factors of the loop gain at which a pole leaves, below and above 1; 0 and inf for never.
    phase : least turn of the loop, either way, [rad]; pi for none.
    phase_at, gain_at : frequencies of the phase margin and of the nearer gain margin [rad/s]; NaN for none.
    delay : least delay that makes a pole leave, [s]; inf for none.
    modulus : least distance of L from -1, [-].
    disk, disk_at : alpha, [-], and where it is least [rad/s].
    """

    gain_low: float
    gain_high: float
    phase: float
    phase_at: float
    gain_at: float
    delay: float
    modulus: float
    disk: float
    disk_at: float

    @property
    def disk_gain(self) -> float:
        """The factor of gain, up or down, that the disk bears; inf from alpha = 2 on."""
        return (2 + self.disk) / (2 - self.disk) if self.disk < 2 else math.inf

    @property
    def disk_phase(self) -> float:
        """The turn that the disk bears, [rad]."""
        return 2 * math.atan(self.disk / 2)


@dataclass(frozen=True, eq=False)
class BrokenLoop:
    """Hold a loop that is cut: s' = A s + B u, w = C s + D u; it is closed by u = w, and L = -(u -> w).

    Parameters
    ----------
    A, B, C, D : matrices; as many inputs as outputs.
    period : h, [s]; 0 for a continuous loop.
    """

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray
    period: float = 0.0

    @property
    def channels(self) -> int:
        """Number of channels that are cut."""
        return self.B.shape[1]

    def at(self, frequencies: Any) -> np.ndarray:
        """Return L at frequencies [rad/s], (..., channels, channels), complex."""
        s = 1j * np.asarray(frequencies)[..., None, None]
        z = np.exp(s * self.period) if self.period else s
        stack = z * np.eye(len(self.A)) - self.A
        # As many right-hand sides as matrices: NumPy 1 takes a single one for a vector.
        right = np.broadcast_to(self.B, (*stack.shape[:-2], *self.B.shape))
        return -(self.C @ np.linalg.solve(stack, right) + self.D)

    def closed(self, factor: complex = 1.0) -> np.ndarray:
        """Return the matrix of the loop closed by u = factor w in every channel."""
        inner = np.linalg.solve(np.eye(self.channels) - factor * self.D, factor * self.C)
        return self.A + self.B @ inner

    def channel(self, i: int) -> BrokenLoop:
        """Return the loop with channel i cut alone, the others closed."""
        others = [j for j in range(self.channels) if j != i]
        back = np.linalg.inv(np.eye(len(others)) - self.D[np.ix_(others, others)])
        state, direct = back @ self.C[others], back @ self.D[np.ix_(others, [i])]
        return BrokenLoop(
            self.A + self.B[:, others] @ state,
            self.B[:, [i]] + self.B[:, others] @ direct,
            self.C[[i]] + self.D[np.ix_([i], others)] @ state,
            self.D[[i]][:, [i]] + self.D[np.ix_([i], others)] @ direct,
            self.period,
        )

    def is_stable(self, factor: complex = 1.0) -> bool:
        """Return whether no pole is outside; those that stand on the boundary whatever the factor do not count."""
        poles = np.linalg.eigvals(self.closed(factor))
        out = np.abs(poles) - 1 if self.period else poles.real / self._scale
        return bool(np.all(out < _OUTSIDE))

    @property
    def _scale(self) -> float:
        return float(np.abs(np.linalg.eigvals(self.closed())).max(initial=1.0))

    def frequencies(self) -> np.ndarray:
        """Return frequencies [rad/s] from far below the slowest pole to Nyquist's, or far above the fastest."""
        poles = np.concatenate([np.linalg.eigvals(self.A), np.linalg.eigvals(self.closed())])
        if self.period:
            poles = np.log(poles[np.abs(poles) > 1e-12]) / self.period
        sizes = np.abs(poles)
        sizes = sizes[sizes > _SLOW * sizes.max(initial=0.0)]  # what is slower stands still, but for rounding
        slowest, fastest = (sizes.min(), sizes.max()) if sizes.size else (1.0, 1.0)
        last = math.pi / self.period if self.period else 1e3 * fastest
        near = [
            frequency for p in poles for frequency in abs(p.imag) * (1 + np.linspace(-1e-2, 1e-2, 21)) if p.imag > 0
        ]
        grid = np.concatenate([np.geomspace(min(1e-3 * slowest, 1e-3 * last), last, _GRID), near])
        return np.unique(grid[(grid > 0) & (grid <= last)])


def margins(loop: BrokenLoop) -> Margins:
    """Return the margins of a loop that is cut at one channel.

    Raises
    ------
    ValueError
        For a loop with more channels, or one that is not stable when it is closed.
    """
    if loop.channels != 1:
        raise ValueError(f"the loop is cut at {loop.channels} channels, expected one; take `channel(i)`")
    if not loop.is_stable():
        raise ValueError("the closed loop is not stable, so it has no margins")
    grid = loop.frequencies()
    values: Any = loop.at(grid)[:, 0, 0]

    def value(w: float) -> complex:
        return complex(loop.at(w)[0, 0])

    real = _crossings(grid, values.imag, lambda w: value(w).imag)
    real += [float(grid[-1])] if loop.period else []
    gains = sorted((-1 / value(w).real, w) for w in real if value(w).real < 0)
    low, low_at = _confirmed(loop, [(g, w) for g, w in reversed(gains) if g < 1], 0.0)
    high, high_at = _confirmed(loop, [(g, w) for g, w in gains if g > 1], math.inf)
    turns = []
    for w in _crossings(grid, np.abs(values) - 1, lambda w: abs(value(w)) - 1):
        ahead = math.remainder(np.angle(value(w)) - math.pi, 2 * math.pi)
        # L reaches -1 by a turn back of `ahead`, or one forward of the rest.
        back = ahead % (2 * math.pi)
        turns += [(back, -1, w), (2 * math.pi - back, 1, w)]
    phase, phase_at = math.pi, math.nan
    for turn, sense, w in sorted(turns):
        if turn < math.pi and not loop.is_stable(np.exp(1j * sense * turn * (1 + _BESIDE))):
            phase, phase_at = turn, w
            break
    delay = min(((turn % (2 * math.pi)) / w for turn, sense, w in turns if sense < 0), default=math.inf)
    modulus, _ = least(grid, np.abs(1 + values), lambda w: abs(1 + value(w)))
    disk, disk_at = least(grid, _disk(values), lambda w: float(_disk(value(w))))
    nearer = low_at if low and 1 / low < high else high_at
    return Margins(low, high, phase, phase_at, nearer, delay, modulus, disk, disk_at)


def disk_of_all(loop: BrokenLoop) -> tuple[float, float]:
    """Return an alpha that all channels bear at once, each with its own factor, and where it is least [rad/s]."""

    def alpha(w: Any) -> np.ndarray:
        one, L = np.eye(loop.channels), loop.at(w)
        return 2 / np.linalg.norm(np.linalg.solve(one + L, one - L), 2, axis=(-2, -1))

    grid = loop.frequencies()
    return least(grid, alpha(grid), lambda w: float(alpha(w)))


def common_gain(loop: BrokenLoop) -> tuple[float, float]:
    """Return the factors, one for all channels, between which the loop stays stable; 0 and inf for never."""
    return _edge(loop, 1 / _ENDLESS) or 0.0, _edge(loop, _ENDLESS) or math.inf


def _edge(loop: BrokenLoop, end: float) -> float | None:
    """Return the first factor from 1 towards `end` at which a pole leaves, None if none does."""
    stable = 1.0
    for factor in np.geomspace(1.0, end, 400)[1:]:
        if not loop.is_stable(factor):
            outside = float(factor)
            while abs(outside / stable - 1) > 1e-9:
                middle = math.sqrt(outside * stable)
                stable, outside = (middle, outside) if loop.is_stable(middle) else (stable, middle)
            return stable
        stable = float(factor)
    return None


def _disk(L: np.ndarray | complex) -> np.ndarray:
    """Return 2 |1 + L|/|1 - L|, which is 1/|(S - T)/2|."""
    return 2 * np.abs(1 + L) / np.maximum(np.abs(1 - np.asarray(L)), 1e-300)


def _confirmed(loop: BrokenLoop, found: list[tuple[float, float]], never: float) -> tuple[float, float]:
    """Return the first gain behind which a pole is outside, and its frequency; the nearest comes first."""
    for gain, frequency in found:
        beyond = gain * (1 + math.copysign(_BESIDE, gain - 1))
        if not loop.is_stable(beyond):
            return gain, frequency
    return never, math.nan


def _crossings(grid: np.ndarray, values: np.ndarray, function: Callable[[float], float]) -> list[float]:
    """Return where a function changes its sign, the frequencies by bisection to rounding."""
    from scipy import optimize  # a flight does without

    at = np.flatnonzero(np.sign(values[1:]) * np.sign(values[:-1]) < 0)
    found: list[Any] = [optimize.brentq(function, grid[i], grid[i + 1], xtol=1e-15) for i in at]
    return [float(each) for each in found]


def least(grid: np.ndarray, values: np.ndarray, function: Callable[[float], float]) -> tuple[float, float]:
    """Return the least value and its frequency, refined around the least of the grid."""
    from scipy import optimize

    i = int(np.argmin(values))
    low, high = grid[max(i - 1, 0)], grid[min(i + 1, len(grid) - 1)]
    found = optimize.minimize_scalar(function, bounds=(low, high), method="bounded", options={"xatol": 1e-9 * high})
    value, place = float(found.fun), float(found.x)
    return (value, place) if value < values[i] else (float(values[i]), float(grid[i]))
