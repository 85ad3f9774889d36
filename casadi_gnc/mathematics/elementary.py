"""Elementary functions of arrays of numbers, with the same bits on every machine.

NumPy's own take other paths on processors with other vector units, and libm differs between systems, in the last
bits. What decides a case of a campaign must not: whoever flies case 17 again, anywhere, flies the same numbers. The
functions here are those of `codegen/runtime/gnc_math.h`, operation by operation, from what IEEE 754 rounds in one way
only: + - * / and integer operations on the bit pattern. That file says how accurate they are, and why each step is
there; a test compares the words.

All take and return arrays of float64 of any shape.
"""

from __future__ import annotations

from decimal import Decimal, localcontext
from functools import cache

import numpy as np

_ROUNDER = float.fromhex("0x1.8p52")
_LN2_HEAD, _LN2_TAIL = float.fromhex("0x1.62e42fefa38p-1"), float.fromhex("0x1.ef35793c7673p-45")


def _numbers(text: str) -> tuple[float, ...]:
    return tuple(float.fromhex(each) for each in text.split())


_LN2_64TH = _numbers("0x1.62e42fefap-7 0x1.cf79abc9e3b3ap-46")
_64_OVER_LN2 = float.fromhex("0x1.71547652b82fep+6")
_EXP = _numbers("0x1.5555555555252p-3 0x1.55555555553d4p-5 0x1.11111d9625013p-7 0x1.6c16cdf12aa29p-10")
_LOG = _numbers(
    "0x1.5555555555592p-1 0x1.999999997fd11p-2 0x1.24924941fb26cp-2 0x1.c71c5200a378ap-3 0x1.746640cfef102p-3 "
    "0x1.39a186c8ecd3cp-3 0x1.2f0789afb6648p-3"
)
_SIN = _numbers(
    "-0x1.5555555555549p-3 0x1.111111110f86fp-7 -0x1.a01a019c10144p-13 0x1.71de3576572a3p-19 -0x1.ae5e651d24613p-26 "
    "0x1.5d92ab7121f5p-33"
)
_COS = _numbers(
    "0x1.555555555554cp-5 -0x1.6c16c16c15171p-10 0x1.a01a019cb0777p-16 -0x1.27e4f808fa977p-22 0x1.1ee9eb3b49805p-29 "
    "-0x1.8fae3f2878963p-37"
)
_TWO_OVER_PI = float.fromhex("0x1.45f306dc9c883p-1")
_HALF_PI = _numbers("0x1.921fb544p+0 0x1.0b4611a6p-34 0x1.3198a2ep-69 0x1.b839a252049c1p-104")

_Pair = tuple[np.ndarray, np.ndarray]


def exp(x: np.ndarray) -> np.ndarray:
    """Return e^x."""
    x = np.asarray(x, dtype=float)
    with np.errstate(invalid="ignore", over="ignore", under="ignore"):
        capped = np.where(np.abs(x) < 746.0, x, np.copysign(746.0, np.where(np.isnan(x), 0.0, x)))
        shifted = capped * _64_OVER_LN2 + _ROUNDER
        n = shifted - _ROUNDER
        r = (capped - n * _LN2_64TH[0]) + (0.0 - n * _LN2_64TH[1])
        r2 = r * r
        high = (_EXP[1] + r * _EXP[2]) + r2 * _EXP[3]
        hi, lo = (nodes[_bits(shifted) & 63] for nodes in _roots_of_two())
        y = hi + (lo + hi * (r + r2 * ((0.5 + r * _EXP[0]) + r2 * high)))
        k = (_bits(shifted) - _bits(np.array(_ROUNDER))) >> 6
        half = ((k + 4096) >> 1) - 2048
        scaled = (y * _power_of_2(half)) * _power_of_2(k - half)
    return np.where(np.isnan(x), np.nan, scaled)


@cache
def _roots_of_two() -> _Pair:
    """Return 2^(j/64) for j from 0 to 63, each rounded once, and what that leaves."""
    with localcontext(prec=60):
        exact = [Decimal(2) ** (Decimal(j) / 64) for j in range(64)]
        hi = [float(each) for each in exact]
        return np.array(hi), np.array([float(each - Decimal(near)) for each, near in zip(exact, hi, strict=True)])


def log(x: np.ndarray) -> np.ndarray:
    """Return the natural logarithm of x; -inf of 0, NaN of negative numbers."""
    x = np.asarray(x, dtype=float)
    inside = (x > 0.0) & (x < np.inf)
    safe = np.where(inside, x, 1.0)
    tiny = safe < 2.0**-1022
    bits = _bits(safe * np.where(tiny, 2.0**54, 1.0))
    biased = ((bits - 0x3FE6A09E667F3BCD) >> 52) + 1024
    k = (biased - 1024) - np.where(tiny, 54.0, 0.0)
    f = _from_bits(bits - ((biased - 1024) << 52)) - 1.0
    s = f / (2.0 + f)
    z = s * s
    z3 = z * z * z
    p = z * (_poly3(z, *_LOG[:3]) + z3 * (_poly3(z, *_LOG[3:6]) + z3 * _LOG[6]))
    half_hi, half_lo = _half_square(f)
    b_hi, b_lo = _sum_sorted(f, -half_hi)
    a_hi, a_lo = _sum_sorted(k * _LN2_HEAD, b_hi)
    small = (b_lo - half_lo) + s * (0.5 * f * f + p)
    finite = a_hi + (a_lo + (small + (k * _LN2_TAIL + 0.0)))
    outside = np.where(x == 0.0, -np.inf, np.where(x == np.inf, np.inf, np.nan))
    return np.where(inside, finite, outside)


def sin_cos(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return sine and cosine of angles [rad] of magnitude up to 2^20."""
    x = np.asarray(x, dtype=float)
    size = np.where(np.abs(x) <= 2.0**30, np.abs(x), 0.0)
    shifted = size * _TWO_OVER_PI + _ROUNDER
    n = shifted - _ROUNDER
    r2, r2_lo = _sum(size - n * _HALF_PI[0], -(n * _HALF_PI[1]))
    r3, r3_lo = _sum(r2, -(n * _HALF_PI[2]))
    r, r_lo = _sum_sorted(r3, (r2_lo + r3_lo) - n * _HALF_PI[3])
    z = r * r
    z3 = z * z * z
    sine = r + (r * z * (_poly3(z, *_SIN[:3]) + z3 * _poly3(z, *_SIN[3:])) + (r_lo - 0.5 * z * r_lo))
    half_hi, half_lo = _half_square(r)
    c_hi, c_lo = _sum_sorted(1.0, -half_hi)
    c_lo = c_lo + (z * z * (_poly3(z, *_COS[:3]) + z3 * _poly3(z, *_COS[3:])) - (half_lo + r * r_lo))
    cosine = c_hi + c_lo
    quarter = _bits(shifted)
    sin_x = np.where(np.signbit(x), -1.0, 1.0) * _of_quarter(sine, cosine, quarter)
    cos_x = _of_quarter(sine, cosine, quarter + 1)
    finite = np.isfinite(x)
    return np.where(finite, sin_x, np.nan), np.where(finite, cos_x, np.nan)


def _of_quarter(sine: np.ndarray, cosine: np.ndarray, quarter: np.ndarray) -> np.ndarray:
    """Return the sine in the quarter of the turn: odd ones take the cosine, and bit 1 is the sign."""
    return np.where(quarter & 1, cosine, sine) * np.where(quarter & 2, -1.0, 1.0)


def _bits(x: np.ndarray) -> np.ndarray:
    return np.asarray(x).view(np.int64)


def _from_bits(bits: np.ndarray) -> np.ndarray:
    return np.asarray(bits).view(np.float64)


def _power_of_2(k: np.ndarray) -> np.ndarray:
    return _from_bits((k + 1023) << 52)


def _sum_sorted(a: np.ndarray | float, b: np.ndarray) -> _Pair:
    hi = a + b
    return hi, (a - hi) + b


def _sum(a: np.ndarray, b: np.ndarray) -> _Pair:
    hi = a + b
    b_part = hi - a
    return hi, (a - (hi - b_part)) + (b - b_part)


def _half_square(x: np.ndarray) -> _Pair:
    head = _from_bits((_bits(x) + 0x4000000) & -0x8000000)
    return 0.5 * head * head, 0.5 * (x - head) * (x + head)


def _poly3(x: np.ndarray, c0: float, c1: float, c2: float) -> np.ndarray:
    return c0 + x * (c1 + x * c2)
