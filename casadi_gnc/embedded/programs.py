"""A CasADi function as scalars and calls: what of it is straight-line code, and what must stay a piece of its own.

An SX function is scalars alone. Of an MX function all is made scalars that can be; its branches, maps, tables, splines,
linear systems and functions that are used more than once become calls, with arrays in and out. Every scalar is
computed once, in whatever order the calls allow.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import lru_cache, wraps
from typing import TypeVar

import casadi as ca

from casadi_gnc.embedded.scalars import Node, graph
from casadi_gnc.errors import PrinterError

#: Most operations of one function; more is no flight code, and C of it takes hours to compile.
MOST_OPERATIONS = 1_000_000
#: What calls may add to a text by being written out; and a function that is smaller always is.
WRITTEN_OUT, SMALL = 200, 25
_REFUSED = {
    ca.OP_SETNONZEROS_PARAM: "writes elements at a computed index",
    ca.OP_ADDNONZEROS_PARAM: "adds to elements at a computed index",
    ca.OP_FIND: "searches the first element that is not zero",
    ca.OP_ASSERTION: "asserts something",
    ca.OP_MONITOR: "prints what it sees",
    ca.OP_DUMP: "writes to a file",
    ca.OP_CONVEXIFY: "changes eigenvalues",
}
#: Nodes that are no scalars, whatever is in them.
_PIECES = (ca.OP_BSPLINE, ca.OP_LOW, ca.OP_GETNONZEROS_PARAM)
_ROOTS = "write a fixed number of Newton steps in CasADi symbols"
_STEPS = 'take the "rk" integrator with the option simplify=True, or write the steps in CasADi symbols'
_OUTSIDE = "its C is not CasADi's to print; call it beside the package, and pass what it gives"
#: What to do about functions that are no expressions, by their class or what CasADi says that they are.
_REMEDIES = {
    "Nlpsol": "nonlinear programs have no bounded time on board; solve it on the ground, and pass what it gives",
    "Conic": "call it in a function of its own, casadi.Function(..., [g, lower, upper], [solver(...)[...]])",
    **dict.fromkeys(("Newton", "FastNewton", "KinsolInterface", "ImplicitToNlp"), _ROOTS),
    **dict.fromkeys(("RungeKutta", "Collocation", "CvodesInterface", "IdasInterface"), _STEPS),
    **dict.fromkeys(("External", "GenericExternal"), _OUTSIDE),
    "CallbackInternal": "Python does not fly; write it in CasADi symbols, or pass what it gives",
}


@dataclass(frozen=True)
class Port:
    """Name an argument or a result of a function, with the numbers that it holds."""

    name: str
    size: int


@dataclass(frozen=True)
class Callee:
    """Name a C function that was printed: `asks` whether its last argument is the status."""

    name: str
    asks: bool = False


@dataclass(frozen=True, eq=False)
class Call:
    """Call a C function: the scalars of each argument, and the array of each result."""

    callee: Callee
    arguments: tuple[tuple[int, ...], ...]
    results: tuple[Port, ...]


@dataclass(frozen=True, eq=False)
class Program:
    """Hold a function as scalars and calls.

    Parameters
    ----------
    inputs, outputs : the ports, nonzeros only.
    nodes : scalars; those of code OP_INPUT have the place "array[index]" of an input or of a call's result.
    stores : (output, element, scalar).
    calls : in order.
    """

    inputs: tuple[Port, ...]
    outputs: tuple[Port, ...]
    nodes: list[Node]
    stores: list[tuple[str, int, int]]
    calls: list[Call] = field(default_factory=list)

    @property
    def asks(self) -> bool:
        """Whether a call in it may have something to say in the status."""
        return any(call.callee.asks for call in self.calls)


#: What a quadratic program is given on board: gradient and bounds, of CasADi's h, g, a, lba, uba, lbx, ubx, ...
_GRADIENT, _LOWER, _UPPER = 1, 5, 6
#: A bound that nothing meets; infinite ones are no numbers of C.
_BEYOND = 1e30


def ports(function: ca.Function) -> tuple[tuple[Port, ...], tuple[Port, ...]]:
    """Return the arguments and the results of a function, as nonzeros."""
    inputs = tuple(Port(f"x{i}", function.nnz_in(i)) for i in range(function.n_in()))
    return inputs, tuple(Port(f"y{i}", function.nnz_out(i)) for i in range(function.n_out()))


def _has_calls(function: ca.Function) -> bool:
    return any(function.instruction_id(k) == ca.OP_CALL for k in range(function.n_instructions()))


def _opened(function: ca.Function) -> ca.Function:
    """Return the function without its option never_inline, which closes its body even to the one who prints it."""
    return function.slice(function.name(), list(range(function.n_in())), list(range(function.n_out())))


class _Same:
    """Stand for a function in a table: CasADi makes a new Python object of it at each place where it is called."""

    def __init__(self, function: ca.Function) -> None:
        self.function = function

    def __hash__(self) -> int:
        return self.function.__hash__()

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Same) and hash(self) == hash(other)


_Found = TypeVar("_Found")


def _once(look: Callable[[ca.Function], _Found]) -> Callable[[ca.Function], _Found]:
    """Look at a function once, not at each of its calls; the latest ones stay alive, so that no other takes a hash."""

    @lru_cache(maxsize=64)
    def kept(same: _Same) -> _Found:
        return look(same.function)

    @wraps(look)
    def looked(function: ca.Function) -> _Found:
        return kept(_Same(function))

    return looked


@_once
def is_never_inlined(function: ca.Function) -> bool:
    """Tell whether whoever made a plain function wants it to stay one, by CasADi's option never_inline."""
    symbols = function.sx_in()
    return _has_calls(ca.Function("probe", symbols, function.call(symbols)))


@_once
def is_plain(function: ca.Function) -> bool:
    """Tell whether a function is scalars alone: no branch, map, table or linear system in it or in what it calls."""
    if function.is_a("SXFunction"):
        return not _has_calls(function)
    if not function.is_a("MXFunction"):
        return False
    for k in range(function.n_instructions()):
        code = function.instruction_id(k)
        if code == ca.OP_CALL:
            called = function.instruction_MX(k).which_function()
            if not is_plain(called) or is_never_inlined(called):
                return False
        elif code in _REFUSED or _is_piece(function, k):
            return False
    return True


def _is_piece(function: ca.Function, k: int) -> bool:
    """Tell whether an instruction that is no call has a C function of its own."""
    code = function.instruction_id(k)
    return code in _PIECES or (code == ca.OP_SOLVE and not _is_triangular(function, k))


def _is_triangular(function: ca.Function, k: int) -> bool:
    """Tell whether a linear system is solved by substitution, which is scalars."""
    name = function.instruction_MX(k).class_name()
    return "Triu" in name or "Tril" in name


def expanded(function: ca.Function, place: str) -> ca.Function:
    """Return a plain function in SX; raise `PrinterError` where CasADi cannot."""
    if function.is_a("SXFunction"):
        found = function
    else:
        try:
            found = _opened(function).expand()
        except RuntimeError as error:
            node = re.search(r"not defined for (?:class )?(?:N6casadi\d+)?(\w+?)E?$", str(error).strip())
            said = f"has a node {node[1]}" if node else f"is no scalars ({str(error).strip().splitlines()[-1][-200:]})"
            raise PrinterError(f"{place} {said}, which has no C form here; write it in other operations") from None
    return check_size(found, place)


@_once
def operations(function: ca.Function) -> int:
    """Return how many operations a plain function is; raise `PrinterError` where CasADi cannot make scalars of it."""
    return expanded(function, function.name()).n_instructions()


def check_size(function: ca.Function, place: str) -> ca.Function:
    """Return the function; raise `PrinterError` where it has more operations than C of it could be compiled."""
    if function.n_instructions() > MOST_OPERATIONS:
        raise PrinterError(
            f"{place} has {function.n_instructions()} operations, expected at most {MOST_OPERATIONS}; "
            "write what repeats as a map, mapaccum or a function that is called"
        )
    return function


def refuse(function: ca.Function, place: str) -> PrinterError:
    """Return the error that says why a function cannot be printed, and what to do."""
    name = function.class_name()
    found = [text for kind, text in _REMEDIES.items() if name == kind or function.is_a(kind)]
    remedy = found[0] if found else "write it in CasADi symbols"
    return PrinterError(f"{place} is of kind {name.removesuffix('Internal')}, which has no C form here: {remedy}")


#: What makes a C function of an instruction that is no scalar: (function, instruction, place) -> callee.
Printed = Callable[[ca.Function, int, str], Callee]


def program(function: ca.Function, place: str, is_kept: Callable[[ca.Function], bool], printed: Printed) -> Program:
    """Return a function as scalars and calls.

    Parameters
    ----------
    function : SX or MX.
    place : where it is called, for messages: "controller, st_acc10".
    is_kept : whether a plain function that is called stays a function.
    printed : makes a C function of an instruction.

    Raises
    ------
    PrinterError
        For an operation that has no C form, and for functions that are too large.
    """
    inputs, outputs = ports(function)
    if function.is_a("SXFunction") and not _has_calls(function):
        nodes, stores = _scalars(check_size(function, place), inputs, outputs)
        return Program(inputs, outputs, nodes, stores)
    if not (function.is_a("MXFunction") or function.is_a("SXFunction")):
        raise refuse(function, place)
    given = function.mx_in()
    flat, results = _without_wrappers(given, _opened(function).call(given, True, False))
    cut, names, arguments, callees, arrays = [], [], [], [], []
    for k in range(flat.n_instructions()):
        pieces = _piece(flat, k, place, is_kept)
        if pieces is None:
            continue
        callees.append(printed(flat, k, place))
        arguments.append(_arguments(flat, k))
        arrays.append(tuple(Port(f"r{len(arrays)}_{i}", piece.nnz()) for i, piece in enumerate(pieces)))
        cut += pieces
        names += [ca.MX.sym(port.name, piece.sparsity()) for port, piece in zip(arrays[-1], pieces, strict=True)]
    flatter = [each for one in arguments for each in one]
    whole = ca.graph_substitute([*results, *flatter], cut, names) if cut else [*results, *flatter]
    sx = expanded(ca.Function(function.name(), [*given, *names], whole), place)
    wanted = [tuple(Port(f"c{k}_{i}", one.nnz()) for i, one in enumerate(each)) for k, each in enumerate(arguments)]
    nodes, stores = _scalars(sx, [*inputs, *sum(arrays, ())], [*outputs, *sum(wanted, ())])
    found = {(port, i): node for port, i, node in stores}
    calls = [
        Call(callee, tuple(tuple(found[port.name, i] for i in range(port.size)) for port in each), array)
        for callee, each, array in zip(callees, wanted, arrays, strict=True)
    ]
    own = {port.name for port in outputs}
    return Program(inputs, outputs, nodes, [one for one in stores if one[0] in own], calls)


def _piece(function: ca.Function, k: int, place: str, is_kept: Callable[[ca.Function], bool]) -> list[ca.MX] | None:
    """Return the results of an instruction that stays a call; None where it is scalars."""
    code, node = function.instruction_id(k), function.instruction_MX(k)
    if code in _REFUSED:
        raise PrinterError(f"{place}: a node {_REFUSED[code]}, which has no C form here; rewrite it without")
    if code == ca.OP_CALL:
        called = node.which_function()
        if is_plain(called) and not is_never_inlined(called) and not is_kept(called):
            return None
        return [node.get_output(i) for i in range(node.n_out())]
    return [node] if _is_piece(function, k) else None


def is_quadratic(function: ca.Function, k: int) -> bool:
    """Tell whether an instruction solves a quadratic program."""
    return function.instruction_id(k) == ca.OP_CALL and function.instruction_MX(k).which_function().is_a("Conic")


def wraps_quadratic(function: ca.Function) -> bool:
    """Tell whether a function is what qpsol makes, or another one that solves a quadratic program itself."""
    return function.is_a("MXFunction") and any(is_quadratic(function, k) for k in range(function.n_instructions()))


def _without_wrappers(given: list[ca.MX], results: list[ca.MX]) -> tuple[ca.Function, list[ca.MX]]:
    """Return a tape, and its results, in which quadratic programs stand themselves, not what qpsol makes around them.

    That has a result that is no number (the multipliers of parameters), which is gone where nobody asks for it.
    """
    while True:
        tape = ca.Function("flat", given, results)
        nodes = [tape.instruction_MX(k) for k in range(tape.n_instructions()) if tape.instruction_id(k) == ca.OP_CALL]
        nodes = [node for node in nodes if wraps_quadratic(node.which_function())]
        if not nodes:
            return tape, results
        node = nodes[0]
        inside = node.which_function().call([node.dep(i) for i in range(node.n_dep())], True, False)
        outside = [node.get_output(i) for i in range(node.n_out())]
        results = ca.graph_substitute(results, outside, inside)


def _arguments(function: ca.Function, k: int) -> list[ca.MX]:
    """Return what the C function of an instruction is given."""
    node = function.instruction_MX(k)
    if not is_quadratic(function, k):
        return [node.dep(i) for i in range(node.n_dep())]
    lower, upper = ca.densify(node.dep(_LOWER)), ca.densify(node.dep(_UPPER))
    # What is no number stays none, so that the step is refused.
    lower, upper = ca.if_else(lower < -_BEYOND, -_BEYOND, lower), ca.if_else(upper > _BEYOND, _BEYOND, upper)
    return [ca.densify(node.dep(_GRADIENT)), lower, upper]


def _scalars(
    function: ca.Function, inputs: Sequence[Port], outputs: Sequence[Port]
) -> tuple[list[Node], list[tuple[str, int, int]]]:
    given = {function.name_in(i): [f"{p.name}[{n}]" for n in range(p.size)] for i, p in enumerate(inputs)}
    told = {function.name_out(i): [f"{p.name} {n}" for n in range(p.size)] for i, p in enumerate(outputs)}
    nodes, results = graph(function, {**given, **told})
    return nodes, [(place.split()[0], int(place.split()[1]), node) for place, node in results]
