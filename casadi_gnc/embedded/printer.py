"""Print a CasADi SX function as one C function.

The tape of an SX function is a list of scalar instructions on a work vector. Each is printed as
one `const` of its own (single assignment), outputs are stored last, so the arguments may overlap,
and nothing is called but the elementary functions: no allocation, no branch, no loop.

Two sets of elementary functions can be named: those of `codegen/runtime/gnc_math.h`, whose results
are the same on every target, and the C library's, which CasADi's own virtual machine uses.
"""

from __future__ import annotations

import math
from typing import Literal

import casadi as ca

from casadi_gnc.errors import PrinterError

Math = Literal["gnc", "libm"]
Real = Literal["double", "float"]

_INFIX = {ca.OP_ADD: "+", ca.OP_SUB: "-", ca.OP_MUL: "*", ca.OP_DIV: "/"}
_COMPARE = {ca.OP_LT: "<", ca.OP_LE: "<=", ca.OP_EQ: "==", ca.OP_NE: "!="}
_CALLS = {
    ca.OP_EXP: "exp",
    ca.OP_LOG: "log",
    ca.OP_EXPM1: "expm1",
    ca.OP_LOG1P: "log1p",
    ca.OP_POW: "pow",
    ca.OP_CONSTPOW: "pow",
    ca.OP_SQRT: "sqrt",
    ca.OP_SIN: "sin",
    ca.OP_COS: "cos",
    ca.OP_TAN: "tan",
    ca.OP_ASIN: "asin",
    ca.OP_ACOS: "acos",
    ca.OP_ATAN: "atan",
    ca.OP_ATAN2: "atan2",
    ca.OP_SINH: "sinh",
    ca.OP_COSH: "cosh",
    ca.OP_TANH: "tanh",
    ca.OP_FABS: "fabs",
    ca.OP_FLOOR: "floor",
    ca.OP_CEIL: "ceil",
    ca.OP_FMOD: "fmod",
    ca.OP_COPYSIGN: "copysign",
}
_NAMES = {getattr(ca, name): name[3:].lower() for name in dir(ca) if name.startswith("OP_")}


def c_constant(value: float, real: Real = "double") -> str:
    """Return a literal that a C compiler reads back as the same number."""
    if not math.isfinite(value):
        raise PrinterError(f"a constant of the function is {value}; only finite numbers can be printed as C")
    text = f"{value:.17g}" if real == "double" else f"{value:.9g}"
    if not any(mark in text for mark in ".e"):
        text += "."
    return text if real == "double" else text + "f"


def _expression(code: int, a: list[str], maths: Math, real: Real) -> str:
    """Return the right-hand side of an instruction on operands `a`."""
    zero, one = c_constant(0.0, real), c_constant(1.0, real)
    if code in _INFIX:
        return f"{a[0]} {_INFIX[code]} {a[1]}"
    if code in _COMPARE:
        return f"(gnc_real)({a[0]} {_COMPARE[code]} {a[1]})"
    if code in _CALLS:
        suffix = "f" if real == "float" else ""
        prefix = "gnc_" if maths == "gnc" else ""
        return f"{prefix}{_CALLS[code]}{suffix}({', '.join(a)})"
    shapes = {
        ca.OP_ASSIGN: "{0}",
        ca.OP_NEG: "-{0}",
        ca.OP_SQ: "{0} * {0}",
        ca.OP_TWICE: "{0} + {0}",
        ca.OP_INV: f"{one} / {{0}}",
        ca.OP_NOT: f"(gnc_real)({{0}} == {zero})",
        ca.OP_AND: f"(gnc_real)(({{0}} != {zero}) && ({{1}} != {zero}))",
        ca.OP_OR: f"(gnc_real)(({{0}} != {zero}) || ({{1}} != {zero}))",
        ca.OP_IF_ELSE_ZERO: f"({{0}} != {zero}) ? {{1}} : {zero}",
        ca.OP_FMIN: "({0} < {1}) ? {0} : {1}",
        ca.OP_FMAX: "({0} > {1}) ? {0} : {1}",
        ca.OP_SIGN: f"({{0}} < {zero}) ? -{one} : (({{0}} > {zero}) ? {one} : {{0}})",
    }
    if code not in shapes:
        raise PrinterError(
            f"operation {_NAMES.get(code, code)!r} has no C form here; rewrite the law with other operations"
        )
    return shapes[code].format(*a)


def print_function(function: ca.Function, *, maths: Math = "gnc", real: Real = "double") -> str:
    """Return the C text of a `static` function with the name and ports of `function`.

    Parameters
    ----------
    function : SX function whose arguments and results are dense.
    maths : whose elementary functions are called.
    real : precision of every number.

    Raises
    ------
    PrinterError
        For an MX function, a sparse port, an unknown operation or a non-finite constant.
    """
    if not function.is_a("SXFunction"):
        raise PrinterError(f"{function.name()} is no SX function; expand it first")
    inputs, outputs = _ports(function, "in"), _ports(function, "out")
    body, stores = [], []
    value: dict[int, str] = {}
    for k in range(function.n_instructions()):
        code = function.instruction_id(k)
        operands, target = function.instruction_input(k), function.instruction_output(k)
        if code == ca.OP_OUTPUT:
            stores.append(f"    {outputs[target[0]]}[{target[1]}] = {value[operands[0]]};")
            continue
        if code == ca.OP_INPUT:
            text = f"{inputs[operands[0]]}[{operands[1]}]"
        elif code == ca.OP_CONST:
            text = c_constant(function.instruction_constant(k), real)
        else:
            try:
                text = _expression(code, [value[i] for i in operands], maths, real)
            except PrinterError as error:
                raise PrinterError(f"{function.name()}: {error}") from None
        value[target[0]] = f"a{len(body)}"
        body.append(f"    const gnc_real a{len(body)} = {text};")
    arguments = [f"const gnc_real *{name}" for name in inputs] + [f"gnc_real *{name}" for name in outputs]
    unused = [f"    (void){name};" for i, name in enumerate(inputs) if not _is_read(function, i)]
    unused += [f"    (void){name};" for i, name in enumerate(outputs) if not function.numel_out(i)]
    head = f"static void {function.name()}(\n    " + ",\n    ".join(arguments) + ")\n{"
    return "\n".join([head, *unused, *body, *stores, "}", ""])


def _is_read(function: ca.Function, port: int) -> bool:
    return any(
        function.instruction_id(k) == ca.OP_INPUT and function.instruction_input(k)[0] == port
        for k in range(function.n_instructions())
    )


def _ports(function: ca.Function, side: Literal["in", "out"]) -> list[str]:
    count = function.n_in() if side == "in" else function.n_out()
    names = []
    for i in range(count):
        name = function.name_in(i) if side == "in" else function.name_out(i)
        sparsity = function.sparsity_in(i) if side == "in" else function.sparsity_out(i)
        if not sparsity.is_dense():
            raise PrinterError(f"{function.name()}: port {name} is sparse; densify it first")
        names.append(name)
    return names
