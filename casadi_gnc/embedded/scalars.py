"""The scalars of a CasADi SX function: its tape as a graph in single assignment, and the C expression of each.

An operation on numbers is one node; what CasADi writes as a sum of two conditioned values becomes one choice again.
Flags are Boolean in the C, numbers in CasADi; `expression` turns one into the other where they meet.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
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
    ca.OP_ERF: "erf",
    ca.OP_FABS: "fabs",
    ca.OP_FLOOR: "floor",
    ca.OP_CEIL: "ceil",
    ca.OP_FMOD: "fmod",
    ca.OP_REMAINDER: "remainder",
    ca.OP_COPYSIGN: "copysign",
}
#: Functions of the C library that gnc_math.h does not have.
_LIBRARY = {ca.OP_ASINH: "asinh", ca.OP_ACOSH: "acosh", ca.OP_ATANH: "atanh", ca.OP_HYPOT: "hypot"}
#: Operations that gnc_math.h does not have, as those that it has; {x} and {y} stand for the operands.
_COMPOSED = {
    ca.OP_ASINH: "(fabs({x}) > {big}) ? copysign(log(fabs({x})) + {ln2}, {x}) : "
    "copysign(log1p(fabs({x}) + ({x} * {x}) / ({one} + sqrt({one} + {x} * {x}))), {x})",
    ca.OP_ACOSH: "({x} > {big}) ? log({x}) + {ln2} : log1p(({x} - {one}) + sqrt(({x} - {one}) * ({x} + {one})))",
    ca.OP_ATANH: "copysign({half} * log1p((fabs({x}) + fabs({x})) / ({one} - fabs({x}))), {x})",
    ca.OP_HYPOT: "(fabs({x}) > fabs({y})) ? "
    "fabs({x}) * sqrt({one} + ({y} / {x}) * ({y} / {x})) : "
    "(({y} != {zero}) ? fabs({y}) * sqrt({one} + ({x} / {y}) * ({x} / {y})) : fabs({y}))",
}
_FUNCTION = re.compile(r"\b(fabs|copysign|log1p|log|sqrt)\(")
#: Normal numbers of single precision.
_LEAST_FLOAT, LARGEST_FLOAT = float(np.finfo(np.float32).tiny), float(np.finfo(np.float32).max)
_NAMES = {getattr(ca, name): name[3:].lower() for name in dir(ca) if name.startswith("OP_")}


def c_constant(value: float, real: Real = "double") -> str:
    """Return a literal that a C compiler reads back as the same number."""
    if not math.isfinite(value):
        raise PrinterError(f"a constant of the function is {value}; only finite numbers can be printed as C")
    if real == "float" and value != 0.0 and not _LEAST_FLOAT <= abs(value) <= LARGEST_FLOAT:
        raise PrinterError(f"the constant {value:g} does not fit a float; use float64, or scale the law")
    text = f"{value:.17g}" if real == "double" else f"{value:.9g}"
    if not any(mark in text for mark in ".e"):
        text += "."
    return text if real == "double" else text + "f"


@dataclass(frozen=True)
class Node:
    """One scalar of the tape: an operation on earlier ones, an input (place) or a constant (number)."""

    code: int
    operands: tuple[int, ...] = ()
    place: str = ""
    number: float = 0.0

    @property
    def is_flag(self) -> bool:
        """Whether the value is 0 or 1; such values are Boolean in the C."""
        return self.code in _FLAGS


@cache
def expression(code: int, flags: tuple[bool, ...], maths: Math, real: Real) -> str:
    """Return the right-hand side of an operation; {0}, {1}, ... stand for its operands, of which some are flags."""
    zero, one = c_constant(0.0, real), c_constant(1.0, real)
    # A flag in arithmetic becomes a number, a number in logic a flag.
    a = [f"({{{i}}} ? {one} : {zero})" if flag else f"{{{i}}}" for i, flag in enumerate(flags)]
    true = [f"{{{i}}}" if flag else f"({{{i}}} != {zero})" for i, flag in enumerate(flags)]
    suffix, prefix = "f" if real == "float" else "", "gnc_" if maths == "gnc" else ""
    if code in _COMPOSED and maths == "gnc":
        numbers = {"half": 0.5, "big": 2.0**28, "ln2": math.log(2.0)}
        written = {name: c_constant(number, real) for name, number in numbers.items()}
        text = _FUNCTION.sub(rf"gnc_\1{suffix}(", _COMPOSED[code])
        return text.format(x=a[0], y=a[-1], one=one, zero=zero, **written)
    if code in _INFIX:
        return f"{a[0]} {_INFIX[code]} {a[1]}"
    if code in _COMPARE:
        return f"{a[0]} {_COMPARE[code]} {a[1]}"
    if code in _CALLS or code in _LIBRARY:
        return f"{prefix}{(_CALLS | _LIBRARY)[code]}{suffix}({', '.join(a)})"
    x, y = (a + [""] * 2)[:2]
    p, q = (true + [""] * 2)[:2]
    shapes = {
        ca.OP_ASSIGN: x,
        ca.OP_LIFT: x,
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
        # Of a number and NaN the number, of two zeros the first, as the C library does.
        ca.OP_FMIN: f"(({x} <= {y}) || ({y} != {y})) ? {x} : {y}",
        ca.OP_FMAX: f"(({x} >= {y}) || ({y} != {y})) ? {x} : {y}",
        ca.OP_SIGN: f"({x} < {zero}) ? -{one} : (({x} > {zero}) ? {one} : {x})",
    }
    if code not in shapes:
        raise PrinterError(
            f"operation {_NAMES.get(code, code)!r} has no C form here; rewrite the law with other operations"
        )
    return shapes[code]


def graph(function: ca.Function, places: Mapping[str, Sequence[str]]) -> tuple[list[Node], list[tuple[str, int]]]:
    """Return the scalars of a tape in order, and for each result its place and its scalar."""
    inputs, outputs = function.name_in(), function.name_out()
    nodes: list[Node] = []
    results: list[tuple[str, int]] = []
    value: dict[int, int] = {}  # place in the work vector -> the scalar it holds
    for k in range(function.n_instructions()):
        code = function.instruction_id(k)
        given, target = function.instruction_input(k), function.instruction_output(k)
        if code == ca.OP_OUTPUT:
            results.append((places[outputs[target[0]]][target[1]], value[given[0]]))
            continue
        if code == ca.OP_INPUT:
            node = Node(code, place=places[inputs[given[0]]][given[1]])
        elif code == ca.OP_CONST:
            node = Node(code, number=function.instruction_constant(k))
        elif code == ca.OP_CALL:
            raise PrinterError(
                f"{function.name()} calls a function that is never inlined; make that one without never_inline"
            )
        else:
            node = _select(nodes, Node(code, tuple(value[i] for i in given)))
        value[target[0]] = len(nodes)
        nodes.append(node)
    return nodes, results


def _select(nodes: list[Node], node: Node) -> Node:
    """Return `node`, as one choice between two where it is (c ? x : 0) + (!c ? y : 0), CasADi's if_else."""
    if node.code != ca.OP_ADD:
        return node
    first, second = (nodes[i] for i in node.operands)
    if first.code != ca.OP_IF_ELSE_ZERO or second.code != ca.OP_IF_ELSE_ZERO:
        return node
    condition, other = first.operands[0], second.operands[0]
    if nodes[other].code == ca.OP_NOT and nodes[other].operands[0] == condition:
        return Node(_SELECT, (condition, first.operands[1], second.operands[1]))
    if nodes[condition].code == ca.OP_NOT and nodes[condition].operands[0] == other:
        return Node(_SELECT, (other, second.operands[1], first.operands[1]))
    return node


def uses(nodes: list[Node], results: list[int]) -> tuple[set[int], set[int]]:
    """Return the scalars that the results need, and those of them that nothing but comparisons use."""
    used, otherwise, todo = set(results), set(results), list(results)
    while todo:
        node = nodes[todo.pop()]
        todo += [i for i in node.operands if i not in used]
        used |= set(node.operands)
        if node.code not in _COMPARE:
            otherwise |= set(node.operands)
    return used, used - otherwise
