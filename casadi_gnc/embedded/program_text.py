"""Print a program as C functions of bounded length.

A short program is one function. A long one is a row of them, each with at most `LENGTH` statements. What one leaves to
a later one lies in an array that they share, whose places are used again: neither compilers nor stacks see the size.
"""

from __future__ import annotations

import heapq
import math
import re
from collections.abc import Iterable, Mapping

import casadi as ca

from casadi_gnc.embedded.printer import blocks_of, comment, dust
from casadi_gnc.embedded.program_order import Copy, Item, Order, Store
from casadi_gnc.embedded.programs import Call, Port, Program
from casadi_gnc.embedded.scalars import LARGEST_FLOAT, Math, Real, c_constant, expression
from casadi_gnc.errors import PrinterError

#: Most statements of one C function.
LENGTH = 1000


def declare(name: str, inputs: Iterable[Port], outputs: Iterable[Port], asks: bool) -> str:
    """Return the head of a C function: arguments, results, and the status where it has something to say."""
    given = [f"const gnc_real *{port.name}" for port in inputs] + [f"gnc_real *{port.name}" for port in outputs]
    given += ["uint32_t *status"] if asks else []
    return f"static void {name}(\n    {(',' + chr(10) + '    ').join(given) or 'void'})"


class _Printer:
    """Print one program."""

    def __init__(self, name: str, program: Program, maths: Math, real: Real, titles: Mapping[str, str]) -> None:
        self._name, self._program = name, program
        self._maths: Math = maths
        self._real: Real = real
        self._nodes = program.nodes
        self._zero, self._one = c_constant(0.0, real), c_constant(1.0, real)
        self._order = Order(program)
        self._numbers = {call: i for i, call in enumerate(program.calls)}
        stores = [(port, node) for port, _, node in program.stores]
        self._blocks, self._told = blocks_of(self._nodes, stores, titles), set[str]()
        self._titles = titles

    # ---- The text of a statement ---------------------------------------------------------------------

    def _constant(self, k: int) -> str:
        # A bound beyond the largest float is met by every finite float and by no infinite one.
        number = self._nodes[k].number
        if self._real == "float" and k in self._order.compared and math.isfinite(number):
            number = min(max(number, -LARGEST_FLOAT), LARGEST_FLOAT)
        return c_constant(number, self._real)

    def _number(self, k: int) -> str:
        """Return the C of a scalar as a number."""
        return f"(a{k} ? {self._one} : {self._zero})" if self._nodes[k].is_flag else f"a{k}"

    def scalar(self, k: int, arrays: dict[str, int]) -> str:
        """Return the declaration of a scalar."""
        node, said = self._nodes[k], ""
        if node.code == ca.OP_CONST:
            text, said = self._constant(k), dust(node.number) if self._titles else ""
        elif node.code == ca.OP_INPUT:
            text = _at(*self._order.place[k], arrays)
        else:
            text = expression(node.code, tuple(self._nodes[i].is_flag for i in node.operands), self._maths, self._real)
            text = text.format(*(f"a{i}" for i in node.operands))
        return f"const {'gnc_flag' if node.is_flag else 'gnc_real'} a{k} = {text};{said}"

    def call(self, call: Call, arrays: dict[str, int]) -> list[str]:
        """Return the statements of a call; `arrays` holds the places of arrays that are part of one large one."""
        number, lines, given = self._numbers[call], [], []
        for i, argument in enumerate(call.arguments):
            name, source = f"c{number}_{i}", self._order.source(argument)
            if source is not None:
                given.append(_pointer(*source, arrays))
                continue
            if argument and not self._order.is_table(argument):
                lines += [f"{_at(name, n, arrays)} = {self._number(k)};" for n, k in enumerate(argument)]
            given.append(_pointer(name, 0, arrays) if argument else "0")
        given += [_pointer(port.name, 0, arrays) if port.size else "0" for port in call.results]
        given += ["status"] if call.callee.asks else []
        return [*lines, f"{call.callee.name}({', '.join(given)});"]

    def statement(self, item: Item, arrays: dict[str, int]) -> list[str]:
        """Return the C of one item."""
        if isinstance(item, Call):
            return self.call(item, arrays)
        if isinstance(item, Copy):
            source = _pointer(item.source, item.start, arrays)
            return [f"copy_numbers({item.count}, {source}, {_pointer(item.target, item.at, arrays)});"]
        if isinstance(item, Store):
            return [f"{item.target}[{item.at}] = {self._number(item.node)};"]
        return [self.scalar(item, arrays)]

    def statements(self, items: Iterable[Item], arrays: dict[str, int]) -> list[str]:
        """Return the C of items in blocks, each under the title of the result that it is computed for."""
        lines, block = [], ""
        for item in items:
            title = self._blocks.get(item, block) if isinstance(item, int) else block
            if title != block:
                block = title
                lines += comment(title, again=title in self._told)
                self._told.add(title)
            lines += self.statement(item, arrays)
        return lines

    def tables(self) -> list[str]:
        """Return arguments of calls that are constants, as tables."""
        lines = []
        for call in self._program.calls:
            for i, argument in enumerate(call.arguments):
                if self._order.is_table(argument):
                    values = ", ".join(self._constant(k) for k in argument)
                    name = f"c{self._numbers[call]}_{i}"
                    lines.append(f"static const gnc_real {name}[{len(argument)}] = {{{values}}};")
        return lines

    def arrays(self) -> list[Port]:
        """Return the arrays that calls read and write and that are neither ports nor tables."""
        found = []
        for call in self._program.calls:
            found += [
                Port(f"c{self._numbers[call]}_{i}", len(argument))
                for i, argument in enumerate(call.arguments)
                if argument and self._order.source(argument) is None and not self._order.is_table(argument)
            ]
            found += [port for port in call.results if port.size]
        return found

    # ---- One function, or a row of them -----------------------------------------------------------------

    def text(self) -> str:
        """Return the C of the program."""
        items = self._order.items()
        head = declare(self._name, self._program.inputs, self._program.outputs, self._program.asks)
        if len(items) <= LENGTH:
            body = [f"gnc_real {port.name}[{port.size}];" for port in self.arrays()] + self.tables()
            body += self.statements(items, {})
            return _function(head, body, self._unused("\n".join(body)))
        return self._pieces(head, items)

    def _unused(self, body: str) -> list[str]:
        names = [port.name for port in (*self._program.inputs, *self._program.outputs)]
        names += ["status"] if self._program.asks else []
        return [f"(void){name};" for name in names if not re.search(rf"\b{name}\b", body)]

    def _pieces(self, head: str, items: list[Item]) -> str:
        rows = [items[i : i + LENGTH] for i in range(0, len(items), LENGTH)]
        arrays: dict[str, int] = {}
        room = 0
        for port in self.arrays():
            arrays[port.name] = room
            room += port.size
        slots, room = self._slots(rows, room)
        tables = {text.split("[")[0].split()[-1]: text for text in self.tables()}
        named = [(port.name, f"const gnc_real *{port.name}") for port in self._program.inputs]
        named += [(port.name, f"gnc_real *{port.name}") for port in self._program.outputs]
        named += [("w", "gnc_real *w"), ("status", "uint32_t *status")]
        texts, body = [], [f"gnc_real w[{max(room, 1)}];"]
        for number, row in enumerate(rows, 1):
            lines = self._row(row, slots, arrays)
            said = set(re.findall(r"\w+", "\n".join(lines)))
            lines = [text for name, text in tables.items() if name in said] + lines
            given = [(name, text) for name, text in named if name in said]
            part = f"{self._name}_part{number}"
            texts.append(_function(f"GNC_APART static void {part}({', '.join(text for _, text in given)})", lines, []))
            body.append(f"{part}({', '.join(name for name, _ in given)});")
        return "\n".join([*texts, _function(head, body, self._unused("\n".join(body)))])

    def _slots(self, rows: list[list[Item]], room: int) -> tuple[dict[int, int], int]:
        """Return the place of each scalar that a later row uses, and the numbers of the whole array."""
        home = {item: r for r, row in enumerate(rows) for item in row if isinstance(item, int)}
        last: dict[int, int] = {}
        for r, row in enumerate(rows):
            for k in self._read(row):
                if home[k] != r and self._nodes[k].code not in (ca.OP_CONST, ca.OP_INPUT):
                    last[k] = r
        free: list[int] = []
        ending: dict[int, list[int]] = {}
        slots: dict[int, int] = {}
        for r, row in enumerate(rows):
            for k in row:
                if isinstance(k, int) and k in last:
                    if free:
                        slots[k] = heapq.heappop(free)
                    else:
                        slots[k], room = room, room + 1
                    ending.setdefault(last[k], []).append(slots[k])
            for slot in ending.pop(r, ()):
                heapq.heappush(free, slot)
        return slots, room

    def _read(self, row: list[Item]) -> set[int]:
        """Return the scalars that a row reads."""
        found: set[int] = set()
        for item in row:
            if isinstance(item, int):
                found.update(self._nodes[item].operands)
            elif isinstance(item, Store):
                found.add(item.node)
            elif isinstance(item, Call):
                for argument in item.arguments:
                    if self._order.source(argument) is None and not self._order.is_table(argument):
                        found.update(argument)
        return found

    def _row(self, row: list[Item], slots: dict[int, int], arrays: dict[str, int]) -> list[str]:
        """Return the statements of one function of a row: what it takes over, does and leaves."""
        own = {item for item in row if isinstance(item, int)}
        lines = []
        for k in sorted(self._read(row) - own):
            node = self._nodes[k]
            if node.code in (ca.OP_CONST, ca.OP_INPUT):
                lines.append(self.scalar(k, arrays))
            else:
                kept = f"w[{slots[k]}]{f' != {self._zero}' if node.is_flag else ''}"
                lines.append(f"const {'gnc_flag' if node.is_flag else 'gnc_real'} a{k} = {kept};")
        read = self._read(row) | slots.keys()
        lines += self.statements([item for item in row if not isinstance(item, int) or item in read], arrays)
        return lines + [f"w[{slots[k]}] = {self._number(k)};" for k in sorted(own) if k in slots]


def _function(head: str, body: list[str], unused: list[str]) -> str:
    return "\n".join([head, "{", *(f"    {line}" for line in (*unused, *body)), "}", ""])


def _at(name: str, index: int, arrays: dict[str, int]) -> str:
    return f"w[{arrays[name] + index}]" if name in arrays else f"{name}[{index}]"


def _pointer(name: str, index: int, arrays: dict[str, int]) -> str:
    return f"&{_at(name, index, arrays)}"


def print_program(
    name: str, program: Program, *, maths: Math = "gnc", real: Real = "double", titles: Mapping[str, str] | None = None
) -> str:
    """Return the C text of a program: `static void name(x0, x1, ..., y0, ... [, status])`.

    `titles` tell of results what they are: the operations that each is the first to need follow it as a comment.

    Raises
    ------
    PrinterError
        For an operation or a constant that has no C form.
    """
    try:
        return _Printer(name, program, maths, real, titles or {}).text()
    except PrinterError as error:
        raise PrinterError(f"{name}: {error}") from None
