"""Instructions of one controller step on the boards of `codegen/targets`, counted in their emulators.

Counts are exact and the same on every host, so they stand beside the times and not among them.
"""

from __future__ import annotations

from typing import Any

from casadi_gnc.benchmarks.contest import Family
from casadi_gnc.delivery import packaging
from casadi_gnc.embedded import boards as known_boards
from casadi_gnc.embedded import targets
from casadi_gnc.errors import GncError
from casadi_gnc.system.folders import workshop

#: Samples replayed; the fewest that a package takes are some more than those with bad measurements.
STEPS = packaging.SPOILED + 40
_REALS = ("float64", "float32")


def table(families: list[Family]) -> str:
    """Return the counts as a table in Markdown, or a sentence that says what is missing."""
    boards = [known_boards.find(name) for name in known_boards.names()]
    ready = [board for board in boards if not board.missing()]
    lacking = [f"{board.name} needs {' and '.join(board.missing())}" for board in boards if board.missing()]
    lines = ["## Instructions on targets", ""]
    if ready:
        lines += [
            "| step | target | numbers | instructions, median | worst | code [bytes] | stack [bytes] |",
            "| --- | --- | --- | ---: | ---: | ---: | ---: |",
        ]
    for family in families if ready else []:
        for real in _REALS:
            lines += [_line(family.name, real, one) for one in _counts(family, real, ready)]
    if lacking:
        lines += ["", f"Not counted: {'; '.join(lacking)} (`make targets` installs them)."]
    return "\n".join(lines) + "\n"


def _counts(family: Family, real: str, boards: list[known_boards.Target]) -> list[dict[str, Any]]:
    found = []
    with workshop() as shop:
        folder, given = shop / "package", family.data
        try:
            packaging.generate(given.problem, folder, scheme=given.scheme, name="step", real=real, steps=STEPS)
        except GncError as error:
            return [{"target": "-", "failed": str(error)}]
        for board in boards:
            try:
                measured = targets.measure(folder, "step", board, float_only=real == "float32").summary()
                found.append({"target": board.name, **measured})
            except GncError as error:
                found.append({"target": board.name, "failed": str(error)})
    return found


def _line(name: str, real: str, one: dict[str, Any]) -> str:
    if "failed" in one:
        return f"| {name} | {one['target']} | {real} | {one['failed']} | | | |"
    numbers = [one[key] for key in ("instructions_median", "instructions_worst", "text_bytes", "stack_step_bytes")]
    return f"| {name} | {one['target']} | {real} | " + " | ".join(map(str, numbers)) + " |"
