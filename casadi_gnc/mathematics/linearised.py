"""A tape, its partial derivatives at a point, and the two linear tapes that use them.

Every operation of an SX function has partial derivatives with respect to its operands. The tape `values` computes
what the function computes, with the same operations and so with the same words, and puts the partials that are no
constants into one column. The tapes `forward` and `reverse` are linear: they take that column and carry columns of
derivatives from the inputs to the outputs, or from the outputs back to the inputs. What is taken at a point once
serves any number of directions.

Choices are differentiated as they were made: a comparison, `floor`, `ceil` and a sign have the derivative 0, and of
two branches the one that was taken counts. A partial that is not finite (of a root at 0, or in a branch that was not
taken) is to be replaced by 0 by whoever fills the column, which for the norm of a column at 0 is a subgradient.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache

import casadi as ca

_FLAT = (ca.OP_LT, ca.OP_LE, ca.OP_EQ, ca.OP_NE, ca.OP_NOT, ca.OP_AND, ca.OP_OR, ca.OP_FLOOR, ca.OP_CEIL, ca.OP_SIGN)
_ONE, _ZERO = ca.SX(1), ca.SX(0)


@dataclass(frozen=True, eq=False)
class Linearised:
    """Hold a tape's three.

    Parameters
    ----------
    values : the inputs of the tape -> its outputs, partials.
    forward : partials, the moving inputs -> the moving outputs, derivatives all of them.
    reverse : partials, the moving outputs -> the moving inputs, derivatives of one number all of them.
    moving : names of the inputs that carry derivatives.
    partials : how many there are.
    """

    values: ca.Function
    forward: ca.Function
    reverse: ca.Function
    moving: tuple[str, ...]
    partials: int


def linearised(tape: ca.Function, still: Iterable[str]) -> Linearised:
    """Return the three tapes of an SX function with dense ports.

    Parameters
    ----------
    tape : whose inputs and outputs have names of their own.
    still : names of inputs that do not move, and of outputs whose derivatives nobody asks for.

    Examples
    --------
    >>> x = ca.SX.sym("x", 2)
    >>> three = linearised(ca.Function("f", [x], [x[0] * ca.sin(x[1])], ["x"], ["y"]), ())
    >>> y, partials = three.values([3.0, 0.0])
    >>> three.forward(partials, [0.0, 1.0]), three.reverse(partials, 1.0)
    (DM(3), DM([0, 3]))
    """
    still = set(still)
    inputs, outputs = tape.name_in(), tape.name_out()
    symbols = [ca.SX.sym(name, tape.numel_in(i)) for i, name in enumerate(inputs)]
    walk = _Walk(tape, symbols, {i for i, name in enumerate(inputs) if name not in still})
    asked = [i for i, name in enumerate(outputs) if name not in still]
    walk.need([k for i in asked for k in walk.results[i] if k is not None])
    results = [ca.vertcat(*column) if column else ca.SX(0, 1) for column in walk.answers]
    column = ca.vertcat(*walk.partials) if walk.partials else ca.SX(0, 1)
    merged = ca.cse([ca.densify(ca.SX(each)) for each in (*results, column)])
    values = ca.Function(f"{tape.name()}_values", symbols, merged, inputs, [*outputs, "partials"])
    moving = tuple(name for name in inputs if name not in still)
    given = ca.SX.sym("partials", len(walk.partials))
    into = [ca.SX.sym(name, tape.numel_in(name)) for name in moving]
    there = walk.forward(given, dict(zip((inputs.index(name) for name in moving), into, strict=True)), asked)
    names = [outputs[i] for i in asked]
    forward = ca.Function(f"{tape.name()}_forward", [given, *into], there, ["partials", *moving], names)
    back = [ca.SX.sym(name, tape.numel_out(name)) for name in names]
    bars = walk.reverse(given, dict(zip(asked, back, strict=True)), [inputs.index(name) for name in moving])
    reverse = ca.Function(f"{tape.name()}_reverse", [given, *back], bars, ["partials", *names], list(moving))
    return Linearised(values, forward, reverse, moving, len(walk.partials))


class _Walk:
    """The operations of a tape in order: values, what each depends on, and by how much."""

    def __init__(self, tape: ca.Function, symbols: list[ca.SX], moving: set[int]) -> None:
        self._sizes = [symbol.numel() for symbol in symbols]
        #: Of each node the operands that move, and the partials; of an input where it comes from.
        self.operands: list[tuple[tuple[int, ca.SX], ...]] = []
        self.places: dict[int, tuple[int, int]] = {}
        self.answers = [[_ZERO] * tape.numel_out(i) for i in range(tape.n_out())]
        self.results: list[list[int | None]] = [[None] * tape.numel_out(i) for i in range(tape.n_out())]
        self.partials: list[ca.SX] = []
        self._kept: list[tuple[tuple[int, float | int], ...]] = []
        value: dict[int, tuple[ca.SX, int | None]] = {}  # place in the work vector -> value, node where it moves
        for k in range(tape.n_instructions()):
            code, given, target = tape.instruction_id(k), tape.instruction_input(k), tape.instruction_output(k)
            if code == ca.OP_OUTPUT:
                self.answers[target[0]][target[1]], self.results[target[0]][target[1]] = value[given[0]]
            elif code == ca.OP_INPUT:
                node = self._noted(()) if given[0] in moving else None
                if node is not None:
                    self.places[node] = (given[0], given[1])
                value[target[0]] = (symbols[given[0]][given[1]], node)
            elif code == ca.OP_CONST:
                value[target[0]] = (ca.SX(tape.instruction_constant(k)), None)
            else:
                operands = [value[i] for i in given]
                made = _made(code, [own for own, _ in operands])
                value[target[0]] = (made, self._moved(code, operands, made))

    def _noted(self, operands: tuple[tuple[int, ca.SX], ...]) -> int:
        self.operands.append(operands)
        return len(self.operands) - 1

    def _moved(self, code: int, operands: list[tuple[ca.SX, int | None]], made: ca.SX) -> int | None:
        """Return the node of an operation, None where it does not move."""
        if code in _FLAT or all(node is None for _, node in operands):
            return None
        partials = _partials(code, [own for own, _ in operands], made)
        moved = tuple(
            (node, partial)
            for (_, node), partial in zip(operands, partials, strict=True)
            if node is not None and not partial.is_zero()
        )
        return self._noted(moved) if moved else None

    def need(self, results: list[int]) -> None:
        """Give a place to the partials that the results need."""
        needed, places = set(results), dict[int, list[int]]()
        self._kept = [()] * len(self.operands)
        for k in range(len(self.operands) - 1, -1, -1):
            if k not in needed:
                continue
            kept: list[tuple[int, float | int]] = []
            for operand, partial in self.operands[k]:
                needed.add(operand)
                kept.append((operand, float(partial) if partial.is_constant() else self._place(partial, places)))
            self._kept[k] = tuple(kept)

    def _place(self, partial: ca.SX, places: dict[int, list[int]]) -> int:
        """Return the place of a partial in the column, the same for the same."""
        same = places.setdefault(partial.element_hash(), [])
        if not same:
            same.append(len(self.partials))
            self.partials.append(partial)
        return same[0]

    def forward(self, given: ca.SX, into: dict[int, ca.SX], asked: list[int]) -> list[ca.SX]:
        """Return the derivatives of outputs by those of inputs."""
        d: list[ca.SX] = []
        for k, kept in enumerate(self._kept):
            if k in self.places:
                port, element = self.places[k]
                d.append(into[port][element])
                continue
            total = _ZERO
            for operand, partial in kept:
                total = total + _scale(given, partial) * d[operand]
            d.append(total)
        columns = [[_ZERO if k is None else d[k] for k in self.results[i]] for i in asked]
        return [ca.densify(ca.vertcat(*column)) if column else ca.SX(0, 1) for column in columns]

    def reverse(self, given: ca.SX, back: dict[int, ca.SX], ports: list[int]) -> list[ca.SX]:
        """Return the derivatives of one number by inputs from those by outputs."""
        bar = [_ZERO] * len(self._kept)
        for i, column in back.items():
            for element, k in enumerate(self.results[i]):
                if k is not None:
                    bar[k] = bar[k] + column[element]
        found = {port: [_ZERO] * self._sizes[port] for port in ports}
        for k in range(len(self._kept) - 1, -1, -1):
            if k in self.places:
                port, element = self.places[k]
                found[port][element] = found[port][element] + bar[k]
            for operand, partial in self._kept[k]:
                bar[operand] = bar[operand] + _scale(given, partial) * bar[k]
        return [ca.densify(ca.vertcat(*found[port])) if found[port] else ca.SX(0, 1) for port in ports]


def _scale(given: ca.SX, partial: float | int) -> ca.SX:
    return given[partial] if isinstance(partial, int) else ca.SX(partial)


def _made(code: int, operands: list[ca.SX]) -> ca.SX:
    return ca.SX.unary(code, *operands) if len(operands) == 1 else ca.SX.binary(code, *operands)


def _partials(code: int, operands: list[ca.SX], made: ca.SX) -> list[ca.SX]:
    """Return the partial derivatives of an operation with respect to its operands."""
    if code == ca.OP_ADD:
        return [_ONE, _ONE]
    if code == ca.OP_SUB:
        return [_ONE, -_ONE]
    if code == ca.OP_MUL:
        return [operands[1], operands[0]]
    if code == ca.OP_DIV:
        return [1 / operands[1], -made / operands[1]]
    if code == ca.OP_SQRT:
        return [0.5 / made]
    if code == ca.OP_IF_ELSE_ZERO:
        return [_ZERO, operands[0] != 0]
    if code == ca.OP_COPYSIGN:
        return [ca.sign(operands[0]) * ca.copysign(1.0, operands[1]), _ZERO]
    return list(_rule(code, len(operands)).call(operands))


@lru_cache
def _rule(code: int, count: int) -> ca.Function:
    """Return CasADi's rule for an operation: its operands -> its partial derivatives."""
    operands = [ca.SX.sym(f"operand{i}") for i in range(count)]
    made = _made(code, operands)
    return ca.Function("rule", operands, [ca.densify(ca.jacobian(made, operand)) for operand in operands])
