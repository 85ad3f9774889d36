# SPDX-License-Identifier: MIT-0
"""The elementary functions of `codegen/runtime` under test: their names and their builds.

Shared by `tests/embedded/test_gnc_math*.py` and `tests/bench/math_accuracy.py`; arguments and truth: `math_truth.py`.
"""

from __future__ import annotations

import ctypes
import functools
import re
import shutil
import subprocess
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np

RUNTIME = Path(__file__).resolve().parents[2] / "codegen" / "runtime"
HEADERS = {"double": RUNTIME / "gnc_math.h", "float": RUNTIME / "gnc_mathf.h"}

# fmt: off
ONE_ARGUMENT = [
    "exp", "expm1", "log", "log1p", "sin", "cos", "tan", "sinh", "cosh", "tanh", "asin", "acos", "atan",
    "erf", "sqrt", "fabs", "floor", "ceil", "sign",
]
# fmt: on
TWO_ARGUMENTS = ["atan2", "pow", "fmod", "remainder", "copysign", "min", "max"]
EXACT = {"sqrt", "fabs", "floor", "ceil", "sign", "fmod", "remainder", "copysign", "min", "max"}
KEEP_NAN = {"fabs", "floor", "ceil", "sign", "copysign", "min", "max"}
FUNCTIONS = [*ONE_ARGUMENT, *TWO_ARGUMENTS]

WARNINGS = ["-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-pedantic", "-Werror"]
SAME_BITS = ["-std=c99", "-ffp-contract=off"]
LANES = [
    "-fno-math-errno",
    "-fno-trapping-math",
    "-fopenmp-simd",
    "-DLANES",
    "-DGNC_LANES=1",
    "-DGNC_INLINE=static inline __attribute__((always_inline))",
]


# ---- Building -----------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Precision:
    name: str
    suffix: str
    dtype: type
    bits: type
    digits: int  # of the significand
    smallest_exponent: int  # of a subnormal number, as a power of two

    @property
    def nan_bits(self) -> int:
        return 0x7FF8000000000000 if self.name == "double" else 0x7FC00000


DOUBLE = Precision("double", "", np.float64, np.uint64, 53, -1074)
FLOAT = Precision("float", "f", np.float32, np.uint32, 24, -149)
PRECISIONS = [DOUBLE, FLOAT]
by_name = {"ids": lambda p: p.name}


def loops_source() -> str:
    """Write one C loop a function and precision, each on a line of its own; LANES makes them SIMD loops."""
    lines = [
        '#include "gnc_math.h"',
        "#ifdef LANES",
        '#define LOOP _Pragma("omp simd")',
        "#else",
        "#define LOOP",
        "#endif",
    ]
    for p in PRECISIONS:
        for name in FUNCTIONS:
            arguments = "a[i]" if name in ONE_ARGUMENT else "a[i], b[i]"
            f, t = f"gnc_{name}{p.suffix}", p.name
            signature = f"void loop_{f}(long n, const {t} *restrict a, const {t} *restrict b, {t} *restrict out)"
            lines.append(f"{signature};")
            lines.append(f"{signature} {{ (void)b; LOOP for (long i = 0; i < n; i++) out[i] = {f}({arguments}); }}")
    return "\n".join(lines) + "\n"


def compiler(name: str) -> str:
    """Return the path of a compiler."""
    path = shutil.which(name)
    assert path is not None, f"{name} is not on the PATH"
    return path


@functools.cache
def cpu_flags() -> frozenset[str]:
    try:
        found = re.search(r"^flags\s*:(.*)$", Path("/proc/cpuinfo").read_text(), re.MULTILINE)
    except OSError:
        return frozenset()
    return frozenset(found.group(1).split()) if found else frozenset()


def builds_of(name: str) -> dict[str, tuple[str, ...]]:
    """List the builds to compare: label to flags. Instruction sets that this processor lacks are left out."""
    lanes = ("-O3", *LANES)
    builds = {f"{name}-O{level}": (f"-O{level}",) for level in range(4)} | {f"{name}-lanes": lanes}
    builds |= {f"{name}-native": ("-O3", "-march=native"), f"{name}-lanes-native": (*lanes, "-march=native")}
    for label, flags in (
        ("O3-avx2", ("-O3", "-mavx2")),
        ("lanes-avx2-fma", (*lanes, "-mavx2", "-mfma")),
        ("lanes-avx512f", (*lanes, "-mavx512f")),
    ):
        if {flag.removeprefix("-m") for flag in flags if flag.startswith("-m")} <= cpu_flags():
            builds[f"{name}-{label}"] = flags
    return builds


@functools.cache
def is_gnu(path: str) -> bool:
    """Tell GNU gcc from a clang that is installed under its name."""
    version = subprocess.run([path, "--version"], capture_output=True, text=True, check=True).stdout
    return "Free Software Foundation" in version


def zig() -> str | None:
    """Return the compiler of the ziglang wheel as one word for a command, where the wheel is installed."""
    try:
        import ziglang
    except ImportError:
        return None
    return str(Path(ziglang.__file__).parent / "zig")


def command(name: str) -> list[str]:
    """Return the start of a compiler's command line."""
    if name == "zig":
        path = zig()
        assert path is not None, "the wheel ziglang is not installed"
        return [path, "cc"]
    return [compiler(name)]


def build_all(folder: Path, name: str) -> dict[str, Path]:
    """Compile every build of a compiler, two at a time; return label to library."""
    source = folder / "loops.c"
    source.write_text(loops_source())
    jobs = {}
    start = command(name)
    for label, flags in builds_of(name).items():
        library = folder / f"{label}.so"
        with_report = name == "gcc" and is_gnu(start[0]) and "-DLANES" in flags
        report = [f"-fopt-info-vec={library.with_suffix('.txt')}"] if with_report else []
        build = [*start, *SAME_BITS, *flags, *report, f"-I{RUNTIME}", "-fPIC", "-shared"]
        jobs[label] = (library, [*build, str(source), "-o", str(library), "-lm"])
    with ThreadPoolExecutor(2) as pool:
        done = pool.map(lambda job: subprocess.run(job[1], capture_output=True, text=True), jobs.values())
    for label, result in zip(jobs, done, strict=True):
        assert result.returncode == 0, f"{label}: {result.stderr}"
    return {label: library for label, (library, _) in jobs.items()}


def build_plain(folder: Path) -> Path:
    """Compile without optimisation, by the first compiler found: the build that every other must agree with."""
    name = "gcc" if shutil.which("gcc") else "clang"
    (folder / "loops.c").write_text(loops_source())
    library = folder / "plain.so"
    options = [*SAME_BITS, "-O0", f"-I{RUNTIME}", "-fPIC", "-shared", str(folder / "loops.c"), "-o", str(library)]
    subprocess.run([compiler(name), *options, "-lm"], check=True)
    return library


class Library:
    """The loops of one build as functions of numpy arrays."""

    def __init__(self, path: Path):
        self.library = ctypes.CDLL(str(path))

    def __call__(self, name: str, precision: Precision, a, b=None) -> np.ndarray:
        a = np.ascontiguousarray(a, precision.dtype)
        b = a if b is None else np.ascontiguousarray(b, precision.dtype)
        assert a.shape == b.shape
        out = np.empty_like(a)
        loop = self.library[f"loop_gnc_{name}{precision.suffix}"]
        loop(ctypes.c_long(a.size), *(ctypes.c_void_p(array.ctypes.data) for array in (a, b, out)))
        return out
