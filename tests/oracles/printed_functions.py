"""Functions printed as C, compiled together and called on plain arrays; a singular system is status 4."""

import ctypes

import casadi as ca
import numpy as np

from casadi_gnc.embedded.parts import Parts
from casadi_gnc.system import assets, compilers

_HEAD = """#include <stdint.h>
#define GNC_SINGULAR 4
#define GNC_APART __attribute__((noinline))
typedef _Bool gnc_flag;
typedef {real} gnc_real;
"""


class Printed:
    """Compile functions and call them."""

    def __init__(self, functions: list[ca.Function], maths: str = "libm", real: str = "double", optimise: str = "-O2"):
        self.functions, self._real = functions, np.float64 if real == "double" else np.float32
        self.parts = Parts(maths, real)  # type: ignore[arg-type]
        callees = [self.parts.function(function) for function in functions]
        header = "#include <math.h>" if maths == "libm" else '#include "gnc_math.h"'
        text = [_HEAD.format(real=real), header, self.parts.text()]
        for k, (function, callee) in enumerate(zip(functions, callees, strict=True)):
            given = [f"p[{i}]" for i in range(function.n_in() + function.n_out())] + ["&status"] * callee.asks
            text.append(f"uint32_t run{k}(gnc_real **p);\nuint32_t run{k}(gnc_real **p)\n{{\n    uint32_t status = 0;")
            text.append(f"    {callee.name}({', '.join(given)});\n    return status;\n}}")
        self.text = "\n".join(text)
        with compilers.workshop() as shop:
            (shop / "functions.c").write_text(self.text)
            words = ["-std=c99", "-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-pedantic", "-Werror", optimise]
            words += ["-Wno-unused-function", "-ffp-contract=off", *(["-fno-builtin"] if maths == "libm" else [])]
            words += [f"-I{assets.folder('codegen') / 'runtime'}", "-fPIC", "-shared", "-o", str(shop / "f.so")]
            compilers.compile_in(shop, compilers.find(), [*words, str(shop / "functions.c"), "-lm"], "functions")
            self._c = compilers.open_library(shop / "f.so")

    def __call__(self, number: int, *given: np.ndarray) -> tuple[int, list[np.ndarray]]:
        """Return the status and the nonzeros of each result; `given` are nonzeros."""
        function = self.functions[number]
        columns = [np.array(one, dtype=self._real).ravel() for one in given]
        columns += [np.zeros(max(function.nnz_out(i), 1), self._real) for i in range(function.n_out())]
        places = (ctypes.c_void_p * len(columns))(*(column.ctypes.data for column in columns))
        status = getattr(self._c, f"run{number}")(places)
        return status, [column[: function.nnz_out(i)] for i, column in enumerate(columns[function.n_in() :])]


def on_the_machine(function: ca.Function, *given: np.ndarray) -> list[np.ndarray]:
    """Return the nonzeros of each result as CasADi computes them."""
    taken = [ca.DM(function.sparsity_in(i), list(map(float, one))) for i, one in enumerate(given)]
    return [np.array(each.nonzeros(), dtype=float) for each in function.call(taken)]


def same_words(found: np.ndarray, expected: np.ndarray) -> bool:
    """Tell whether numbers have the same bits; NaN is NaN."""
    both = np.isnan(found) & np.isnan(expected)
    return bool(((found.view(np.uint64) == expected.view(np.uint64)) | both).all())


def everything() -> ca.Function:
    """Return a function with a piece of every kind."""
    x, a, c = ca.MX.sym("x", 3), ca.MX.sym("a", 3, 3), ca.MX.sym("c")
    even = ca.interpolant("even", "linear", [[0, 1, 2, 3]], [1, 2, 4, -3])
    uneven = ca.interpolant("uneven", "linear", [[0, 1, 2.5], [0, 1.0, 3]], [1, 2, 4, 3, 3, 3.3, 9, 8, 7.0])
    smooth = ca.interpolant("smooth", "bspline", [[0, 1, 2, 3, 4, 5], [0, 1, 2, 3.5, 4]], list(np.arange(30.0) ** 1.5))
    column, u = ca.SX.sym("column", 3), ca.SX.sym("u")
    step = ca.Function("step", [column, u], [ca.vertcat(column[1], column[2], ca.sin(column[0]) + u)])
    inner = ca.MX.sym("inner", 3)
    both = ca.Function("both", [inner], [ca.sumsqr(inner) * uneven(inner[:2]), inner * 2])
    first, second = both(x * x)
    third, _ = both(second + first)
    solved = ca.solve(a, second)
    return ca.Function(
        "everything",
        [x, a, c],
        [
            third,
            smooth(x[:2]),
            ca.jacobian(smooth(x[:2]), x),
            step.mapaccum("steps", 20)(x, ca.repmat(c, 1, 20)),
            step.map(3)(a, ca.horzcat(c, c, 1)),
            ca.if_else(c > 0, uneven(x[:2]), ca.sqrt(x[1] * x[1]), True),
            ca.conditional(c, [x[0], x[1]], x[2], True),
            even(x[2]),
            ca.norm_2(x) + ca.det(a),
            solved + x,
            ca.solve(a.T, solved),
            ca.inv(a),
            ca.jacobian(uneven(x[:2]), x),
            ca.jacobian(even(x[2]), x),
            ca.vertcat(x[c], x[ca.vertcat(1, c)], x[1 - c]),
            a[c, :],
            a[ca.vertcat(c, 1), c],
            a[1:3, ca.fmin(ca.fmax(c, 0), 2)],
            ca.low(ca.DM([0, 1, 2.5, 7]), x),
            ca.low(ca.DM([0, 1, 2]), x[0], {"lookup_mode": "exact"}),
            ca.low(ca.cumsum(x * x), c, {"lookup_mode": "binary"}),
        ],
    )
