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
from textwrap import wrap
from typing import Literal

import casadi as ca

from casadi_gnc.embedded.named_nodes import Mark
from casadi_gnc.embedded.scalars import LARGEST_FLOAT, Math, Node, Real, c_constant, expression, graph, uses
from casadi_gnc.errors import PrinterError

#: Operations from which on a quantity on the way is a block of its own.
LEAST = 4


def print_function(
    function: ca.Function,
    *,
    maths: Math = "gnc",
    real: Real = "double",
    arguments: Sequence[str] | None = None,
    places: Mapping[str, Sequence[str]] | None = None,
    flag: str = "_Bool",
    shared: Sequence[str] | None = None,
    titles: Mapping[str, str] | None = None,
    marks: Sequence[Mark] = (),
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
    titles : for places of results what they are: the operations that each is the first to need follow it as a comment.
    marks : of scalars on the way there what they are, in the order in which they are made.

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
    nodes, results = graph(function, places)
    zero, one = c_constant(0.0, real), c_constant(1.0, real)
    used, compared = uses(nodes, [node for _, node in results])
    blocks = blocks_of(nodes, results, titles or {}, marks)
    headings, told = _headings([k for k in range(len(nodes)) if k in used], blocks), set()
    body = []
    for k, node in enumerate(nodes):
        if k not in used:
            continue
        if block := headings.get(k):
            body += [f"    {line}" for line in comment(block, again=block in told)]
            told.add(block)
        if node.code == ca.OP_CONST:
            # A bound beyond the largest float is met by every finite float and by no infinite one.
            huge = real == "float" and k in compared and math.isfinite(node.number)
            number = min(max(node.number, -LARGEST_FLOAT), LARGEST_FLOAT) if huge else node.number
            text = c_constant(number, real)
        elif node.code == ca.OP_INPUT:
            text = node.place
        else:
            flags = [nodes[i].is_flag for i in node.operands]
            try:
                side_by_side = (False,) * len(flags)
                text = expression(node.code, tuple(flags) if shared is None else side_by_side, maths, real)
            except PrinterError as error:
                raise PrinterError(f"{function.name()}: {error}") from None
            if shared is not None and node.is_flag:
                text = _as_number(node.code, text, flags, real)
            text = text.format(*(f"a{i}" for i in node.operands))
        said = dust(node.number) if titles is not None and node.code == ca.OP_CONST else ""
        body.append(f"    const {flag if node.is_flag and shared is None else 'gnc_real'} a{k} = {text};{said}")
    as_number = f" ? {one} : {zero}"
    stores = [f"    {place} = a{k}{as_number if nodes[k].is_flag and shared is None else ''};" for place, k in results]
    unused = []
    if arguments is None:
        arguments = [f"const gnc_real *{name}" for name in inputs] + [f"gnc_real *{name}" for name in outputs]
        read = _read(function)
        unused = [f"    (void){name};" for i, name in enumerate(inputs) if i not in read]
        unused += [f"    (void){name};" for i, name in enumerate(outputs) if not function.numel_out(i)]
    head = f"static void {function.name()}(\n    " + ",\n    ".join(arguments) + ")\n{"
    if shared is None:
        return "\n".join([head, *unused, *body, *stores, "}", ""])
    loop = ["    long l;", "#pragma omp simd", "    for (l = 0; l < LANES; l++) {"]
    inner = [f"    {line}" for line in (*body, *stores)]
    return "\n".join([head, loop[0], *unused, *loop[1:], *inner, "    }", "}", ""])


def blocks_of(
    nodes: Sequence[Node], results: Sequence[tuple[str, int]], titles: Mapping[str, str], marks: Sequence[Mark] = ()
) -> dict[int, str]:
    """Return for each scalar the title of the first that needs it, of the marks, then of the results.

    A mark of which less than `LEAST` operations are left is no block of its own.
    """
    found: dict[int, str] = {}
    told = [(titles[place], (node,)) for place, node in results if place in titles]
    for i, (title, wanted) in enumerate([*marks, *told]):
        own, todo = set[int](), list(wanted)
        while todo:
            k = todo.pop()
            if k not in found and k not in own:
                own.add(k)
                todo += nodes[k].operands
        if i >= len(marks) or sum(1 for k in own if nodes[k].operands) >= LEAST:
            found.update(dict.fromkeys(own, title))
    return found


def _headings(order: Sequence[int], blocks: Mapping[int, str]) -> dict[int, str]:
    """Return the title before each scalar that begins a block; less than `LEAST` of a block told before begin none."""
    runs: list[tuple[str, list[int]]] = []
    for k in order:
        title = blocks.get(k, runs[-1][0] if runs else "")
        if not runs or runs[-1][0] != title:
            runs.append((title, []))
        runs[-1][1].append(k)
    found: dict[int, str] = {}
    block, told = "", {""}
    for title, run in runs:
        if title != block and (title not in told or len(run) >= LEAST):
            found[run[0]] = block = title
            told.add(title)
    return found


def comment(block: str, *, again: bool) -> list[str]:
    """Return the lines of a comment with the title of a block, of its name alone where it goes on."""
    lines = wrap(f"{block.partition(':')[0]} again" if again else block, 112)
    return [f"{'/*' if i == 0 else ' *'} {line}{' */' if i == len(lines) - 1 else ''}" for i, line in enumerate(lines)]


def dust(number: float) -> str:
    """Return a comment on a constant that arithmetic left next to a short number, or next to zero; "" for others."""
    short = float(f"{number:.9g}")
    if number != short and abs(number - short) <= 8.0 * math.ulp(short):
        return f" /* {short!r} and rounding */"
    return " /* rounding of zero, where other numbers are about 1 */" if 0.0 < abs(number) < 2.0**-52 else ""


def _as_number(code: int, text: str, flags: list[bool], real: Real) -> str:
    """Return a flag as 1 or 0, which vectors hold; `flags` says which operands are such numbers already.

    Logic is arithmetic, exact on these numbers: gcc makes choices between truths of it otherwise, for which it has no
    vector instruction, and the whole loop stays scalar.
    """
    zero, one = c_constant(0.0, real), c_constant(1.0, real)
    x, y = ([f"{{{i}}}" if flag else f"(({{{i}}} != {zero}) ? {one} : {zero})" for i, flag in enumerate(flags)] * 2)[:2]
    if code == ca.OP_NOT:
        return f"{one} - {x}"
    if code == ca.OP_AND:
        return f"{x} * {y}"
    return f"({f'{x} + {y} > {zero}' if code == ca.OP_OR else text}) ? {one} : {zero}"


def _read(function: ca.Function) -> set[int]:
    """Return the arguments of which some element is read."""
    reads = [k for k in range(function.n_instructions()) if function.instruction_id(k) == ca.OP_INPUT]
    return {function.instruction_input(k)[0] for k in reads}


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
