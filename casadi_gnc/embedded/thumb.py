"""Machine code of Cortex-M from a disassembly: instructions and functions."""

from __future__ import annotations

import functools
import re
from dataclasses import dataclass, field

CONDITIONS = ("eq", "ne", "cs", "cc", "mi", "pl", "vs", "vc", "hi", "ls", "ge", "lt", "gt", "le")
_OPPOSITE = ("ne", "eq", "cc", "cs", "pl", "mi", "vc", "vs", "ls", "hi", "lt", "ge", "le", "gt")
OPPOSITE: dict[str, str] = dict(zip(CONDITIONS, _OPPOSITE, strict=True))
_LINE = re.compile(r"^\s*([0-9a-f]+):\t(\S+)(?:\t(.*))?$")
_HEAD = re.compile(r"^([0-9a-f]+) <([^>]+)>:$")
#: Mnemonics that set flags where an s is behind them.
_SETTING = {"mov", "mvn", "add", "sub", "rsb", "mul", "and", "orr", "orn",
            "eor", "bic", "lsl", "lsr", "asr", "adc", "sbc"}  # fmt: skip
_NAMES = {"ip": 12, "sp": 13, "lr": 14, "pc": 15, "sl": 10, "fp": 11, "sb": 9}


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
