# SPDX-License-Identifier: MIT-0
"""What compilers and their analysers say about the hand-written C: nothing, at several sizes, as C99 and as C++17."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from c_sources import CONFIGURATIONS, MATHS, RUNTIME, UNITS, WARNINGS, defines, run

LANGUAGES = {
    "gcc": ("-std=c99", "-Wmissing-prototypes", "-Wdouble-promotion"),
    "clang": ("-std=c99", "-Wmissing-prototypes", "-Wdouble-promotion"),
    "g++": ("-std=c++17", "-x", "c++"),
    "clang++": ("-std=c++17", "-x", "c++"),
}
SIZES = ((12, 3, 3, 8), (4, 3, 0, 1), (4, 3, 1, 2), (24, 6, 8, 64), (1, 1, 0, 1), (64, 6, 0, 1))


def _maths_unit(folder: Path) -> Path:
    unit = folder / "maths.c"
    unit.write_text("".join(f'#include "{path.name}"\n' for path in MATHS))
    return unit


def _all(commands: list[list[str]], jobs: int) -> int:
    with ThreadPoolExecutor(jobs) as pool:
        list(pool.map(run, commands))
    return len(commands)


def warnings(folder: Path, jobs: int = 2) -> str:
    """Compile everything at every size, in both precisions, by four compilers, with warnings as errors."""
    unit = _maths_unit(folder)
    commands = []
    for compiler, language in LANGUAGES.items():
        start = [compiler, *language, "-O2", "-ffp-contract=off", *WARNINGS, f"-I{RUNTIME}", "-fsyntax-only"]
        commands.append([*start, str(unit)])
        for size in SIZES:
            for real in ("double", "float"):
                commands.append([*start, *defines(*size, real), *map(str, UNITS)])
    for *size, real in CONFIGURATIONS:  # and with the optimiser, which sees values that are never set
        for compiler in ("gcc", "clang"):
            start = [compiler, *LANGUAGES[compiler], "-O2", "-ffp-contract=off", *WARNINGS, f"-I{RUNTIME}", "-c"]
            for unit in UNITS:
                made = folder / f"{compiler}_{real}_{unit.stem}.o"
                commands.append([*start, *defines(*size, real), str(unit), "-o", str(made)])
    return f"{_all(commands, jobs)} calls of a compiler without a warning"


def analyzer(folder: Path, jobs: int = 2) -> str:
    """Let gcc follow the paths through every function."""
    start = ["gcc", "-std=c99", "-O1", "-fanalyzer", "-Werror", f"-I{RUNTIME}", "-c"]
    commands = [[*start, str(_maths_unit(folder)), "-o", str(folder / "maths.o")]]
    for *size, real in CONFIGURATIONS:
        for unit in UNITS:
            made = folder / f"{unit.stem}_{real}.o"
            commands.append([*start, *defines(*size, real), str(unit), "-o", str(made)])
    return f"{_all(commands, jobs)} units without a finding"


def tidy(folder: Path, jobs: int = 2) -> str:
    """Apply the checks of `codegen/runtime/.clang-tidy`."""
    start = ["clang-tidy", "--quiet", f"--config-file={RUNTIME / '.clang-tidy'}"]
    commands = [[*start, str(_maths_unit(folder)), "--", "-std=c99", f"-I{RUNTIME}"]]
    for *size, real in CONFIGURATIONS:
        for unit in UNITS:
            commands.append([*start, str(unit), "--", "-std=c99", *defines(*size, real)])
    return f"{_all(commands, jobs)} units without a finding"
