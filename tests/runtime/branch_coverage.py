# SPDX-License-Identifier: MIT-0
"""Measure by gcov which branches of the hand-written C the tests here take: all of them, but for those listed.

The fuzzers run without optimisation at several sizes. A branch counts as taken if any size takes it. Where the sizes
leave a line with different branches (a constant folds away), one size must take all of its own.
The exceptions are in `codegen/runtime/deviations.toml`, as file and function, like every other deviation.
"""

from __future__ import annotations

import gzip
import json
from collections import defaultdict
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from c_sources import FILES, RUNTIME, Finding, function_at, judge, run
from fuzzing import DAMAGE, FAILING, HERE, PLAIN, build

FLAGS = ("-O0", "--coverage", "-fprofile-abs-path")
#: Sizes and number type, and the steps of the fuzzer in each mode.
RUNS = (
    ((12, 3, 3, 8, "double"), ((6_000, PLAIN), (4_000, DAMAGE), (20_000, FAILING))),
    ((4, 3, 0, 1, "float"), ((20_000, PLAIN), (20_000, DAMAGE), (20_000, FAILING))),
    ((4, 3, 1, 2, "double"), ((40_000, PLAIN), (40_000, DAMAGE), (40_000, FAILING))),
    ((3, 1, 1, 8, "double"), ((10_000, PLAIN),)),  # more vertices than can be independent
)


def allocator_runs(folder: Path, jobs: int) -> None:
    def one(job: tuple) -> None:
        size, runs = job
        for driver, calls in (
            ("fuzz_allocator", [[str(steps), "2", *mode] for steps, mode in runs]),
            ("unit_allocator", [[]]),
        ):
            place = folder / "_".join(map(str, (driver, *size)))
            place.mkdir()
            program = build(place, size, FLAGS, driver)
            for arguments in calls:
                run([str(program), *arguments], cwd=place)

    with ThreadPoolExecutor(jobs) as pool:
        list(pool.map(one, RUNS))


def maths_run(folder: Path) -> None:
    place = folder / "maths"
    place.mkdir()
    options = ["-std=c99", "-ffp-contract=off", *FLAGS, f"-I{RUNTIME}"]
    program = place / "fuzz_maths"
    run(["gcc", *options, str(HERE / "fuzz_maths.c"), "-lm", "-o", str(program)])
    run([str(program), "20000"], cwd=place)


def read(folder: Path) -> dict[tuple[str, int], list[list[bool]]]:
    """Return for every line with branches, and every line at all, what each build took of it."""
    found: dict[tuple[str, int], list[list[bool]]] = defaultdict(list)
    wanted = {str(path): path.name for path in FILES}
    for place in sorted(path for path in folder.iterdir() if path.is_dir()):
        notes = sorted(place.glob("*.gcda"))
        run(["gcov", "--json-format", "--branch-probabilities", *map(str, notes)], cwd=place)
        for report in place.glob("*.gcov.json.gz"):
            with gzip.open(report, "rt") as file:
                data = json.load(file)
            lines: dict[tuple[str, int], list[list[bool]]] = defaultdict(list)
            for source in data["files"]:
                name = wanted.get(source["file"])
                for line in source["lines"] if name else ():
                    branches = [branch["count"] > 0 for branch in line["branches"]]
                    lines[name, line["line_number"]].append([line["count"] > 0, *branches])
            for key, several in lines.items():
                found[key] += several
    return found


def missing(taken: list[list[bool]]) -> int:
    """Return how many branches of a line (or the line itself, 1) no build took."""
    shapes: dict[int, list[bool]] = {}
    for branches in taken:
        before = shapes.get(len(branches), [False] * len(branches))
        shapes[len(branches)] = [a or b for a, b in zip(before, branches, strict=True)]
    # A build whose constants fold a line away leaves fewer branches: the richest shape must be complete.
    return min(shape.count(False) for size, shape in shapes.items() if size == max(shapes))


def gate(folder: Path, jobs: int = 2) -> str:
    """Raise `GateError` where a branch is not taken without a written reason."""
    allocator_runs(folder, jobs)
    maths_run(folder)
    found, lines, branches = [], 0, 0
    texts = {path.name: path.read_text().splitlines() for path in FILES}
    for (name, number), taken in sorted(read(folder).items()):
        lines += 1
        branches += max(len(one) for one in taken) - 1
        lost = missing(taken)
        if lost:
            text = texts[name][number - 1].strip()
            found.append(Finding("branch", name, function_at(RUNTIME / name, number), number, f"{lost} of `{text}`"))
    text = judge("coverage", found)
    return f"{lines} lines, {branches} branches; not taken: {text}"
