"""Elementary functions of constants, the same to the last bit on every machine.

Constants that are folded into generated C must not depend on the libm or the BLAS of the machine
that generates it. Numbers are therefore evaluated in 50-digit decimal arithmetic and rounded once;
symbols become the CasADi operation, which the C evaluates with its own mathematics.
"""

from __future__ import annotations

import math
from decimal import Context, Decimal, localcontext
from typing import Any

import casadi as ca

_CONTEXT = Context(prec=50)


def is_number(value: Any) -> bool:
    """Tell a plain number (also numpy's) from a CasADi expression."""
    return not isinstance(value, (ca.SX, ca.MX))


def array(values: Any) -> Any:
    """Return numbers or symbols, as lists and rows, as CasADi holds them: DM, or SX where one of them is a symbol."""
    if isinstance(values, (ca.SX, ca.MX, ca.DM)):
        return values
    if not isinstance(values, (list, tuple)):
        return ca.DM(values)
    rows = [list(row) if isinstance(row, (list, tuple)) else [row] for row in values]
    if all(is_number(entry) for row in rows for entry in row):
        return ca.DM(list(values))
    return ca.vertcat(*(ca.horzcat(*row) for row in rows))


def is_zero(value: Any) -> bool:
    """Tell whether a value is the number 0; a symbol is not."""
    return is_number(value) and float(value) == 0.0


def sqrt(x: Any) -> Any:
    """Return the square root, correctly rounded, of a number or a symbol."""
    return math.sqrt(x) if is_number(x) else ca.sqrt(x)


def phi1(x: Any) -> Any:
    """Return (e**x - 1)/x, continued by 1 at x = 0.

    It is the gain of a first-order lag over one hold: x(h) = x(0) + h phi1(a h) x'(0) is exact
    for x' = a x + b with constant a and b, and needs no division by a.
    """
    if is_number(x):
        if float(x) == 0.0:
            return 1.0
        with localcontext(_CONTEXT):
            exact = Decimal(float(x))
            return float((exact.exp() - 1) / exact)
    # The unselected branch must stay finite: reverse differentiation multiplies it by zero.
    small = ca.fabs(x) < 1e-8
    divisor = ca.if_else(small, 1.0, x)
    return ca.if_else(small, 1 + x / 2, ca.expm1(divisor) / divisor)


def cos_sin(angle: Any) -> tuple[Any, Any]:
    """Return cosine and sine of an angle [rad], each correctly rounded; of a symbol, the expressions.

    The Taylor series is summed after the angle was halved until it is below 0.1, then the
    double-angle formulas undo the halving; 50 digits leave room for the loss on the way.
    """
    if not is_number(angle):
        return ca.cos(angle), ca.sin(angle)
    cosine, sine = _cos_sin(Decimal(float(angle)))
    return float(cosine), float(sine)


def _cos_sin(angle: Decimal) -> tuple[Decimal, Decimal]:
    with localcontext(_CONTEXT):
        halved, halvings = angle, 0
        while abs(halved) > Decimal("0.1"):
            halved, halvings = halved / 2, halvings + 1
        sine, versine, term, order = Decimal(0), Decimal(0), halved, 1
        while abs(term) > Decimal("1e-60"):  # term = halved**order / order!
            even = term * halved / (order + 1)
            sign = 1 if order % 4 == 1 else -1
            sine, versine = sine + sign * term, versine + sign * even
            term, order = even * halved / (order + 2), order + 2
        cosine = 1 - versine
        for _ in range(halvings):
            sine, cosine = 2 * sine * cosine, 1 - 2 * sine * sine
        return cosine, sine


def angle(cosine: Any, sine: Any) -> Any:
    """Return the angle [rad] of a cosine and a sine times any positive length, rounded once; of symbols, atan2.

    Newton's method from the machine's own value, whose error, e, leaves a part of e^3.
    """
    if not (is_number(cosine) and is_number(sine)):
        return ca.atan2(sine, cosine)
    with localcontext(_CONTEXT):
        x, y = Decimal(float(cosine)), Decimal(float(sine))
        length = (x * x + y * y).sqrt()
        if not length:
            return 0.0
        first = Decimal(math.atan2(y, x))
        c, s = _cos_sin(first)
        return float(first + (y * c - x * s) / length)


def log(x: Any) -> Any:
    """Return ln x, element by element; correctly rounded for numbers, symbolic for expressions."""
    if not is_number(x):
        return ca.log(x)
    numbers = ca.DM(x)
    logs = [float(_CONTEXT.ln(Decimal(float(value)))) for value in numbers.nonzeros()]
    return logs[0] if isinstance(x, (int, float)) else ca.DM(logs)
