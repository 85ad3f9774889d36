"""The standard normal law of arrays of numbers, with the same bits on every machine.

Rational approximations evaluated with `casadi_gnc.mathematics.elementary`; `scipy.special.ndtr` and `ndtri` are as
accurate, but their last bits follow the machine's libm. Quantile: Wichura (1988), algorithm AS 241,
doi:10.2307/2347330. Distribution function: Cody (1969), doi:10.1090/S0025-5718-1969-0247736-4, whose tails are
accurate relative to themselves.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np

from casadi_gnc.mathematics import elementary
from casadi_gnc.mathematics.exact import is_number

#: Numerators and denominators of the quantile: middle, tail, far tail; highest power first.
_MIDDLE = (
    (2.5090809287301226727e3, 3.3430575583588128105e4, 6.7265770927008700853e4, 4.5921953931549871457e4,
     1.3731693765509461125e4, 1.9715909503065514427e3, 1.3314166789178437745e2, 3.3871328727963666080e0),
    (5.2264952788528545610e3, 2.8729085735721942674e4, 3.9307895800092710610e4, 2.1213794301586595867e4,
     5.3941960214247511077e3, 6.8718700749205790830e2, 4.2313330701600911252e1, 1.0),
)  # fmt: skip
_TAIL = (
    (7.74545014278341407640e-4, 2.27238449892691845833e-2, 2.41780725177450611770e-1, 1.27045825245236838258e0,
     3.64784832476320460504e0, 5.76949722146069140550e0, 4.63033784615654529590e0, 1.42343711074968357734e0),
    (1.05075007164441684324e-9, 5.47593808499534494600e-4, 1.51986665636164571966e-2, 1.48103976427480074590e-1,
     6.89767334985100004550e-1, 1.67638483018380384940e0, 2.05319162663775882187e0, 1.0),
)  # fmt: skip
_FAR = (
    (2.01033439929228813265e-7, 2.71155556874348757815e-5, 1.24266094738807843860e-3, 2.65321895265761230930e-2,
     2.96560571828504891230e-1, 1.78482653991729133580e0, 5.46378491116411436990e0, 6.65790464350110377720e0),
    (2.04426310338993978564e-15, 1.42151175831644588870e-7, 1.84631831751005468180e-5, 7.86869131145613259100e-4,
     1.48753612908506148525e-2, 1.36929880922735805310e-1, 5.99832206555887937690e-1, 1.0),
)  # fmt: skip
#: The same of erf below 0.46875, of erfc e^(x^2) below 4, and of (1/sqrt(pi) - x erfc e^(x^2)) x^2 in 1/x^2 above.
_ERF = (
    (1.85777706184603153e-1, 3.16112374387056560e0, 1.13864154151050156e2, 3.77485237685302021e2,
     3.20937758913846947e3),
    (1.0, 2.36012909523441209e1, 2.44024637934444173e2, 1.28261652607737228e3, 2.84423683343917062e3),
)  # fmt: skip
_ERFC = (
    (2.15311535474403846e-8, 5.64188496988670089e-1, 8.88314979438837594e0, 6.61191906371416295e1,
     2.98635138197400131e2, 8.81952221241769090e2, 1.71204761263407058e3, 2.05107837782607147e3,
     1.23033935479799725e3),
    (1.0, 1.57449261107098347e1, 1.17693950891312499e2, 5.37181101862009858e2, 1.62138957456669019e3,
     3.29079923573345963e3, 4.36261909014324716e3, 3.43936767414372164e3, 1.23033935480374942e3),
)  # fmt: skip
_ERFC_FAR = (
    (1.63153871373020978e-2, 3.05326634961232344e-1, 3.60344899949804439e-1, 1.25781726111229246e-1,
     1.60837851487422766e-2, 6.58749161529837803e-4),
    (1.0, 2.56852019228982242e0, 1.87295284992346047e0, 5.27905102951428412e-1, 6.05183413124413191e-2,
     2.33520497626869185e-3),
)  # fmt: skip
#: Numbers that are worked on at a time: what fits the processor's cache.
_STRETCH = 8192
_ONE_OVER_ROOT_PI = 5.6418958354775628695e-1


def quantile(probability: np.ndarray) -> np.ndarray:
    """Return the number that a standard normal one stays below with a probability; infinite at 0 and 1."""
    return _by_stretches(_quantile, probability)


def quantile_of(probability: Any) -> Any:
    """Return the quantile of one probability, above 0 and below 1: a number, or the expression of a symbol."""
    if is_number(probability):
        return float(quantile(np.array(float(probability))))
    p = ca.SX(probability)
    q = p - 0.5
    middle = q * _ratio(_MIDDLE, 0.180625 - q * q)
    size = ca.sqrt(-ca.log(ca.if_else(q < 0, p, 1.0 - p)))
    tail = ca.if_else(size <= 5.0, _ratio(_TAIL, size - 1.6), _ratio(_FAR, size - 5.0))
    return ca.if_else(ca.fabs(q) <= 0.425, middle, ca.if_else(q < 0, -tail, tail))


def cumulative(x: np.ndarray) -> np.ndarray:
    """Return the probability that a standard normal number is below x."""
    return _by_stretches(_cumulative, x)


def _by_stretches(function: Callable[[np.ndarray], np.ndarray], x: np.ndarray) -> np.ndarray:
    given = np.asarray(x, dtype=float)
    flat = given.ravel()
    parts = [function(flat[start : start + _STRETCH]) for start in range(0, given.size, _STRETCH)]
    return np.concatenate(parts or [np.empty(0)]).reshape(given.shape)


def _quantile(p: np.ndarray) -> np.ndarray:
    q = p - 0.5
    found = q * _ratio(_MIDDLE, 0.180625 - q * q)
    outer = ~(np.abs(q) <= 0.425)
    found[outer] = _outer_quantile(p[outer])
    return found


def _outer_quantile(p: np.ndarray) -> np.ndarray:
    lower = p < 0.5
    with np.errstate(invalid="ignore"):
        size = np.sqrt(-elementary.log(np.where(lower, p, 1.0 - p)))
        finite = np.where(np.isfinite(size), size, 1.0)
    tail = np.where(finite <= 5.0, _ratio(_TAIL, finite - 1.6), _ratio(_FAR, finite - 5.0))
    tail = np.where(np.isfinite(size), tail, size)
    return np.where(lower, -tail, tail)


def _cumulative(x: np.ndarray) -> np.ndarray:
    y = np.abs(x) * math.sqrt(0.5)
    square = np.where(y < 0.46875, y * y, 0.0)
    near = 0.5 + 0.5 * np.where(x < 0.0, -1.0, 1.0) * y * _ratio(_ERF, square)
    medium = _ratio(_ERFC, np.minimum(y, 4.0))
    inverse = 1.0 / np.square(np.maximum(y, 4.0))
    far = (_ONE_OVER_ROOT_PI - inverse * _ratio(_ERFC_FAR, inverse)) / np.maximum(y, 4.0)
    # e^(-x^2/2) of a rounded square would lose digits: the head of x has an exact square.
    size = np.minimum(np.abs(x), 40.0)
    head = np.floor(size * 16.0) / 16.0
    weight = elementary.exp(-0.5 * head * head) * elementary.exp(-0.5 * (size - head) * (size + head))
    tail = 0.5 * weight * np.where(y <= 4.0, medium, far)
    return np.where(np.isnan(x), np.nan, np.where(y < 0.46875, near, np.where(x < 0.0, tail, 1.0 - tail)))


def _ratio(parts: tuple[tuple[float, ...], tuple[float, ...]], x: Any) -> Any:
    over, under = (_polynomial(coefficients, x) for coefficients in parts)
    return over / under


def _polynomial(coefficients: tuple[float, ...], x: Any) -> Any:
    total: Any = coefficients[0]
    for coefficient in coefficients[1:]:
        total = total * x + coefficient
    return total
