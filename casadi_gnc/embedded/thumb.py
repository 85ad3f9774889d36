"""Machine code of Cortex-M from a disassembly: instructions, functions, loops."""

from __future__ import annotations

import functools
import re
from dataclasses import dataclass, field

from casadi_gnc.errors import TargetError

CONDITIONS = ("eq", "ne", "cs", "cc", "mi", "pl", "vs", "vc", "hi", "ls", "ge", "lt", "gt", "le")
_OPPOSITE = ("ne", "eq", "cc", "cs", "pl", "mi", "vc", "vs", "ls", "hi", "lt", "ge", "le", "gt")
OPPOSITE: dict[str, str] = dict(zip(CONDITIONS, _OPPOSITE, strict=True))
_LINE = re.compile(r"^\s*([0-9a-f]+):\t(\S+)(?:\t(.*))?$")
_HEAD = re.compile(r"^([0-9a-f]+) <([^>]+)>:$")
_NAMES = {"ip": 12, "sp": 13, "lr": 14, "pc": 15, "sl": 10, "fp": 11, "sb": 9}
#: The node of a function's graph that stands for its end.
END = -1


@dataclass(frozen=True)
class Instruction:
    """Hold one instruction.

    Parameters
    ----------
    at, size : address and bytes.
    name : mnemonic without width, condition and flag that sets flags.
    arguments : as the disassembler writes them.
    condition : of an instruction in an IT block, or of a branch; empty: always.
    sets_flags : whether the mnemonic says so.
    target : of a branch or a call.
    """

    at: int
    size: int
    name: str
    arguments: tuple[str, ...]
    condition: str = ""
    sets_flags: bool = False
    target: int | None = None

    @property
    def next(self) -> int:
        """Return the address behind it."""
        return self.at + self.size

    @functools.cached_property
    def is_return(self) -> bool:
        """Whether the function ends here."""
        if self.name == "bx":
            return self.arguments == ("lr",)
        loads = self.name in ("pop", "ldmia", "ldm") and "pc" in self.arguments[-1]
        return loads or (self.name == "ldr" and self.arguments[0] == "pc")


@dataclass
class Function:
    """Hold a function: instructions by address; once found, their order, joins of ways, and the loops around each."""

    name: str
    start: int
    code: dict[int, Instruction] = field(default_factory=dict)
    place: dict[int, int] = field(default_factory=dict)
    joins: frozenset[int] = frozenset()
    nest: dict[int, tuple[int, ...]] = field(default_factory=dict)
    back: dict[tuple[int, int], int] = field(default_factory=dict)


@functools.cache
def register(name: str) -> int:
    """Return the number of a core register, -1 for what is none."""
    if name in _NAMES:
        return _NAMES[name]
    return int(name[1:]) if re.fullmatch(r"r\d+", name) else -1


@functools.cache
def arguments_of(text: str) -> tuple[str, ...]:
    """Return arguments; what stands in brackets or braces is one."""
    text = re.split(r"\s*[@;]", text)[0].strip()
    found, depth, start = [], 0, 0
    for place, letter in enumerate(text):
        depth += (letter in "[{") - (letter in "]}")
        if letter == "," and depth == 0:
            found.append(text[start:place].strip())
            start = place + 1
    return (*found, text[start:].strip()) if text else ()


def functions(disassembly: str) -> dict[int, Function]:
    """Return the functions of `objdump -d --no-show-raw-insn` by their address."""
    found: dict[int, Function] = {}
    rows: list[tuple[int, str, str]] = []
    current: Function | None = None
    pending: list[tuple[Function, list[tuple[int, str, str]]]] = []
    for line in disassembly.splitlines():
        if head := _HEAD.match(line):
            current, rows = Function(head[2], int(head[1], 16)), []
            found[current.start] = current
            pending.append((current, rows))
        elif (row := _LINE.match(line)) and current is not None:
            rows.append((int(row[1], 16), row[2], row[3] or ""))
    for function, lines in pending:
        _decode(function, lines)
    return found


def _decode(function: Function, rows: list[tuple[int, str, str]]) -> None:
    waiting: list[str] = []
    for place, (at, mnemonic, text) in enumerate(rows):
        if mnemonic.startswith("."):
            continue
        size = rows[place + 1][0] - at if place + 1 < len(rows) else 4
        condition = waiting.pop(0) if waiting else ""
        name = mnemonic.split(".")[0] if not mnemonic.startswith("v") else mnemonic
        if re.fullmatch(r"it[te]{0,3}", name):
            first = text.strip()
            waiting = [first] + [first if letter == "t" else OPPOSITE[first] for letter in name[2:]]
            function.code[at] = Instruction(at, size, "it", ())
            continue
        if condition:
            name = name.replace(condition, "", 1) if not name.endswith(condition) else name[: -len(condition)]
        function.code[at] = _instruction(at, size, name, arguments_of(text), condition)


def _instruction(at: int, size: int, name: str, arguments: tuple[str, ...], condition: str) -> Instruction:
    if name in ("b", "bl", "cbz", "cbnz") or (name[0] == "b" and name[1:] in CONDITIONS):
        if not arguments:
            return Instruction(at, size, "data", ())  # what the disassembler takes for code and is none
        target = int(arguments[-1].split()[0], 16)
        if name[1:] in CONDITIONS:
            name, condition = "b", name[1:]
        return Instruction(at, size, name, arguments, condition, target=target)
    sets = name.endswith("s") and name[:-1] in _SETTING
    return Instruction(at, size, name[:-1] if sets else name, arguments, condition, sets)


_SETTING = {
    "mov",
    "mvn",
    "add",
    "sub",
    "rsb",
    "mul",
    "and",
    "orr",
    "orn",
    "eor",
    "bic",
    "lsl",
    "lsr",
    "asr",
    "adc",
    "sbc",
}


def followers(function: Function, one: Instruction) -> list[int]:
    """Return where control may go from an instruction, within its function; `END` for out of it."""
    inside = one.target is not None and one.target in function.code
    if one.name in ("cbz", "cbnz"):
        return [one.next, one.target or END]
    if one.name == "b":
        there = one.target if inside and one.target is not None else END
        return [one.next, there] if one.condition else [there]
    if one.is_return:
        return [one.next, END] if one.condition else [END]
    if one.name in ("tbb", "tbh", "blx") or (one.name == "bx" and not one.is_return):
        raise TargetError(f"{function.name} jumps through a register at {one.at:x}: its ways cannot be counted")
    return [one.next] if one.next in function.code else [END]


def find_loops(function: Function) -> None:
    """Find the order of a function's instructions, its loops, and where ways join.

    Of a loop that is entered in two places one instruction lies on every way round: it is taken as the last.

    Raises
    ------
    TargetError
        Where there is no such instruction.
    """
    after = {at: followers(function, one) for at, one in function.code.items()}
    order = _reverse_postorder(function.start, after)
    place = {at: number for number, at in enumerate(order)}
    before: dict[int, list[int]] = {}
    for at in order:
        for one in after[at]:
            before.setdefault(one, []).append(at)
    function.joins = frozenset(at for at, many in before.items() if len(many) > 1)
    above = _dominators(order, before, place)
    bodies: dict[int, set[int]] = {}
    for at in order:
        for head in after[at]:
            if head != END and place[head] <= place[at] and _is_above(head, at, above):
                function.back[at, head] = head
                bodies.setdefault(head, {head}).update(_body(head, at, before))
    rest = {at: [one for one in after[at] if one != END and (at, one) not in function.back] for at in order}
    for knot in _knots(order, rest):
        last = _last_of(knot, rest, function.name)
        head = min(knot, key=lambda at: place[at])
        bodies[-head] = set(knot)
        for one in list(rest[last]):
            if one in knot:
                function.back[last, one] = -head
                rest[last].remove(one)
    order = _reverse_postorder(function.start, rest)
    function.place = {at: number for number, at in enumerate(order)}
    for head in [head for head in bodies if head < 0]:
        function.place[head] = min(function.place[at] for at in bodies[head])
    heads = sorted(bodies, key=lambda head: (-len(bodies[head]), function.place[head]))
    function.nest = {at: tuple(head for head in heads if at in bodies[head]) for at in order}


def _knots(order: list[int], after: dict[int, list[int]]) -> list[set[int]]:
    """Return what is still strongly connected when loops with one entry are cut (Tarjan, 1972, without recursion)."""
    number: dict[int, int] = {}
    low: dict[int, int] = {}
    stack: list[int] = []
    inside: set[int] = set()
    found: list[set[int]] = []
    for root in order:
        if root in number:
            continue
        todo = [(root, iter(after[root]))]
        number[root] = low[root] = len(number)
        stack.append(root)
        inside.add(root)
        while todo:
            node, rest = todo[-1]
            for one in rest:
                if one not in number:
                    number[one] = low[one] = len(number)
                    stack.append(one)
                    inside.add(one)
                    todo.append((one, iter(after[one])))
                    break
                if one in inside:
                    low[node] = min(low[node], number[one])
            else:
                todo.pop()
                if todo:
                    low[todo[-1][0]] = min(low[todo[-1][0]], low[node])
                if low[node] == number[node]:
                    cut = stack.index(node)
                    knot, stack[cut:] = set(stack[cut:]), []
                    inside -= knot
                    found += [knot] if len(knot) > 1 else []
    return found


def _last_of(knot: set[int], after: dict[int, list[int]], name: str) -> int:
    """Return an instruction of a knot that is on every way round."""
    for last in sorted(knot, reverse=True):
        inner = {at: [one for one in after[at] if one in knot and one != last] for at in knot if at != last}
        if not _knots(list(inner), inner):
            return last
    raise TargetError(f"{name} has loops with several entries: its rounds cannot be counted")


def _reverse_postorder(start: int, after: dict[int, list[int]]) -> list[int]:
    order, seen, todo = [], {start}, [(start, iter(after[start]))]
    while todo:
        node, rest = todo[-1]
        for one in rest:
            if one not in seen and one != END:
                seen.add(one)
                todo.append((one, iter(after[one])))
                break
        else:
            order.append(node)
            todo.pop()
    return order[::-1]


def _dominators(order: list[int], before: dict[int, list[int]], place: dict[int, int]) -> dict[int, int]:
    """Return of each instruction the nearest one that every way to it passes (Cooper, Harvey and Kennedy, 2001)."""
    above = {order[0]: order[0]}
    changed = True
    while changed:
        changed = False
        for node in order[1:]:
            best: int | None = None
            for one in before[node]:
                if one in above:
                    best = one if best is None else _common(one, best, above, place)
            if best is not None and above.get(node) != best:
                above[node] = best
                changed = True
    return above


def _common(a: int, b: int, above: dict[int, int], place: dict[int, int]) -> int:
    while a != b:
        while place[a] > place[b]:
            a = above[a]
        while place[b] > place[a]:
            b = above[b]
    return a


def _is_above(a: int, b: int, above: dict[int, int]) -> bool:
    while b != a and above[b] != b:
        b = above[b]
    return a == b


def _body(head: int, latch: int, before: dict[int, list[int]]) -> set[int]:
    found, todo = {latch}, [latch]
    while todo:
        at = todo.pop()
        if at != head:
            new = [one for one in before[at] if one not in found]
            found.update(new)
            todo += new
    return found


@functools.cache
def kind_of(name: str) -> str:
    """Return the mnemonic of an instruction on reals without its types."""
    return name.split(".")[0]


def is_shift(text: str, count: int, most: int) -> bool:
    """Tell whether the last of `most` arguments is the shift of the one before."""
    return count == most and text.split(" ")[0] in ("lsl", "lsr", "asr", "ror")


def names_three(given: tuple[str, ...]) -> bool:
    """Tell whether an instruction names a target and two operands."""
    return len(given) >= 3 and not is_shift(given[2], 3, 3)


def listed(text: str) -> list[int]:
    """Return the registers of `{r4, r5-r7, pc}`."""
    found: list[int] = []
    for part in text.strip("{}^").split(","):
        first, _, last = part.strip().partition("-")
        found += range(register(first), register(last or first) + 1)
    return found


def span_of(text: str) -> int:
    """Return how many registers d8-d12 are."""
    first, _, last = text.partition("-")
    return int((last or first)[1:]) - int(first[1:]) + 1
