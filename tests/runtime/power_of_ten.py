# SPDX-License-Identifier: MIT-0
"""The ten rules for safety-critical code (Holzmann, IEEE Computer 39(6), 2006) as checks of the hand-written C.

Rule 5 in the form in which it flew to Mars: an assertion in every function of more than ten lines (JPL coding standard
D-60411, rule 16), and in two lines of a hundred (Holzmann, Communications of the ACM 57(2), 2014). Rules 6, 7 and 10
are left to the compilers, cppcheck and clang-tidy.
"""

from __future__ import annotations

import re

from c_sources import FILES, MATHS, UNITS, Finding, Function, functions, judge

MOST_LINES = 60
SHORT = 10  # lines of a function that needs no assertion
DENSITY = 0.02  # assertions a line of code of the allocator
CONSTANT = r"(?:N|R|P|P1|V|K|KT|PT|A|MAX_\w+|\d+[uU]?)"
ARITHMETIC = re.compile(rf"^[\s()]*{CONSTANT}(?:[\s()]*[-+*][\s()]*{CONSTANT})*[\s()]*$")


def after_parenthesis(text: str, start: int) -> int:
    """Return the place after the parenthesis that closes the one at `start`."""
    depth = 0
    for place in range(start, len(text)):
        depth += {"(": 1, ")": -1}.get(text[place], 0)
        if depth == 0:
            return place + 1
    raise ValueError("a parenthesis without its partner")


def body_of(text: str, start: int) -> str:
    """Return the statement in braces that begins at or after `start`."""
    begin = text.index("{", start)
    depth = 0
    for place in range(begin, len(text)):
        depth += {"{": 1, "}": -1}.get(text[place], 0)
        if depth == 0:
            return text[begin : place + 1]
    raise ValueError("a brace without its partner")


def asserted_bounds(text: str) -> set[str]:
    """Names that some assertion of the function holds below a constant."""
    found = set()
    for match in re.finditer(r"GNC_ASSERT\(", text):
        condition = text[match.end() : after_parenthesis(text, match.end() - 1) - 1]
        for part in condition.split("&&"):
            within = re.fullmatch(r"\s*is_within\((\w+), [^,]+, (.+)\)\s*", part)
            bound = within or re.fullmatch(r"\s*(\w+)\s*<=?\s*(.+)", part)
            if bound and (ARITHMETIC.match(bound.group(2)) or "sizeof" in bound.group(2)):
                found.add(bound.group(1))
    return found


def is_bounded(loop: str, body: str, known: set[str]) -> tuple[bool, str]:
    """Tell whether a `for` counts one variable to a bound that is known, and name that variable."""
    start, condition, step = loop.split(";")
    begin = re.fullmatch(r"\s*(?:\w+\s+)?(\w+)\s*=\s*(.+)", start)
    if begin is None:
        return False, ""
    name = begin.group(1)

    def is_known(expression: str) -> bool:
        words = set(re.findall(r"[A-Za-z_]\w*", expression))
        rest = {word for word in words if not re.fullmatch(CONSTANT, word)}
        return rest <= known and "[" not in expression and "->" not in expression

    up = re.fullmatch(rf"\s*(?:\+\+{name}|{name}\s*\+=\s*\d+)\s*", step)
    down = re.fullmatch(rf"\s*--{name}\s*", step)
    good = False
    for part in condition.split("&&"):
        limit = re.fullmatch(rf"\s*{name}(?:\s*\+\s*\d+)?\s*(<=?|>=?)\s*(.+?)\s*", part)
        if limit and is_known(limit.group(2)):
            good |= bool(up and limit.group(1)[0] == "<")
            good |= bool(down and limit.group(1)[0] == ">" and is_known(begin.group(2)))
    changed = re.search(rf"(?:\+\+|--){name}\b|\b{name}\s*(?:[-+*/|&^]?=(?!=)|\+\+|--)", body)
    return good and not changed, name


def loops(function: Function) -> list[str]:
    """Return the loops of a function that are not bounded by a constant."""
    text, bad = function.text, []
    known = asserted_bounds(text)
    for match in re.finditer(r"\bfor \(", text):
        end = after_parenthesis(text, match.end() - 1)
        head = text[match.end() : end - 1]
        outer = {name for name, begin, stop in spans(text) if begin < match.start() < stop}
        bounded, _ = is_bounded(head, body_of(text, end), known | outer)
        if not bounded:
            bad.append(f"for ({head})")
    return bad


def spans(text: str) -> list[tuple[str, int, int]]:
    """Return the loop variables of a function with the places between which each runs."""
    found = []
    for match in re.finditer(r"\bfor \((?:\w+ )?(\w+) =", text):
        end = after_parenthesis(text, text.index("(", match.start()))
        found.append((match.group(1), end, end + len(body_of(text, end))))
    return found


def calls(function: Function, names: set[str]) -> set[str]:
    text = re.sub(r"\bNAME\((\w+)\)", r"\1", function.text[function.text.index("{") :])
    return set(re.findall(r"\b(\w+)\s*\(", text)) & names


def recursive(every: list[Function]) -> list[Function]:
    """Return the functions from which a chain of calls leads back to themselves."""
    graph: dict[str, set[str]] = {}
    names = {f.name for f in every}
    for f in every:
        graph[f.name] = graph.get(f.name, set()) | calls(f, names)
    reach = {name: set(below) for name, below in graph.items()}
    for _ in graph:
        reach = {name: below | {far for near in below for far in reach[near]} for name, below in reach.items()}
    return [f for f in every if f.name in reach[f.name]]


def check() -> tuple[list[Finding], dict[str, float]]:
    """Return what breaks a rule, and the counts that the report names."""
    every = [f for path in FILES for f in functions(path)]
    found = [Finding("1", f.file, f.name, f.first, "recursion") for f in recursive(every)]

    def note(rule: str, f: Function, text: str) -> None:
        found.append(Finding(rule, f.file, f.name, f.first, text))

    maths = {path.name for path in MATHS}
    long, assertions = 0, 0
    for f in every:
        if re.search(r"\b(goto|setjmp|longjmp)\b", f.text):
            note("1", f, "a jump")
        if re.search(r"\b(while|do)\b", f.text):
            note("2", f, "a loop that does not count")
        for loop in loops(f):
            note("2", f, f"no constant bound: {loop}")
        if re.search(r"\b(malloc|calloc|realloc|free|alloca)\b", f.text):
            note("3", f, "heap")
        if f.lines > MOST_LINES:
            note("4", f, f"{f.lines} lines")
        count = len(re.findall(r"\bGNC_ASSERT\(", f.text))
        assertions += count
        if f.lines > SHORT and f.file not in maths:
            long += 1
            if count == 0:
                note("5", f, f"{f.lines} lines without an assertion")
        if re.search(r"\(\s*\*\s*\w+\s*\)\s*\(", f.text):
            note("9", f, "a function pointer")
        if re.search(r"\*\s*\*\s*\w+\s*[,)=;]|->\w+(?:\[[^]]*\])*->", f.text):
            note("9", f, "two levels of pointers")
    for path in FILES:
        for number, line in enumerate(path.read_text().splitlines(), 1):
            if re.match(r"\s*#\s*define\b.*(##|\.\.\.|__VA_ARGS__)", line):
                found.append(Finding("8", path.name, "", number, "a macro that pastes or varies"))
    code = [line for f in every if f.file not in maths for line in f.text.splitlines() if line.strip()]
    density = assertions / len(code)
    if density < DENSITY:
        found.append(Finding("5", UNITS[0].name, "", 1, f"assertions in {100 * density:.1f} % of the lines"))
    counts = {"functions": len(every), "longest": max(f.lines for f in every), "long": long, "assertions": assertions}
    return found, counts | {"loops": sum(len(re.findall(r"\bfor \(", f.text)) for f in every), "density": density}


def gate() -> str:
    """Raise `GateError` where a rule is broken without a written deviation."""
    found, counts = check()
    text = judge("power of ten", found)
    return (
        f"{counts['functions']} functions, the longest {counts['longest']:.0f} lines; {counts['loops']} loops; "
        f"{counts['assertions']} assertions, {100 * counts['density']:.1f} % of the allocator's lines; {text}"
    )
