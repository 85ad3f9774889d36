"""Print a CasADi SX function as one C function.

The tape of an SX function is a list of scalar instructions on a work vector. Each is printed as
one `const` of its own (single assignment), outputs are stored last, so the arguments may overlap,
and nothing is called but the elementary functions: no allocation, no branch, no loop.

Two sets of elementary functions can be named: those of `codegen/runtime/gnc_math.h`, whose results
are the same on every target, and the C library's, which CasADi's own virtual machine uses.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import casadi as ca
import numpy as np

from casadi_gnc.errors import PrinterError

Math = Literal["gnc", "libm"]
Real = Literal["double", "float"]

_INFIX = {ca.OP_ADD: "+", ca.OP_SUB: "-", ca.OP_MUL: "*", ca.OP_DIV: "/"}
_COMPARE = {ca.OP_LT: "<", ca.OP_LE: "<=", ca.OP_EQ: "==", ca.OP_NE: "!="}
#: Operations whose value is 0 or 1.
_FLAGS = (*_COMPARE, ca.OP_NOT, ca.OP_AND, ca.OP_OR)
#: A choice between two values; CasADi has no operation for it.
_SELECT = -1
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
#: Normal numbers of single precision.
_LEAST_FLOAT, _LARGEST_FLOAT = float(np.finfo(np.float32).tiny), float(np.finfo(np.float32).max)
_NAMES = {getattr(ca, name): name[3:].lower() for name in dir(ca) if name.startswith("OP_")}


def c_constant(value: float, real: Real = "double") -> str:
    """Return a literal that a C compiler reads back as the same number."""
    if not math.isfinite(value):
        raise PrinterError(f"a constant of the function is {value}; only finite numbers can be printed as C")
    if real == "float" and value != 0.0 and not _LEAST_FLOAT <= abs(value) <= _LARGEST_FLOAT:
        raise PrinterError(f"the constant {value:g} does not fit a float; use float64, or scale the law")
    text = f"{value:.17g}" if real == "double" else f"{value:.9g}"
    if not any(mark in text for mark in ".e"):
        text += "."
    return text if real == "double" else text + "f"


@dataclass(frozen=True)
class _Node:
    """One scalar of the tape: an operation on earlier ones, an input (place) or a constant (number)."""

    code: int
    operands: tuple[int, ...] = ()
    place: str = ""
    number: float = 0.0

    @property
    def is_flag(self) -> bool:
        """Whether the value is 0 or 1; such values are Boolean in the C."""
        return self.code in _FLAGS


def _expression(node: _Node, flags: list[bool], maths: Math, real: Real) -> str:
    """Return the right-hand side of a node; {0}, {1}, ... stand for its operands, of which some are flags."""
    zero, one = c_constant(0.0, real), c_constant(1.0, real)
    # A flag in arithmetic becomes a number, a number in logic a flag.
    a = [f"({{{i}}} ? {one} : {zero})" if flag else f"{{{i}}}" for i, flag in enumerate(flags)]
    true = [f"{{{i}}}" if flag else f"({{{i}}} != {zero})" for i, flag in enumerate(flags)]
    code = node.code
    if code in _INFIX:
        return f"{a[0]} {_INFIX[code]} {a[1]}"
    if code in _COMPARE:
        return f"{a[0]} {_COMPARE[code]} {a[1]}"
    if code in _CALLS:
        suffix = "f" if real == "float" else ""
        prefix = "gnc_" if maths == "gnc" else ""
        return f"{prefix}{_CALLS[code]}{suffix}({', '.join(a)})"
    x, y = (a + [""] * 2)[:2]
    p, q = (true + [""] * 2)[:2]
    shapes = {
        ca.OP_ASSIGN: x,
        ca.OP_NEG: f"-{x}",
        ca.OP_SQ: f"{x} * {x}",
        ca.OP_TWICE: f"{x} + {x}",
        ca.OP_INV: f"{one} / {x}",
        ca.OP_NOT: f"!{p}",
        ca.OP_AND: f"{p} && {q}",
        ca.OP_OR: f"{p} || {q}",
        ca.OP_IF_ELSE_ZERO: f"{p} ? {y} : {zero}",
        # The sum of two of the above of which one is zero: + 0 turns -0 into +0 as that sum does.
        _SELECT: f"({p} ? {y} : {(a + [''] * 3)[2]}) + {zero}",
        ca.OP_FMIN: f"({x} < {y}) ? {x} : {y}",
        ca.OP_FMAX: f"({x} > {y}) ? {x} : {y}",
        ca.OP_SIGN: f"({x} < {zero}) ? -{one} : (({x} > {zero}) ? {one} : {x})",
    }
    if code not in shapes:
        raise PrinterError(
            f"operation {_NAMES.get(code, code)!r} has no C form here; rewrite the law with other operations"
        )
    return shapes[code]


def print_function(
    function: ca.Function,
    *,
    maths: Math = "gnc",
    real: Real = "double",
    arguments: Sequence[str] | None = None,
    places: Mapping[str, Sequence[str]] | None = None,
    flag: str = "_Bool",
    shared: Sequence[str] | None = None,
) -> str:
    """Return the C text of a `static` function with the name of `function`.

    Parameters
    ----------
    function : SX function whose arguments and results are dense.
    maths : whose elementary functions are called.
    real : precision of every number.
    arguments : declarations of the C arguments; by default one pointer a port, named as the port.
    places : for each port the C expression of each of its elements; by default elements of those pointers.

    flag : C type of conditions.
    shared : print the function for LANES columns side by side, element i of lane l at `name[i * LANES + l]`, but of
        these ports one column for all.

    Raises
    ------
    PrinterError
        For an MX function, a sparse port, an unknown operation, or a constant that the type cannot hold.
    """
    if not function.is_a("SXFunction"):
        raise PrinterError(f"{function.name()} is no SX function; expand it first")
    inputs, outputs = _ports(function, "in"), _ports(function, "out")
    if places is None:
        lanes = {name: shared is not None and name not in shared for name in (*inputs, *outputs)}
        sizes = {name: function.numel_in(name) for name in inputs} | {n: function.numel_out(n) for n in outputs}
        places = {
            name: [f"{name}[{i} * LANES + l]" if lanes[name] else f"{name}[{i}]" for i in range(size)]
            for name, size in sizes.items()
        }
    nodes, results = _graph(function, places)
    zero, one = c_constant(0.0, real), c_constant(1.0, real)
    used, compared = _uses(nodes, [node for _, node in results])
    body = []
    for k, node in enumerate(nodes):
        if k not in used:
            continue
        if node.code == ca.OP_CONST:
            # A bound beyond the largest float is met by every finite float and by no infinite one.
            huge = real == "float" and k in compared and math.isfinite(node.number)
            number = min(max(node.number, -_LARGEST_FLOAT), _LARGEST_FLOAT) if huge else node.number
            text = c_constant(number, real)
        elif node.code == ca.OP_INPUT:
            text = node.place
        else:
            flags = [nodes[i].is_flag and shared is None for i in node.operands]
            try:
                text = _expression(node, flags, maths, real)
            except PrinterError as error:
                raise PrinterError(f"{function.name()}: {error}") from None
            if shared is not None and node.is_flag:
                # Vectors hold numbers: a flag is 1 or 0, and both sides of it are evaluated.
                text = f"({text.replace(' && ', ' & ').replace(' || ', ' | ')}) ? {one} : {zero}"
            text = text.format(*(f"a{i}" for i in node.operands))
        body.append(f"    const {flag if node.is_flag and shared is None else 'gnc_real'} a{k} = {text};")
    as_number = f" ? {one} : {zero}"
    stores = [f"    {place} = a{k}{as_number if nodes[k].is_flag and shared is None else ''};" for place, k in results]
    unused = []
    if arguments is None:
        arguments = [f"const gnc_real *{name}" for name in inputs] + [f"gnc_real *{name}" for name in outputs]
        unused = [f"    (void){name};" for i, name in enumerate(inputs) if not _is_read(function, i)]
        unused += [f"    (void){name};" for i, name in enumerate(outputs) if not function.numel_out(i)]
    head = f"static void {function.name()}(\n    " + ",\n    ".join(arguments) + ")\n{"
    if shared is None:
        return "\n".join([head, *unused, *body, *stores, "}", ""])
    loop = ["    long l;", "#pragma omp simd", "    for (l = 0; l < LANES; l++) {"]
    inner = [f"    {line}" for line in (*body, *stores)]
    return "\n".join([head, loop[0], *unused, *loop[1:], *inner, "    }", "}", ""])


def _graph(function: ca.Function, places: Mapping[str, Sequence[str]]) -> tuple[list[_Node], list[tuple[str, int]]]:
    """Return the scalars of a tape in order, and for each result its place and its scalar."""
    inputs, outputs = function.name_in(), function.name_out()
    nodes: list[_Node] = []
    results: list[tuple[str, int]] = []
    value: dict[int, int] = {}  # place in the work vector -> the scalar it holds
    for k in range(function.n_instructions()):
        code = function.instruction_id(k)
        given, target = function.instruction_input(k), function.instruction_output(k)
        if code == ca.OP_OUTPUT:
            results.append((places[outputs[target[0]]][target[1]], value[given[0]]))
            continue
        if code == ca.OP_INPUT:
            node = _Node(code, place=places[inputs[given[0]]][given[1]])
        elif code == ca.OP_CONST:
            node = _Node(code, number=function.instruction_constant(k))
        else:
            node = _select(nodes, _Node(code, tuple(value[i] for i in given)))
        value[target[0]] = len(nodes)
        nodes.append(node)
    return nodes, results


def _select(nodes: list[_Node], node: _Node) -> _Node:
    """Return `node`, as one choice between two where it is (c ? x : 0) + (!c ? y : 0), CasADi's if_else."""
    if node.code != ca.OP_ADD:
        return node
    first, second = (nodes[i] for i in node.operands)
    if first.code != ca.OP_IF_ELSE_ZERO or second.code != ca.OP_IF_ELSE_ZERO:
        return node
    condition, other = first.operands[0], second.operands[0]
    if nodes[other].code == ca.OP_NOT and nodes[other].operands[0] == condition:
        return _Node(_SELECT, (condition, first.operands[1], second.operands[1]))
    if nodes[condition].code == ca.OP_NOT and nodes[condition].operands[0] == other:
        return _Node(_SELECT, (other, second.operands[1], first.operands[1]))
    return node


def _uses(nodes: list[_Node], results: list[int]) -> tuple[set[int], set[int]]:
    """Return the scalars that the results need, and those of them that nothing but comparisons use."""
    used, otherwise, todo = set(results), set(results), list(results)
    while todo:
        node = nodes[todo.pop()]
        todo += [i for i in node.operands if i not in used]
        used |= set(node.operands)
        if node.code not in _COMPARE:
            otherwise |= set(node.operands)
    return used, used - otherwise


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
