"""Truth: CasADi's virtual machine, word for word, with the C library's elementary functions."""

import ctypes

import casadi as ca
import numpy as np
import pytest

from casadi_gnc.embedded.printer import c_constant, print_function
from casadi_gnc.errors import PrinterError
from casadi_gnc.system import assets, compilers

HEADER = "#include <math.h>\ntypedef double gnc_real;\n"


def compiled(function: ca.Function, *, in_place: bool = False):
    """Return a Python callable of the printed C (one input, one output)."""
    text = print_function(function, maths="libm")
    call = f"\nvoid call(const gnc_real *x, gnc_real *y) {{ {function.name()}(x, y); }}\n"
    library = compilers.compiled(
        HEADER + text + call, include=assets.folder("codegen") / "runtime", flags=("-O2", "-fno-builtin")
    )
    run = ctypes.CDLL(str(library)).call

    def evaluate(x: np.ndarray) -> np.ndarray:
        x = np.array(x, dtype=float)
        y = x if in_place else np.zeros(function.numel_out(0))
        run(ctypes.c_void_p(x.ctypes.data), ctypes.c_void_p(y.ctypes.data))
        return y

    return evaluate


def same_words(a: np.ndarray, b: np.ndarray) -> bool:
    """Equal bits; any NaN equals any NaN."""
    a, b = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
    return bool(np.all((a.view(np.uint64) == b.view(np.uint64)) | (np.isnan(a) & np.isnan(b))))


def all_operations() -> ca.Function:
    x = ca.SX.sym("x", 4)
    a, b, c, d = (x[i] for i in range(4))
    unary = [ca.exp, ca.log, ca.expm1, ca.log1p, ca.sqrt, ca.sin, ca.cos, ca.tan, ca.asin, ca.acos, ca.atan, ca.sinh,
             ca.cosh, ca.tanh, ca.fabs, ca.floor, ca.ceil, ca.sign]  # fmt: skip
    results = [f(v) for f in unary for v in (a, b, c * 1e-3)]
    results += [
        a + b,
        a - b,
        a * b,
        a / b,
        -a,
        a**2,
        2 * a,
        1 / a,
        a**b,
        b**2.5,
        ca.atan2(a, b),
        ca.fmod(a, b),
        ca.copysign(a, b),
    ]
    results += [
        a < b,
        a <= b,
        a == b,
        a != b,
        ca.logic_and(a < b, c < d),
        ca.logic_or(a < b, c < d),
        ca.logic_not(a < b),
    ]
    results += [ca.if_else(a < b, c, d), 1e-300 * a, -1.25, 1 / 3 + a]
    # Signed zeros: CasADi's choice between two is a sum, in which -0 becomes +0. Flags in arithmetic, numbers in logic.
    results += [ca.if_else(a <= b, a, b), ca.if_else(a, b, a), 2 * (a < b) + (a <= c), ca.logic_and(a, b < c)]
    results += [ca.logic_not(ca.logic_or(a, b)), ca.if_else(a < b, a, 0), ca.fabs(a < b) - (a != b)]
    return ca.Function("everything", [x], [ca.vertcat(*results)], ["x"], ["y"])


def test_every_operation_has_the_machines_words(rng):
    function = all_operations()
    run = compiled(function)
    special = [0.0, -0.0, 1.0, -1.0, np.inf, -np.inf, np.nan, 5e-324, 1e308, 0.5]
    inputs = [rng.normal(size=4) * 10.0 ** rng.integers(-3, 3) for _ in range(300)]
    inputs += [np.array([a, b, 0.3, -0.7]) for a in special for b in special]
    for x in inputs:
        assert same_words(run(x), np.array(function(x)).ravel()), x


def test_random_expressions(rng):
    """Random trees of safe operations, deep enough to reuse work registers."""
    for _ in range(15):
        x = ca.SX.sym("x", 3)
        pool = [x[0], x[1], x[2], ca.SX(0.7)]
        for _ in range(60):
            a, b = (pool[rng.integers(len(pool))] for _ in range(2))
            pool.append(
                [a + b, a - b, a * b, ca.sin(a), ca.if_else(a < b, a, b), ca.tanh(a), a / (1 + b * b)][rng.integers(7)]
            )
        function = ca.Function("tree", [x], [ca.cse(ca.vertcat(*pool[-5:]))], ["x"], ["y"])
        run = compiled(function)
        for _ in range(20):
            point = rng.normal(size=3)
            assert same_words(run(point), np.array(function(point)).ravel())


def test_arguments_may_overlap(rng):
    x = ca.SX.sym("x", 3)
    function = ca.Function("swap", [x], [ca.vertcat(x[2], x[0] + x[1], x[0] * x[2])], ["x"], ["y"])
    point = rng.normal(size=3)
    assert same_words(compiled(function, in_place=True)(point), np.array(function(point)).ravel())


def test_constants_survive_the_round_trip(rng):
    for value in [*(rng.normal(size=200) * 10.0 ** rng.integers(-300, 300, 200)), 0.1, -0.0, 1e22, 5e-324]:
        assert float(c_constant(float(value))) == value
        if 1e-37 < abs(value) < 1e38:
            assert np.float32(c_constant(float(value), "float")[:-1]) == np.float32(value)
    assert c_constant(2.0) == "2."
    with pytest.raises(PrinterError, match="only finite numbers"):
        c_constant(np.inf)


def test_bounds_beyond_a_float_still_tell_infinities():
    """|x| <= 1e150 in double asks for a finite number; so must the float."""
    x = ca.SX.sym("x")
    text = print_function(ca.Function("f", [x], [ca.fabs(x) <= 1e150], ["x"], ["y"]), real="float")
    assert "3.40282347e+38f" in text
    for value in (1e150, 1e-150):
        with pytest.raises(PrinterError, match="does not fit a float"):
            print_function(ca.Function("f", [x], [x * value], ["x"], ["y"]), real="float")


def test_float_text_has_no_double():
    x = ca.SX.sym("x", 2)
    function = ca.Function("f", [x], [ca.exp(x[0]) * 0.1 + ca.if_else(x[0] < x[1], 1 / x[0], 2.5)], ["x"], ["y"])
    text = print_function(function, maths="libm", real="float")
    assert "expf(" in text
    assert " 0.1f" in text
    assert " 2.5f" in text


def test_what_cannot_be_printed_is_told():
    x = ca.SX.sym("x")
    with pytest.raises(PrinterError, match="f: operation 'erfinv' has no C form"):
        print_function(ca.Function("f", [x], [ca.erfinv(x)]))
    closed = ca.Function("closed", [x], [x, x * x], {"never_inline": True})
    with pytest.raises(PrinterError, match="f calls a function that is never inlined; make that one without"):
        print_function(ca.Function("f", [x], [closed(x)[0]]))
    with pytest.raises(PrinterError, match="no SX function; expand it"):
        print_function(ca.Function("f", [m := ca.MX.sym("m")], [ca.exp(m)]))
    with pytest.raises(PrinterError, match="port o0 is sparse"):
        print_function(ca.Function("f", [x], [ca.diag(ca.vertcat(x, x))]))


def test_printing_twice_gives_the_same_text():
    assert print_function(all_operations(), maths="libm") == print_function(all_operations(), maths="libm")
