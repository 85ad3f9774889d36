"""The classical Runge-Kutta method of order 4, written once for plants and memories.

k1 = f(t, x), k2 = f(t + h/2, x + h/2 k1), k3 = f(t + h/2, x + h/2 k2), k4 = f(t + h, x + h k3)
x(t + h) = x + h/6 (k1 + 2 k2 + 2 k3 + k4)
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any


def runge_kutta(rate: Callable[[Any, Any], Any], t: Any, x: Any, h: Any) -> Any:
    """Return x after one step of length h of x' = rate(t, x)."""
    k1 = rate(t, x)
    k2 = rate(t + h / 2, x + h / 2 * k1)
    k3 = rate(t + h / 2, x + h / 2 * k2)
    k4 = rate(t + h, x + h * k3)
    total = k1
    for weight, slope in zip(WEIGHTS[1:], (k2, k3, k4), strict=True):
        total = weigh(total, weight, slope)
    return join(x, h, total)


#: Of the slopes of the four stages in their sum.
WEIGHTS = (1, 2, 2, 1)


def weigh(total: Any, weight: Any, slope: Any) -> Any:
    """Return a sum of slopes with one more."""
    return total + weight * slope


def join(x: Any, h: Any, total: Any) -> Any:
    """Return x after one step, from the weighed sum of the slopes of its four stages."""
    return x + h / 6 * total
