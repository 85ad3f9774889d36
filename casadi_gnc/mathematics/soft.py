"""Largest and least of a column, and how much each element counts: exact, or smooth companions at a temperature.

The soft maximum of n numbers at temperature T > 0 is T log(sum exp(v / T)). It lies between the maximum and the maximum
plus T log n; its derivatives are positive and sum to 1. At T = 0 it is the maximum itself, whose first element counts.
"""

from __future__ import annotations

import math

import numpy as np


def soft_maximum(values: np.ndarray, temperature: float) -> tuple[float, np.ndarray]:
    """Return the soft maximum of (n,) numbers and its derivatives, (n,); n >= 1.

    Examples
    --------
    >>> value, counts = soft_maximum(np.array([0.0, 1.0, 1.0]), 0.1)
    >>> f"{value:.4f}", counts.round(4).tolist()
    ('1.0693', [0.0, 0.5, 0.5])
    """
    at = int(np.argmax(values))
    if not temperature > 0:
        return float(values[at]), (np.arange(len(values)) == at).astype(float)
    with np.errstate(under="ignore"):
        sizes = np.exp((values - values[at]) / temperature)
        total = float(sizes.sum())
        return float(values[at]) + temperature * math.log(total), sizes / total


def soft_minimum(values: np.ndarray, temperature: float) -> tuple[float, np.ndarray]:
    """Return the soft minimum of (n,) numbers, T log n below the minimum at most, and its derivatives."""
    value, counts = soft_maximum(-values, temperature)
    return -value, counts


def slack(count: int, temperature: float) -> float:
    """Return how far a soft maximum of so many numbers may be from the maximum, T log n."""
    return temperature * math.log(max(1, count))
