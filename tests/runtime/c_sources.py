# SPDX-License-Identifier: MIT-0
"""The hand-written C of `codegen/runtime`: files, sizes it is checked at, functions, written deviations.

The functions are found by the house style (a function begins in the first column and its last brace stands there),
which the compiler gate would not notice to be broken but every count below would.
"""

from __future__ import annotations

import re
import subprocess
import tomllib
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
RUNTIME = ROOT / "codegen" / "runtime"
UNITS = tuple(sorted(RUNTIME.glob("gnc_allocate*.c")))
MATHS = (RUNTIME / "gnc_math.h", RUNTIME / "gnc_mathf.h", RUNTIME / "gnc_arithmetic.h")
ALLOCATOR = (RUNTIME / "gnc_allocate.h", RUNTIME / "gnc_allocate_internal.h", *UNITS)
FILES = (*MATHS, *ALLOCATOR)
#: Sizes N, R, P, V and the number type that together pass through every #if.
CONFIGURATIONS = ((12, 3, 3, 8, "double"), (4, 3, 0, 1, "float"))
WARNINGS = ("-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-pedantic", "-Wvla", "-Werror")


class GateError(Exception):
    """What a gate found."""


def defines(n: int, r: int, p: int, v: int, real: str = "double") -> list[str]:
    sizes = [f"-DGNC_ALLOC_{name}={size}" for name, size in zip("NRPV", (n, r, p, v), strict=True)]
    return [*sizes, "-DGNC_ALLOC_PREFIX=gnc_alloc", *(["-DGNC_ALLOC_REAL_FLOAT"] if real == "float" else [])]


def run(command: list[str], **options) -> str:
    """Run a command and return what it printed; raise `GateError` with that where it fails."""
    done = subprocess.run(command, capture_output=True, text=True, **options)
    if done.returncode:
        text = "\n".join((done.stdout + done.stderr).splitlines()[:40])
        raise GateError(f"{' '.join(command[:4])} ... ended with {done.returncode}:\n{text}")
    return done.stdout + done.stderr


@dataclass(frozen=True)
class Function:
    """A function of a file: lines from its head to its last brace, and its text without comments and strings."""

    file: str
    name: str
    first: int
    last: int
    text: str

    @property
    def lines(self) -> int:
        return self.last - self.first + 1


def blanked(text: str) -> str:
    """Return C text with comments and strings overwritten by blanks, so that lines keep their numbers."""

    def blank(found: re.Match) -> str:
        return re.sub(r"[^\n]", " ", found.group())

    return re.sub(r'/\*.*?\*/|//[^\n]*|"(?:\\.|[^"\\\n])*"', blank, text, flags=re.DOTALL)


def functions(path: Path) -> list[Function]:
    """Return the functions that a file defines."""
    lines = blanked(path.read_text()).splitlines()
    found, first = [], None
    for number, line in enumerate(lines, 1):
        if first is None and re.match(r"[A-Za-z_].*\(", line) and not line.startswith(("typedef", "extern")):
            first = number
        if first is None:
            continue
        if "{" not in "".join(lines[first - 1 : number]) and line.rstrip().endswith(";"):
            first = None  # a declaration
        elif line.startswith("}") or (number == first and line.rstrip().endswith("}")):
            text = "\n".join(lines[first - 1 : number])
            head = re.sub(r"\bNAME\((\w+)\)", r"\1", text[: text.index("{")])
            found.append(Function(path.name, re.search(r"(\w+)\s*\(", head).group(1), first, number, text))
            first = None
    return found


def function_at(path: Path, line: int) -> str:
    """Return the name of the function around a line, or an empty string."""
    return next((f.name for f in functions(path) if f.first <= line <= f.last), "")


# ---- Written deviations -------------------------------------------------------------------------------------


@dataclass(frozen=True, order=True)
class Finding:
    """A rule broken in a file, in one of its functions or outside all of them ('')."""

    rule: str
    file: str
    function: str
    line: int
    text: str = ""


def judge(tool: str, findings: list[Finding]) -> str:
    """Compare findings with the deviations written for a tool; raise `GateError` for what is only in one of them.

    A place in the list is a file, or `file: function`. Return how many findings are covered by how many entries.
    """
    rows = tomllib.loads((RUNTIME / "deviations.toml").read_text(encoding="utf-8"))["deviation"]
    places = {(row["rule"], place) for row in rows if row["tool"] == tool for place in row["where"]}
    assert all(row["why"].strip() for row in rows), "a deviation without a reason"
    met, new = set(), []
    for finding in sorted(findings):
        here = {(finding.rule, finding.file), (finding.rule, f"{finding.file}: {finding.function}")} & places
        met |= here
        if not here:
            where = f"{finding.file}:{finding.line} {finding.function}"
            new.append(f"{tool} {finding.rule}: {where}: {finding.text} is not in codegen/runtime/deviations.toml")
    stale = [f"{tool} {rule}: {place} is a deviation that no longer occurs" for rule, place in sorted(places - met)]
    if new or stale:
        raise GateError("\n".join(new + stale))
    return f"{len(findings)} findings, all under {len(places)} written places"
