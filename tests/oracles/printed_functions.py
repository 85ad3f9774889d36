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
