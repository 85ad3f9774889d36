"""How far a loop is from instability: gain, phase and delay margins of each axis, from the linearised loop.

The loop is cut where the law hands its effort to the actuators, one axis at a time while the others stay closed. With v
what the actuators are told on that axis, w what the law then wants, and H from v to w, the loop closes by v = w:

    L = -H,   1 + L = 0 on the imaginary axis (continuous) or on the unit circle, z = exp(j omega h) (sampled)

=============  ==============================================================================================
margin         where it is read
=============  ==============================================================================================
gain           |1/L| where the phase of L is -180 degrees: the factors, below and above 1, that just destabilise
phase          angle of L above -180 degrees where |L| = 1, the smallest magnitude of all crossings
delay          time whose phase at such a crossing is the phase margin, the smallest of all crossings
distance       least |1 + L|: how near the curve comes to -1, the reciprocal of the peak of the sensitivity
=============  ==============================================================================================

Source: Skogestad, Postlethwaite, Multivariable Feedback Control, section 2.4. Margins of one axis say nothing of
changes in several at once.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from casadi_gnc.checking.linear import LinearLoop, opened

#: Frequencies of a curve; decades below the highest.
_POINTS, _DECADES = 4000, 7


@dataclass(frozen=True, eq=False)
class AxisMargins:
    """Hold the margins of one axis and the curve from which they are read.

    Parameters
    ----------
    axis : name of the row of effort.
    frequency : (K,), [rad/s].
    response : (K,), L, complex.
    gain_low, gain_high : factors that just destabilise, 0 and inf for none.
    phase : [rad], inf for none.
    delay : [s], inf for none.
    distance : least |1 + L|, [-].
    crossing : frequency at which |L| is 1 and the phase margin is read, [rad/s]; NaN for none.
    """

    axis: str
    frequency: np.ndarray
    response: np.ndarray
    gain_low: float
    gain_high: float
    phase: float
    delay: float
    distance: float
    crossing: float


def margins(loop: LinearLoop) -> list[AxisMargins]:
    """Return the margins of every axis of effort; none where the loop has no slope at its target."""
    a, b, c = opened(loop)
    if not a.size or not all(np.isfinite(each).all() for each in (a, b, c)):
        return []
    step = loop.mission.timing.sample_period if loop.sampled else 0.0
    frequency = _frequencies(a + b @ c, step)
    found = []
    for i, name in enumerate(names_of(loop)):
        others = [k for k in range(b.shape[1]) if k != i]
        cut = a + b[:, others] @ c[others]
        found.append(_read(name, frequency, -_response(cut, b[:, i], c[i], frequency, step)))
    return found


def names_of(loop: LinearLoop) -> list[str]:
    """Return the names of the rows of effort: "torque x"."""
    effort = loop.scheme.actuation.effort
    letters = {3: "xyz"}
    return [
        one.name if one.size == 1 else f"{one.name} {letters.get(one.size, '123456789')[k]}"
        for one in effort.signals
        for k in range(one.size)
    ]


def _frequencies(closed: np.ndarray, step: float) -> np.ndarray:
    """Return frequencies up to half the sample rate, or, continuous, far above the fastest pole, [rad/s]."""
    if step:
        highest = math.pi / step
    else:
        poles = np.abs(np.linalg.eigvals(closed)) if closed.size else np.ones(1)
        highest = 100.0 * float(poles.max(initial=1e-3))
    return np.geomspace(highest * 10.0**-_DECADES, highest, _POINTS)


def _response(a: np.ndarray, b: np.ndarray, c: np.ndarray, frequency: np.ndarray, step: float) -> np.ndarray:
    """Return c (p I - a)^-1 b for p on the imaginary axis or the unit circle, (K,), by the eigenvectors of a if it has.

    Near a double pole those are nearly parallel, and each frequency is solved for itself.
    """
    points = np.exp(1j * frequency * step) if step else 1j * frequency
    values, vectors = np.linalg.eig(a)
    if np.linalg.cond(vectors) < 1e6:
        weights = (c @ vectors) * np.linalg.solve(vectors, b.astype(complex))
        return (weights / (points[:, None] - values)).sum(axis=1)
    identity = np.eye(len(a))
    systems = points[:, None, None] * identity - a
    right = np.broadcast_to(b.astype(complex)[:, None], (len(points), len(a), 1))
    return (np.linalg.solve(systems, right)[..., 0] @ c).ravel()


def _read(axis: str, frequency: np.ndarray, response: np.ndarray) -> AxisMargins:
    size, turned = np.abs(response), -response  # the angle of -L is that above -180 degrees
    low, high = 0.0, math.inf
    reals, across = np.real(turned), np.imag(turned)
    for k in np.flatnonzero(np.diff(np.sign(across)) != 0):
        share = _zero(across[k], across[k + 1])
        real = float(reals[k] + share * (reals[k + 1] - reals[k]))
        if real > 0:  # on the negative real axis of L
            factor = 1.0 / real
            low, high = (low, min(high, factor)) if factor > 1 else (max(low, factor), high)
    phase, delay, crossing = math.inf, math.inf, math.nan
    logs = np.log(np.maximum(size, 1e-300))
    for k in np.flatnonzero(np.diff(np.sign(logs)) != 0):
        share = _zero(logs[k], logs[k + 1])
        at = float(np.exp(np.log(frequency[k]) + share * np.log(frequency[k + 1] / frequency[k])))
        angle = float(np.angle(turned[k] + share * (turned[k + 1] - turned[k])))
        if abs(angle) < abs(phase):
            phase, crossing = abs(angle), at
        delay = min(delay, (angle % (2 * math.pi)) / at)
    distance = float(np.abs(1 + response).min())
    return AxisMargins(axis, frequency, response, low, high, phase, delay, distance, crossing)


def _zero(before: float, after: float) -> float:
    """Return where between two values of different sign a line through them is zero."""
    return float(before / (before - after)) if before != after else 0.0


def as_data(found: list[AxisMargins]) -> list[dict[str, Any]]:
    """Return margins as plain data, in the units that reviews use; None for none."""

    def plain(value: float) -> float | None:
        return float(value) if math.isfinite(value) else None

    return [
        {
            "axis": one.axis,
            "gain_low": plain(one.gain_low) if one.gain_low > 0 else None,
            "gain_high": plain(one.gain_high),
            "phase_rad": plain(one.phase),
            "delay_s": plain(one.delay),
            "distance": plain(one.distance),
            "crossing_rad_per_s": plain(one.crossing),
        }
        for one in found
    ]
