# SPDX-License-Identifier: MIT-0
"""Run the fuzzers of the hand-written C under the address and undefined-behaviour sanitizers."""

from __future__ import annotations

import re
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from c_sources import RUNTIME, UNITS, GateError, defines, run

HERE = Path(__file__).resolve().parent
SANITIZED = ("-fsanitize=address,undefined,float-cast-overflow", "-fno-sanitize-recover=all", "-O2", "-g")
PLAIN, DAMAGE, FAILING = ("0", "0"), ("1", "0"), ("0", "1")
#: Sizes and number type, steps of a whole run and of a quick one, mode.
RUNS = (
    ((12, 3, 3, 8, "double"), 200_000, 1_500, PLAIN),
    ((12, 3, 3, 8, "double"), 50_000, 500, DAMAGE),
    ((12, 3, 3, 8, "double"), 50_000, 500, FAILING),
    ((12, 3, 3, 8, "float"), 50_000, 0, PLAIN),
    ((4, 3, 1, 2, "double"), 200_000, 0, PLAIN),
    ((4, 3, 1, 2, "double"), 100_000, 0, DAMAGE),
    ((4, 3, 1, 2, "double"), 50_000, 0, FAILING),
    ((4, 3, 0, 1, "float"), 150_000, 5_000, PLAIN),
    ((4, 3, 0, 1, "float"), 30_000, 2_000, DAMAGE),
    ((4, 3, 0, 1, "float"), 30_000, 2_000, FAILING),
    ((1, 1, 0, 1, "double"), 100_000, 0, PLAIN),
    ((24, 6, 8, 64, "double"), 1_000, 0, PLAIN),
)


def build(folder: Path, size: tuple, flags: tuple[str, ...], driver: str = "fuzz_allocator") -> Path:
    """Compile the allocator and what drives it for a size; return the program."""
    program = folder / (f"{driver}_" + "_".join(map(str, size)))
    hook = ["-include", str(HERE / "fuzz_assert.h")]
    options = ["-std=c99", "-ffp-contract=off", *flags, *defines(*size), f"-I{RUNTIME}", *hook]
    run(["gcc", *options, *map(str, UNITS), str(HERE / f"{driver}.c"), "-lm", "-o", str(program)])
    return program


def allocator(folder: Path, whole: bool, jobs: int = 2) -> str:
    """Fuzz the allocator; raise `GateError` with the step at which something did not hold."""
    runs = [(size, many if whole else few, mode) for size, many, few, mode in RUNS if whole or few]
    sizes = list(dict.fromkeys(size for size, *_ in runs))
    with ThreadPoolExecutor(jobs) as pool:
        programs = dict(zip(sizes, pool.map(lambda size: build(folder, size, SANITIZED), sizes), strict=True))

        def one(job: tuple) -> str:
            size, steps, mode = job
            return run([str(programs[size]), str(steps), "1", *mode])

        reports = list(pool.map(one, runs))
    totals = [
        sum(int(n) for n in column) for column in zip(*(re.findall(r"\d+", text) for text in reports), strict=True)
    ]
    steps, optimal, rounding, open_, command, problem, checked, failed = totals
    if not all(totals):
        raise GateError(f"the fuzzer did not reach everything: {reports}")
    return (
        f"{steps:,} steps under ASan and UBSan: optimal {optimal}, at rounding {rounding}, not certified {open_}, "
        f"bad command {command}, bad problem {problem}; {checked} certificates checked, {failed} assertions failed"
    )


def chosen(folder: Path, size: tuple = (12, 3, 3, 8, "double")) -> str:
    """Run the chosen cases; raise `GateError` with those that fail."""
    return run([str(build(folder, size, SANITIZED, "unit_allocator"))]).strip()


def maths(folder: Path, whole: bool) -> str:
    """Fuzz the elementary functions; raise `GateError` with the argument at which something did not hold."""
    program = folder / "fuzz_maths"
    options = ["-std=c99", "-ffp-contract=off", *SANITIZED, f"-I{RUNTIME}"]
    run(["gcc", *options, str(HERE / "fuzz_maths.c"), "-lm", "-o", str(program)])
    return run([str(program), "1000000" if whole else "20000"]).strip()
