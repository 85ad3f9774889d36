# SPDX-License-Identifier: MIT-0
"""Arguments of the elementary functions, their special values by Annex F of C99, and truth: mpmath with 140 bits.

Shared by `tests/embedded/test_gnc_math*.py` and `tests/bench/math_accuracy.py`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from fractions import Fraction

import numpy as np
from math_functions import DOUBLE, HEADERS, Precision
from mpmath import libmp

# ---- Arguments ----------------------------------------------------------------------------------------------


def any_finite(rng: np.random.Generator, p: Precision, n: int) -> np.ndarray:
    """Draw from the bit patterns: every exponent and subnormal numbers, both signs."""
    x = rng.integers(0, np.iinfo(p.bits).max, 2 * n + 64, dtype=p.bits, endpoint=True).view(p.dtype)
    return x[np.isfinite(x)][:n]


def neighbours(p: Precision, centres) -> np.ndarray:
    """Each centre, and the numbers one, two and seven steps to either side of it."""
    centres = np.asarray(centres, p.dtype)
    bits = centres.view(p.bits).astype(object)
    return np.array([b + s for b in bits for s in (-7, -2, -1, 0, 1, 2, 7) if b + s >= 0], p.bits).view(p.dtype)


def arguments(name: str, p: Precision, n: int, seed: int = 20240229) -> tuple[np.ndarray, ...]:
    """Random and structured arguments within the range in which the header states an accuracy."""
    rng = np.random.default_rng(seed)
    every = any_finite(rng, p, n)
    unit = rng.uniform(-1, 1, n)
    powers = 2.0 ** np.arange(-40, 41, 5)
    structured = neighbours(p, np.concatenate([powers, [0.5, 0.41421356237309503, 0.7071067811865476, math.sqrt(2)]]))
    tiny = np.array([2.0**p.smallest_exponent, 2.0 ** (p.smallest_exponent + p.digits - 1)])
    tiny = np.concatenate([tiny, 3 * tiny[:1], tiny[1:] - tiny[0]])
    mixed = np.concatenate([every, 8 * unit, structured, tiny]).astype(p.dtype)
    mixed = np.concatenate([mixed, -mixed])
    if name in ("sin", "cos", "tan"):
        limit = 2.0**20 if p is DOUBLE else 1e4
        quarters = np.unique(np.concatenate([np.arange(1, 40), rng.integers(1, int(limit / 1.58), n // 8)]))
        mixed = np.concatenate([mixed, neighbours(p, quarters * (math.pi / 2)), unit * limit]).astype(p.dtype)
        return (mixed[np.abs(mixed) <= limit],)
    if name in ("exp", "expm1", "sinh", "cosh", "tanh"):
        top = math.log(2) * (p.smallest_exponent - 1)
        halves = neighbours(p, np.arange(1, 40) * (math.log(2) / 2))
        edges = neighbours(p, [-top, 709.782712893384, 88.72284, 37.4, 17.3, 22.0, 9.01])
        mixed = np.concatenate([mixed, halves, -halves, edges, -edges, unit * top]).astype(p.dtype)
        return (mixed[np.abs(mixed) <= -1.01 * top],)
    if name in ("log", "log1p"):
        near_one = 1 + unit * 2.0 ** -rng.uniform(0, p.digits, n)
        mixed = np.concatenate([mixed, near_one, near_one - 1]).astype(p.dtype)
        return (mixed[mixed > (0 if name == "log" else -1)],)
    if name in ("asin", "acos"):
        near_one = 1 - 2.0 ** -rng.uniform(1, p.digits, n)
        mixed = np.concatenate([mixed, unit, near_one, -near_one]).astype(p.dtype)
        return (mixed[np.abs(mixed) <= 1],)
    if name in ("atan2", "copysign", "fmod", "remainder", "min", "max"):
        other = any_finite(rng, p, n)
        with np.errstate(over="ignore"):
            related = (other * (unit * 2.0 ** rng.uniform(-30, 20, n))).astype(p.dtype)
        size = min(other.size, n, mixed.size)
        a = np.concatenate([every[:size], related[:size], unit[:size], structured])
        b = np.concatenate([other[:size], other[:size], rng.uniform(-1, 1, size), rng.permutation(structured)])
        a, b = a.astype(p.dtype), b.astype(p.dtype)
        keep = np.isfinite(a) & np.isfinite(b) & (a != 0) & (b != 0)  # mpmath has no -0
        if name in ("fmod", "remainder"):
            with np.errstate(over="ignore", divide="ignore"):
                keep &= np.abs(a.astype(np.longdouble) / b) < 2.0 ** (p.digits - 1)
        return a[keep], b[keep]
    if name == "pow":
        top = math.log(2) * (p.smallest_exponent - 1)
        near_one = (1 + unit * 2.0 ** -rng.uniform(1, p.digits, n)).astype(p.dtype)
        base = np.concatenate([np.abs(every), near_one, rng.uniform(0, 4, n), -structured]).astype(p.dtype)
        log_base = np.log(np.abs(base.astype(np.float64)))
        log_base[log_base == 0] = 1.0
        power = rng.uniform(top, -top, base.size) / log_base
        power[-structured.size :] = rng.integers(-9, 9, structured.size)
        power = power.astype(p.dtype)
        keep = np.isfinite(power) & (base != 0)
        return base[keep], power[keep]
    if name == "sqrt":
        return (np.abs(mixed),)
    halves = rng.integers(-1000, 1000, n) / 2
    return (np.concatenate([mixed, halves, unit * 2.0 ** (p.digits - 1)]).astype(p.dtype),)


# ---- Special values, by Annex F of C99 -----------------------------------------------------------------------

INF, NAN = math.inf, math.nan
PI = math.pi
#: Function to rows of arguments and the result.
# fmt: off
SPECIAL = {
    "exp": [(0.0, 1), (-0.0, 1), (INF, INF), (-INF, 0.0), (NAN, NAN), (1e30, INF), (-1e30, 0.0)],
    "expm1": [(0.0, 0.0), (-0.0, -0.0), (INF, INF), (-INF, -1), (NAN, NAN), (1e30, INF), (-1e30, -1)],
    "log": [(1, 0.0), (0.0, -INF), (-0.0, -INF), (INF, INF), (-1, NAN), (-INF, NAN), (NAN, NAN)],
    "log1p": [(0.0, 0.0), (-0.0, -0.0), (-1, -INF), (-1.5, NAN), (INF, INF), (-INF, NAN), (NAN, NAN)],
    "sin": [(0.0, 0.0), (-0.0, -0.0), (INF, NAN), (-INF, NAN), (NAN, NAN)],
    "cos": [(0.0, 1), (-0.0, 1), (INF, NAN), (-INF, NAN), (NAN, NAN)],
    "tan": [(0.0, 0.0), (-0.0, -0.0), (INF, NAN), (-INF, NAN), (NAN, NAN)],
    "sinh": [(0.0, 0.0), (-0.0, -0.0), (INF, INF), (-INF, -INF), (NAN, NAN), (1e30, INF), (-1e30, -INF)],
    "cosh": [(0.0, 1), (-0.0, 1), (INF, INF), (-INF, INF), (NAN, NAN), (-1e30, INF)],
    "tanh": [(0.0, 0.0), (-0.0, -0.0), (INF, 1), (-INF, -1), (NAN, NAN), (1e30, 1), (-1e30, -1)],
    "erf": [(0.0, 0.0), (-0.0, -0.0), (INF, 1), (-INF, -1), (NAN, NAN), (1e30, 1), (-1e30, -1)],
    "asin": [(0.0, 0.0), (-0.0, -0.0), (1, PI / 2), (-1, -PI / 2), (1.5, NAN), (-INF, NAN), (NAN, NAN)],
    "acos": [(1, 0.0), (-1, PI), (0.0, PI / 2), (-0.0, PI / 2), (1.5, NAN), (INF, NAN), (NAN, NAN)],
    "atan": [(0.0, 0.0), (-0.0, -0.0), (INF, PI / 2), (-INF, -PI / 2), (1, PI / 4), (NAN, NAN)],
    "sqrt": [(0.0, 0.0), (-0.0, -0.0), (INF, INF), (-1, NAN), (-INF, NAN), (NAN, NAN)],
    "fabs": [(-0.0, 0.0), (-INF, INF), (NAN, NAN)],
    "floor": [(0.0, 0.0), (-0.0, -0.0), (0.5, 0.0), (-0.5, -1), (INF, INF), (-INF, -INF), (NAN, NAN)],
    "ceil": [(0.0, 0.0), (-0.0, -0.0), (0.5, 1), (-0.5, -0.0), (INF, INF), (-INF, -INF), (NAN, NAN)],
    "sign": [(0.0, 0.0), (-0.0, -0.0), (INF, 1), (-INF, -1), (3, 1), (-3, -1), (NAN, NAN)],
    "copysign": [(1, -0.0, -1), (-1, 0.0, 1), (INF, -1, -INF), (0.0, -INF, -0.0)],
    "fmod": [
        (0.0, 3, 0.0), (-0.0, 3, -0.0), (5, INF, 5), (-5, -INF, -5), (INF, 3, NAN), (-INF, 3, NAN),
        (5, 0.0, NAN), (5, -0.0, NAN), (0.0, 0.0, NAN), (NAN, 1, NAN), (1, NAN, NAN), (INF, INF, NAN),
        (6, 3, 0.0), (-6, 3, -0.0), (5, -3, 2), (-5, 3, -2), (1e30, 1e-6, 0.0), (-1e30, 1e-6, -0.0),
    ],
    "remainder": [
        (0.0, 3, 0.0), (-0.0, 3, -0.0), (5, INF, 5), (-5, -INF, -5), (INF, 3, NAN), (-INF, 3, NAN),
        (5, 0.0, NAN), (5, -0.0, NAN), (0.0, 0.0, NAN), (NAN, 1, NAN), (1, NAN, NAN), (INF, INF, NAN),
        (6, 3, 0.0), (-6, 3, -0.0), (5, -3, -1), (-5, 3, 1), (5, 2, 1), (7, 2, -1), (1, 2, 1), (3, 2, -1), (-3, 2, 1),
        (1e30, 1e-6, 0.0), (-1e30, 1e-6, -0.0),
    ],
    "min": [
        (1, 2, 1), (2, 1, 1), (-INF, INF, -INF), (0.0, -0.0, -0.0), (-0.0, 0.0, 0.0), (1, NAN, NAN), (NAN, 1, 1),
    ],
    "max": [
        (1, 2, 2), (2, 1, 2), (-INF, INF, INF), (0.0, -0.0, -0.0), (-0.0, 0.0, 0.0), (1, NAN, NAN), (NAN, 1, 1),
    ],
    "atan2": [
        (0.0, 0.0, 0.0), (-0.0, 0.0, -0.0), (0.0, -0.0, PI), (-0.0, -0.0, -PI), (0.0, -1, PI),
        (-0.0, -1, -PI), (0.0, 1, 0.0), (-0.0, 1, -0.0), (1, 0.0, PI / 2), (-1, 0.0, -PI / 2), (1, -0.0, PI / 2),
        (1, INF, 0.0), (-1, INF, -0.0), (1, -INF, PI), (-1, -INF, -PI), (INF, 1, PI / 2), (-INF, 1, -PI / 2),
        (INF, INF, PI / 4), (-INF, INF, -PI / 4), (INF, -INF, 3 * PI / 4), (-INF, -INF, -3 * PI / 4),
        (1, 1, PI / 4), (-1, -1, -3 * PI / 4), (NAN, 1, NAN), (1, NAN, NAN), (NAN, INF, NAN), (INF, NAN, NAN),
    ],
    "pow": [
        (0.0, -3, INF), (-0.0, -3, -INF), (0.0, -2, INF), (-0.0, -2, INF), (-0.0, -0.5, INF), (0.0, -INF, INF),
        (0.0, 3, 0.0), (-0.0, 3, -0.0), (-0.0, 2, 0.0), (-0.0, 0.5, 0.0), (-1, INF, 1), (-1, -INF, 1), (1, NAN, 1),
        (NAN, 0.0, 1), (NAN, -0.0, 1), (INF, 0.0, 1), (0.0, 0.0, 1), (1, INF, 1), (1, -INF, 1), (-2, 0.5, NAN),
        (0.5, -INF, INF), (2, -INF, 0.0), (0.5, INF, 0.0), (2, INF, INF), (-0.5, INF, 0.0), (-2, INF, INF),
        (-INF, -3, -0.0), (-INF, -2, 0.0), (-INF, -0.5, 0.0), (-INF, 3, -INF), (-INF, 2, INF), (-INF, 0.5, INF),
        (INF, -1, 0.0), (INF, 1, INF), (NAN, 1, NAN), (2, NAN, NAN), (-2, 3, -8), (-2, 2, 4), (-2, -3, -0.125),
        (2, 1e30, INF), (2, -1e30, 0.0), (0.5, 1e30, 0.0), (-2, 1e30, INF), (-1, 1e30, 1), (1, 1e30, 1),
        (0.0, INF, 0.0), (-1, 8388607, -1), (-1, 8388606, 1), (-1, 0.5, NAN), (-3, 1, -3), (10, 2, 100),
        (2, -126, 2.0**-126),
    ],
}
# fmt: on


# ---- Truth --------------------------------------------------------------------------------------------------

BITS = 140  # of truth
LITTLE = libmp.from_man_exp(1, -60)


def _expm1(x):
    """Return e^x - 1 as 2 e^(x/2) sinh(x/2), which does not cancel."""
    half = libmp.mpf_shift(x, -1)
    sinh = libmp.mpf_sinh(half, BITS + 10)
    return libmp.mpf_shift(libmp.mpf_mul(libmp.mpf_exp(half, BITS + 10), sinh, BITS), 1)


def _log1p(x):
    """Return log(1 + x); for |x| < 2^-60 three terms of its series, whose error is below 2^-180."""
    if libmp.mpf_lt(libmp.mpf_abs(x), LITTLE):
        x2 = libmp.mpf_mul(x, x, BITS)
        third = libmp.mpf_div(libmp.mpf_mul(x2, x, BITS), libmp.from_int(3), BITS)
        return libmp.mpf_add(libmp.mpf_sub(x, libmp.mpf_shift(x2, -1), BITS), third, BITS)
    return libmp.mpf_log(libmp.mpf_add(libmp.fone, x), BITS)


def _sign(x):
    return libmp.from_int(libmp.mpf_sign(x))


def _one(f: Callable) -> Callable:
    return lambda x: f(x, BITS)


def _remainder(x, y):
    """x - n y with n the whole number next to x/y, of two the even one, in rational numbers."""
    a, b = (Fraction(libmp.to_float(one)) for one in (x, y))
    return libmp.from_float(float(a - round(a / b) * b))


#: Function to exact value, on numbers as mpmath keeps them.
TRUTH: dict[str, Callable] = {
    name: _one(getattr(libmp, f"mpf_{name}"))
    for name in ("exp", "log", "sin", "cos", "tan", "sinh", "cosh", "tanh", "asin", "acos", "atan", "floor", "ceil")
} | {
    "expm1": _expm1,
    "log1p": _log1p,
    "erf": _one(libmp.mpf_erf),
    "fabs": libmp.mpf_abs,
    "sign": _sign,
    "atan2": lambda y, x: libmp.mpf_atan2(y, x, BITS),
    "pow": lambda x, y: libmp.mpf_pow(x, y, BITS),
    "min": lambda x, y: x if libmp.mpf_lt(x, y) else y,
    "max": lambda x, y: x if libmp.mpf_gt(x, y) else y,
    "fmod": lambda x, y: libmp.from_float(math.fmod(libmp.to_float(x), libmp.to_float(y))),  # exact in C
    "remainder": _remainder,
    "copysign": lambda x, y: libmp.mpf_abs(x) if libmp.mpf_sign(y) >= 0 else libmp.mpf_neg(libmp.mpf_abs(x)),
}


def ulp_error(got: float, exact, p: Precision) -> float:
    """|got - exact| in units in the last place of exact; infinity counts as the power of two past the largest."""
    if math.isnan(got):
        return math.inf
    top = 3 - p.smallest_exponent - p.digits  # the power of two past the largest number
    size = exact[2] + exact[3]  # exact < 2^size
    if math.isinf(got):
        largest = libmp.from_man_exp(2 ** (p.digits + 1) - 1, top - p.digits - 1)  # above it, rounding gives infinity
        beyond = libmp.mpf_ge(libmp.mpf_abs(exact), largest)
        return 0.0 if beyond and (got > 0) == (exact[0] == 0) else math.inf
    if size > top:
        return math.inf
    unit = max(size - p.digits, p.smallest_exponent)
    difference = libmp.mpf_abs(libmp.mpf_sub(libmp.from_float(got), exact, 30))
    return libmp.to_float(libmp.mpf_shift(difference, -unit))


def worst_error(name: str, p: Precision, columns: Sequence[np.ndarray], got: np.ndarray) -> tuple[float, tuple]:
    """Return the largest error in ulp and where it is: the arguments."""
    truth, worst, where = TRUTH[name], -1.0, ()
    for *values, y in zip(*(c.tolist() for c in columns), got.tolist(), strict=True):
        error = ulp_error(y, truth(*map(libmp.from_float, values)), p)
        if error > worst:
            worst, where = error, tuple(values)
    return worst, where


def stated_bound(name: str, p: Precision) -> float:
    """Read `max u ulp` from the comment above a function."""
    text = HEADERS[p.name].read_text()
    before = text[: text.index(f" gnc_{name}{p.suffix}(", text.index("Exact functions"))]
    comment = before[before.rindex("/*") :]
    return float(re.search(r"max ([0-9.]+) ulp", comment).group(1))


def stated_range(name: str, p: Precision) -> str:
    """Read the range that the bound holds in from the comment above a function."""
    text = HEADERS[p.name].read_text()
    before = text[: text.index(f" gnc_{name}{p.suffix}(", text.index("Exact functions"))]
    comment = " ".join(before[before.rindex("/*") :].replace("*", " ").split())
    return re.search(r"([^.:;]*); max [0-9.]+ ulp", comment).group(1).strip()
