"""Every operation that is printed is within 4 units in the last place of its value. Truth: mpmath at 40 digits."""

import casadi as ca
import mpmath
import numpy as np
import pytest
from printed_functions import Printed

#: Operation -> its value; those of comparison and logic are exact, so are asked for by `==`.
UNARY = {
    "exp": mpmath.exp, "log": mpmath.log, "expm1": mpmath.expm1, "log1p": mpmath.log1p, "sqrt": mpmath.sqrt,
    "sq": lambda x: x * x, "twice": lambda x: 2 * x, "sin": mpmath.sin, "cos": mpmath.cos, "tan": mpmath.tan,
    "asin": mpmath.asin, "acos": mpmath.acos, "atan": mpmath.atan, "sinh": mpmath.sinh, "cosh": mpmath.cosh,
    "tanh": mpmath.tanh, "asinh": mpmath.asinh, "acosh": mpmath.acosh, "atanh": mpmath.atanh, "fabs": abs,
    "floor": mpmath.floor, "ceil": mpmath.ceil, "sign": mpmath.sign, "neg": lambda x: -x, "inv": lambda x: 1 / x,
    "erf": mpmath.erf, "not": lambda x: mpmath.mpf(x == 0),
}  # fmt: skip
BINARY = {
    "add": lambda x, y: x + y, "sub": lambda x, y: x - y, "mul": lambda x, y: x * y, "div": lambda x, y: x / y,
    "pow": mpmath.power, "atan2": mpmath.atan2, "fmod": lambda x, y: mpmath.sign(x) * mpmath.fmod(abs(x), abs(y)),
    "remainder": lambda x, y: x - mpmath.nint(x / y) * y,
    "copysign": lambda x, y: abs(x) if y >= 0 else -abs(x), "fmin": min, "fmax": max, "hypot": mpmath.hypot,
    "lt": lambda x, y: mpmath.mpf(x < y), "le": lambda x, y: mpmath.mpf(x <= y),
    "eq": lambda x, y: mpmath.mpf(x == y), "ne": lambda x, y: mpmath.mpf(x != y),
    "and": lambda x, y: mpmath.mpf(x != 0 and y != 0), "or": lambda x, y: mpmath.mpf(x != 0 or y != 0),
    "if_else_zero": lambda x, y: y if x != 0 else mpmath.mpf(0),
}  # fmt: skip
DRAWS = 200


def every() -> ca.Function:
    """Return a function whose results are all operations of two numbers."""
    x, y = ca.SX.sym("x"), ca.SX.sym("y")
    made = [ca.SX.unary(getattr(ca, f"OP_{name.upper()}"), x) for name in UNARY]
    made += [ca.SX.binary(getattr(ca, f"OP_{name.upper()}"), x, y) for name in BINARY]
    return ca.Function("every", [x, y], [ca.vertcat(*made)])


def valued(f, *given):
    """Return a value, NaN where there is none."""
    try:
        return mpmath.mpmathify(f(*given))
    except (ZeroDivisionError, ValueError):
        return mpmath.nan


@pytest.mark.slow
@pytest.mark.parametrize("real", ["double", "float"])
def test_is_within_four_units_in_the_last_place(real):
    printed, rng = Printed([every()], "gnc", real), np.random.default_rng(4)
    kind = np.float64 if real == "double" else np.float32
    worst, seen = {}, 0
    with mpmath.workdps(40):
        for draw in range(DRAWS):
            x, y = (kind(one) for one in rng.normal(size=2) * (1.0, 0.3, 8.0, 1e-3)[draw % 4])
            x = kind(round(x)) if draw % 10 == 9 else x
            found = printed(0, np.array([x]), np.array([y]))[1][0]
            one, other = mpmath.mpf(float(x)), mpmath.mpf(float(y))
            exact = [*(valued(f, one) for f in UNARY.values()), *(valued(f, one, other) for f in BINARY.values())]
            for name, got, value in zip((*UNARY, *BINARY), found, exact, strict=True):
                if isinstance(value, mpmath.mpc) or not mpmath.isfinite(value):
                    continue  # outside its domain
                unit = np.spacing(kind(abs(float(value)))) or np.finfo(kind).smallest_subnormal
                error = float(abs(mpmath.mpf(float(got)) - value) / mpmath.mpf(float(unit)))
                worst[name], seen = max(worst.get(name, 0.0), error), seen + 1
    assert seen > 0.85 * DRAWS * len(worst)
    assert set(worst) == {*UNARY, *BINARY}
    assert {name: error for name, error in worst.items() if not error <= 4.0} == {}
