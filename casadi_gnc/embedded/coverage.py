"""Which branches of a package's C its vectors take: each decision counted while they are replayed.

A decision is the condition of an `if`, a `while` or a choice `? :`. Its text is put into a call that counts how often
it was true and how often false; nothing else of the unit is changed, so its words are the same and so, on every
machine and by every compiler, are the counts.
"""

from __future__ import annotations

import re
from bisect import bisect_left
from dataclasses import dataclass, field

import numpy as np

from casadi_gnc.embedded import package
from casadi_gnc.embedded.host import HostPackage
from casadi_gnc.embedded.targets import units
from casadi_gnc.system import compilers
from casadi_gnc.system.templates import template

COVERAGE = "COVERAGE.md"
_TOKEN = re.compile(
    r"""(?P<comment>/\*.*?\*/|//[^\n]*)|(?P<line>^[ \t]*\#(?:\\\n|[^\n])*)|(?P<text>"(?:\\.|[^"\\])*"|'(?:\\.|[^'\\])*')
    |(?P<word>\w+)|(?P<sign><<=|>>=|[-+*/%&|^=!<>]=|&&|\|\||<<|>>|->|\+\+|--|[^\w\s])""",
    re.DOTALL | re.MULTILINE | re.VERBOSE,
)
_ASSIGNING = frozenset(["=", "+=", "-=", "*=", "/=", "%=", "&=", "|=", "^=", "<<=", ">>="])
#: A condition of nothing but constants and macros is decided by the compiler.
_CONSTANT = re.compile(r"(?:\b[A-Z][A-Z0-9_]*\b|\b\d\w*\b|\b0x\w+\b|[^\w])*")
#: Most characters of a decision and of a place that are shown.
_TEXT, _PLACE = 60, 90


@dataclass(frozen=True)
class Decision:
    """Say where a decision lies: its line, its text, the function and block it is in."""

    line: int
    text: str
    place: str


@dataclass
class Unit:
    """Hold what was read of a unit.

    Parameters
    ----------
    decisions : in the order in which they end.
    cuts : where the condition of each lies in the text.
    there : the conditional lines, and between them the decisions by number from 1 on: which of them are compiled.
    """

    decisions: list[Decision] = field(default_factory=list)
    cuts: list[tuple[int, int]] = field(default_factory=list)
    there: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class Coverage:
    """Hold of each unit the decisions that are compiled, with how often each was false and true."""

    name: str
    samples: int
    units: dict[str, list[tuple[Decision, int, int]]]

    @property
    def summary(self) -> dict[str, int]:
        """Decisions, and those of them that went both ways."""
        rows = [row for found in self.units.values() for row in found]
        return {"decisions": len(rows), "both_ways": sum(bool(no and yes) for _, no, yes in rows)}

    def to_text(self) -> str:
        """Return what the package says of them: those that did not go both ways, by unit."""
        tables = []
        for unit, found in self.units.items():
            rows = [
                {"line": one.line, "text": _cell(one.text, _TEXT), "place": _cell(one.place, _PLACE), "never": never}
                for one, no, yes in found
                if (never := "" if no and yes else "false" if yes else "true" if no else "reached")
            ]
            tables.append({"unit": unit, "decisions": len(found), "rows": rows})
        return template("coverage.md.j2").render(name=self.name, samples=self.samples, tables=tables, **self.summary)


def _cell(text: str, most: int) -> str:
    """Return a text as it stands in a table."""
    return (text if len(text) <= most else f"{text[: most - 3]}...").replace("|", "\\|")


def coverage(files: dict[str, str], name: str, inputs: np.ndarray, outputs: int) -> Coverage:
    """Return which branches the vectors of a package take.

    Parameters
    ----------
    files : of the package with those that replay it: path -> text.
    name : its prefix.
    inputs : words of the vectors, (K, inputs), replayed from `init` on.
    outputs : words of an output.

    Raises
    ------
    NoCompilerError, CompilerError
        Where there is no compiler, or it refuses the package.
    """
    with compilers.workshop() as shop:
        package.put(shop, files)
        own = [path.name for path in units(shop, name)]
        found = {unit: read_unit(files[unit]) for unit in own}
        package.put(shop, {unit: counting(files[unit], found[unit], i) for i, unit in enumerate(own)})
        host = HostPackage(shop, name, flags=("-O0",))
        host.replay(inputs, outputs)
        seen = {unit: _seen(host, found[unit], i) for i, unit in enumerate(own)}
    return Coverage(name, len(inputs), seen)


def _seen(host: HostPackage, unit: Unit, number: int) -> list[tuple[Decision, int, int]]:
    """Return the decisions of a unit that are compiled, with their counts."""
    size = len(unit.decisions)
    there = host.counts(f"gnc_there_{number}", size)
    counts = host.counts(f"gnc_seen_{number}", 2 * size)
    return [(unit.decisions[k - 1], counts[2 * k - 2], counts[2 * k - 1]) for k in there if k]


def counting(text: str, unit: Unit, number: int) -> str:
    """Return a unit that counts how often each of its decisions is false and true."""
    size = max(len(unit.decisions), 1)
    lead = (
        f"unsigned long long gnc_seen_{number}[{size}][2];\n"
        f"static int gnc_saw(int at, int is) {{ ++gnc_seen_{number}[at][is]; return is; }}\n#line 1\n"
    )
    # At one place the later decision, which holds the earlier one, opens first.
    put = [(start, -k, f"gnc_saw({k}, (") for k, (start, _) in enumerate(unit.cuts)]
    put += [(end, k, ") ? 1 : 0)") for k, (_, end) in enumerate(unit.cuts)]
    pieces, last = [lead], 0
    for place, _, added in sorted(put):
        pieces += [text[last:place], added]
        last = place
    there = "\n".join([f"\nconst unsigned long long gnc_there_{number}[{size + 1}] = {{", *unit.there, "0 };\n"])
    return "".join([*pieces, text[last:], there])


def read_unit(text: str) -> Unit:
    """Return the decisions of a unit of C."""
    reader = _Reader(text)
    for match in _TOKEN.finditer(text):
        reader.take(match.lastgroup or "", match.start(), match.end())
    return reader.unit


@dataclass
class _Bracket:
    """Hold an open bracket: its end, whether a decision is in it, and where the expression that is read began."""

    opened: int
    decides: bool
    start: int


class _Reader:
    """Read a unit token by token; an expression begins after what the condition of a choice cannot hold."""

    def __init__(self, text: str) -> None:
        self.unit = Unit()
        self._text, self._brackets, self._depth = text, [_Bracket(0, False, 0)], 0
        self._last, self._function, self._block, self._is_made = "", "", "", False
        self._ends = [match.start() for match in re.finditer("\n", text)]

    def take(self, kind: str, start: int, end: int) -> None:
        """Take a token."""
        token = self._text[start:end]
        if kind == "comment":
            self._comment(token, start)
        elif kind == "line":
            if re.match(r"\s*#\s*(if|el|endif)", token):
                self.unit.there.append(token.strip())
        else:
            if self._depth == 0:
                self._outside(token, kind)
            self._sign(token, start, end)
            self._last = token

    def _comment(self, token: str, start: int) -> None:
        """Take a comment: one that has its line for itself inside a function names a block."""
        if self._depth and not self._text[self._text.rfind("\n", 0, start) + 1 : start].strip():
            self._block = " ".join(token.strip("/*").split())

    def _outside(self, token: str, kind: str) -> None:
        """Take a token outside of functions: the last word before arguments is a name, or a macro makes one of it."""
        if token == "(" and len(self._brackets) == 1 and re.fullmatch(r"\w+", self._last):
            self._function, self._block, self._is_made = self._last, "", self._last == "NAME"
        elif self._is_made and kind == "word":
            self._function, self._is_made = token, False

    def _sign(self, token: str, start: int, end: int) -> None:
        top = self._brackets[-1]
        if token in ("(", "[", "{"):
            self._depth += token == "{"
            self._brackets.append(_Bracket(end, token == "(" and self._last in ("if", "while"), end))
        elif token in (")", "]", "}"):
            if top.decides:
                self._decision(top.opened, start)
            self._brackets.pop()
            if token == "}":
                self._depth -= 1
                self._brackets[-1].start = end
        elif token == "?":
            self._decision(top.start, start)
            top.start = end
        elif token in (",", ";", ":", "return", "else") or token in _ASSIGNING:
            top.start = end

    def _decision(self, start: int, end: int) -> None:
        start += len(self._text[start:end]) - len(self._text[start:end].lstrip())
        said = " ".join(re.sub(r"/\*.*?\*/", " ", self._text[start:end], flags=re.DOTALL).split())
        if _CONSTANT.fullmatch(said):
            return
        place = f"{self._function}: {self._block}" if self._block else self._function
        self.unit.decisions.append(Decision(bisect_left(self._ends, start) + 1, said, place))
        self.unit.cuts.append((start, end))
        self.unit.there.append(f"{len(self.unit.decisions)},")
