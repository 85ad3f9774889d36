# SPDX-License-Identifier: MIT-0
"""Check the elementary functions of `codegen/runtime` against multiple-precision truth and each other.

Truth is mpmath; the error bound of each function is the one its comment in the header states, so the
documentation is what the tests hold the code to. The same source, built by several compilers at several
levels, must give the same bits.
"""

from __future__ import annotations

import ctypes
import functools
import hashlib
import math
import os
import platform
import re
import shutil
import subprocess
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import mpmath
import numpy as np
import pytest

RUNTIME = Path(__file__).resolve().parents[2] / "codegen" / "runtime"
HEADERS = {"double": RUNTIME / "gnc_math.h", "float": RUNTIME / "gnc_mathf.h"}

# fmt: off
ONE_ARGUMENT = [
    "exp", "expm1", "log", "log1p", "sin", "cos", "tan", "sinh", "cosh", "tanh", "asin", "acos", "atan",
    "sqrt", "fabs", "floor", "ceil", "sign",
]
# fmt: on
TWO_ARGUMENTS = ["atan2", "pow", "fmod", "copysign"]
EXACT = {"sqrt", "fabs", "floor", "ceil", "sign", "fmod", "copysign"}
KEEP_NAN = {"fabs", "floor", "ceil", "sign", "copysign"}
FUNCTIONS = [*ONE_ARGUMENT, *TWO_ARGUMENTS]

WARNINGS = ["-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-pedantic", "-Werror"]
SAME_BITS = ["-std=c99", "-ffp-contract=off"]
LANES = [
    "-fno-math-errno",
    "-fno-trapping-math",
    "-fopenmp-simd",
    "-DLANES",
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
    """Return the path of a compiler; without it skip, or fail where the machine is meant to have it."""
    path = shutil.which(name)
    if path is None:
        reason = f"{name} is not on the PATH"
        if os.environ.get("CI") == "true":
            pytest.fail(f"{reason}, and CI must have it")
        pytest.skip(reason)
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


@pytest.fixture(scope="session")
def builds(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Compile every build of every compiler there is, two at a time."""
    folder = tmp_path_factory.mktemp("gnc_math")
    source = folder / "loops.c"
    source.write_text(loops_source())
    jobs = {}
    for name in ("gcc", "clang"):
        path = shutil.which(name)
        if path is None:
            continue
        for label, flags in builds_of(name).items():
            library = folder / f"{label}.so"
            report = [f"-fopt-info-vec={library.with_suffix('.txt')}"] if is_gnu(path) and "-DLANES" in flags else []
            build = [path, *SAME_BITS, *flags, *report, f"-I{RUNTIME}", "-fPIC", "-shared"]
            jobs[label] = (library, [*build, str(source), "-o", str(library), "-lm"])
    with ThreadPoolExecutor(2) as pool:
        done = pool.map(lambda job: subprocess.run(job[1], capture_output=True, text=True), jobs.values())
    for label, result in zip(jobs, done, strict=True):
        assert result.returncode == 0, f"{label}: {result.stderr}"
    return {label: library for label, (library, _) in jobs.items()}


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


@pytest.fixture(scope="session")
def library(builds: dict[str, Path]) -> Library:
    """The plainest build: every other one must agree with it."""
    for label in ("gcc-O0", "clang-O0"):
        if label in builds:
            return Library(builds[label])
    compiler("gcc")
    raise AssertionError("unreachable: compiler() skips or fails")


# ---- Arguments ----------------------------------------------------------------------------------------------


def any_finite(rng: np.random.Generator, p: Precision, n: int) -> np.ndarray:
    """Draw from the bit patterns: every exponent and subnormal numbers, both signs."""
    x = rng.integers(0, np.iinfo(p.bits).max, 2 * n + 64, dtype=p.bits, endpoint=True).view(p.dtype)
    return x[np.isfinite(x)][:n]


def neighbours(p: Precision, centres) -> np.ndarray:
    """Each centre, and the numbers one, two and seven steps to either side of it."""
    centres = np.asarray(centres, p.dtype)
    bits = centres.view(p.bits).astype(object)
    return np.array([b + s for b in bits for s in (-7, -2, -1, 0, 1, 2, 7) if b + s >= 0], p.bits).view(p.dtype)


def arguments(name: str, p: Precision, n: int) -> tuple[np.ndarray, ...]:
    """Random and structured arguments within the range in which the header states an accuracy."""
    rng = np.random.default_rng(20240229)
    every = any_finite(rng, p, n)
    unit = rng.uniform(-1, 1, n)
    powers = 2.0 ** np.arange(-40, 41, 5)
    structured = neighbours(p, np.concatenate([powers, [0.5, 0.41421356237309503, 0.7071067811865476, math.sqrt(2)]]))
    tiny = np.array([2.0**p.smallest_exponent, 2.0 ** (p.smallest_exponent + p.digits - 1)])
    tiny = np.concatenate([tiny, 3 * tiny[:1], tiny[1:] - tiny[0]])
    mixed = np.concatenate([every, 8 * unit, structured, tiny]).astype(p.dtype)
    mixed = np.concatenate([mixed, -mixed])
    if name in ("sin", "cos", "tan"):
        limit = 2.0**20 if p is DOUBLE else 1e4
        quarters = np.unique(np.concatenate([np.arange(1, 40), rng.integers(1, int(limit / 1.58), n // 8)]))
        mixed = np.concatenate([mixed, neighbours(p, quarters * (math.pi / 2)), unit * limit]).astype(p.dtype)
        return (mixed[np.abs(mixed) <= limit],)
    if name in ("exp", "expm1", "sinh", "cosh", "tanh"):
        top = math.log(2) * (p.smallest_exponent - 1)
        halves = neighbours(p, np.arange(1, 40) * (math.log(2) / 2))
        edges = neighbours(p, [-top, 709.782712893384, 88.72284, 37.4, 17.3, 22.0, 9.01])
        mixed = np.concatenate([mixed, halves, -halves, edges, -edges, unit * top]).astype(p.dtype)
        return (mixed[np.abs(mixed) <= -1.01 * top],)
    if name in ("log", "log1p"):
        near_one = 1 + unit * 2.0 ** -rng.uniform(0, p.digits, n)
        mixed = np.concatenate([mixed, near_one, near_one - 1]).astype(p.dtype)
        return (mixed[mixed > (0 if name == "log" else -1)],)
    if name in ("asin", "acos"):
        near_one = 1 - 2.0 ** -rng.uniform(1, p.digits, n)
        mixed = np.concatenate([mixed, unit, near_one, -near_one]).astype(p.dtype)
        return (mixed[np.abs(mixed) <= 1],)
    if name in ("atan2", "copysign", "fmod"):
        other = any_finite(rng, p, n)
        with np.errstate(over="ignore"):
            related = (other * (unit * 2.0 ** rng.uniform(-30, 20, n))).astype(p.dtype)
        size = min(other.size, n, mixed.size)
        a = np.concatenate([every[:size], related[:size], unit[:size], structured])
        b = np.concatenate([other[:size], other[:size], rng.uniform(-1, 1, size), rng.permutation(structured)])
        a, b = a.astype(p.dtype), b.astype(p.dtype)
        keep = np.isfinite(a) & np.isfinite(b) & (a != 0) & (b != 0)  # mpmath has no -0
        if name == "fmod":
            with np.errstate(over="ignore", divide="ignore"):
                keep &= np.abs(a.astype(np.longdouble) / b) < 2.0 ** (p.digits - 1)
        return a[keep], b[keep]
    if name == "pow":
        top = math.log(2) * (p.smallest_exponent - 1)
        near_one = (1 + unit * 2.0 ** -rng.uniform(1, p.digits, n)).astype(p.dtype)
        base = np.concatenate([np.abs(every), near_one, rng.uniform(0, 4, n), -structured]).astype(p.dtype)
        log_base = np.log(np.abs(base.astype(np.float64)))
        log_base[log_base == 0] = 1.0
        power = rng.uniform(top, -top, base.size) / log_base
        power[-structured.size :] = rng.integers(-9, 9, structured.size)
        power = power.astype(p.dtype)
        keep = np.isfinite(power) & (base != 0)
        return base[keep], power[keep]
    if name == "sqrt":
        return (np.abs(mixed),)
    halves = rng.integers(-1000, 1000, n) / 2
    return (np.concatenate([mixed, halves, unit * 2.0 ** (p.digits - 1)]).astype(p.dtype),)


# ---- Accuracy -----------------------------------------------------------------------------------------------


def sign_of(x):
    return x if x == 0 else mpmath.sign(x)


TRUTH = {name: getattr(mpmath, name) for name in ONE_ARGUMENT if hasattr(mpmath, name)} | {
    "sign": sign_of,
    "atan2": mpmath.atan2,
    "pow": mpmath.power,
    "fmod": lambda x, y: mpmath.mpf(math.fmod(x, y)),  # exact, like the next one
    "copysign": lambda x, y: mpmath.mpf(math.copysign(x, y)),
}


def ulp_error(got: float, exact, p: Precision) -> float:
    """|got - exact| in units in the last place of exact; infinity counts as the power of two past the largest."""
    top = mpmath.mpf(2) ** (-p.smallest_exponent - p.digits + 3)
    assert not math.isnan(got), f"NaN where {mpmath.nstr(exact, 20)} was expected"
    if math.isinf(got):
        assert abs(exact) >= top * (1 - mpmath.mpf(2) ** (-p.digits - 1)), f"{got} for {mpmath.nstr(exact, 20)}"
        return 0.0 if (got > 0) == (exact > 0) else math.inf
    if abs(exact) >= top:
        return math.inf
    exponent = mpmath.frexp(exact)[1] - p.digits if exact else p.smallest_exponent
    return float(abs(mpmath.mpf(got) - exact) * mpmath.mpf(2) ** -max(exponent, p.smallest_exponent))


def stated_bound(name: str, p: Precision) -> float:
    """Read `max u ulp` from the comment above a function."""
    text = HEADERS[p.name].read_text()
    before = text[: text.index(f" gnc_{name}{p.suffix}(", text.index("Exact functions"))]
    comment = before[before.rindex("/*") :]
    return float(re.search(r"max ([0-9.]+) ulp", comment).group(1))


@pytest.mark.parametrize("p", PRECISIONS, **by_name)
@pytest.mark.parametrize("name", FUNCTIONS)
def test_error_is_within_the_stated_bound(library: Library, name: str, p: Precision):
    columns = arguments(name, p, 600 if p is DOUBLE else 300)
    got = library(name, p, *columns)
    if name == "sqrt":  # the IEEE operation is its own truth, and numpy uses it
        np.testing.assert_array_equal(got, np.sqrt(columns[0]))
        return
    bound = 0.0 if name in EXACT else stated_bound(name, p)
    assert bound <= 1.5
    worst, where = 0.0, None
    with mpmath.workprec(160):
        for *values, y in zip(*(c.tolist() for c in columns), got.tolist(), strict=True):
            exact = TRUTH[name](*(values if name in EXACT else map(mpmath.mpf, values)))
            error = ulp_error(y, exact, p)
            if error > worst:
                worst, where = error, (values, y)
    assert worst <= bound, f"{name}{p.suffix}: {worst:.3f} ulp at {where}"


@pytest.mark.parametrize("p", PRECISIONS, **by_name)
def test_trigonometry_far_out_stays_bounded(library: Library, p: Precision):
    limit = 2.0**20 if p is DOUBLE else 1e4
    end = 2.0**30 if p is DOUBLE else 2.0**17
    info = np.finfo(p.dtype)
    far = 2.0 ** np.linspace(math.log2(limit), info.maxexp - 0.01, 500)
    x = np.concatenate([far, [info.max], neighbours(p, [limit, end])]).astype(p.dtype)
    for name in ("sin", "cos"):
        assert np.all(np.abs(library(name, p, x)) <= 1)
    assert np.all(np.isfinite(library("tan", p, x)))
    between = x[(x > limit) & (x <= end)]
    with mpmath.workprec(160):
        truth = np.array([float(mpmath.sin(mpmath.mpf(v))) for v in between.tolist()])
    phase = between.astype(float) * 2.0 ** (1 - p.digits) + 2.0 ** (1 - p.digits)
    assert np.all(np.abs(library("sin", p, between) - truth) <= phase)
    np.testing.assert_array_equal(library("cos", p, x[x > end]), 1)


# ---- Special values -----------------------------------------------------------------------------------------

INF, NAN = math.inf, math.nan
PI = math.pi
# fmt: off
SPECIAL = {
    "exp": [(0.0, 1), (-0.0, 1), (INF, INF), (-INF, 0.0), (NAN, NAN), (1e30, INF), (-1e30, 0.0)],
    "expm1": [(0.0, 0.0), (-0.0, -0.0), (INF, INF), (-INF, -1), (NAN, NAN), (1e30, INF), (-1e30, -1)],
    "log": [(1, 0.0), (0.0, -INF), (-0.0, -INF), (INF, INF), (-1, NAN), (-INF, NAN), (NAN, NAN)],
    "log1p": [(0.0, 0.0), (-0.0, -0.0), (-1, -INF), (-1.5, NAN), (INF, INF), (-INF, NAN), (NAN, NAN)],
    "sin": [(0.0, 0.0), (-0.0, -0.0), (INF, NAN), (-INF, NAN), (NAN, NAN)],
    "cos": [(0.0, 1), (-0.0, 1), (INF, NAN), (-INF, NAN), (NAN, NAN)],
    "tan": [(0.0, 0.0), (-0.0, -0.0), (INF, NAN), (-INF, NAN), (NAN, NAN)],
    "sinh": [(0.0, 0.0), (-0.0, -0.0), (INF, INF), (-INF, -INF), (NAN, NAN), (1e30, INF), (-1e30, -INF)],
    "cosh": [(0.0, 1), (-0.0, 1), (INF, INF), (-INF, INF), (NAN, NAN), (-1e30, INF)],
    "tanh": [(0.0, 0.0), (-0.0, -0.0), (INF, 1), (-INF, -1), (NAN, NAN), (1e30, 1), (-1e30, -1)],
    "asin": [(0.0, 0.0), (-0.0, -0.0), (1, PI / 2), (-1, -PI / 2), (1.5, NAN), (-INF, NAN), (NAN, NAN)],
    "acos": [(1, 0.0), (-1, PI), (0.0, PI / 2), (-0.0, PI / 2), (1.5, NAN), (INF, NAN), (NAN, NAN)],
    "atan": [(0.0, 0.0), (-0.0, -0.0), (INF, PI / 2), (-INF, -PI / 2), (1, PI / 4), (NAN, NAN)],
    "sqrt": [(0.0, 0.0), (-0.0, -0.0), (INF, INF), (-1, NAN), (-INF, NAN), (NAN, NAN)],
    "fabs": [(-0.0, 0.0), (-INF, INF), (NAN, NAN)],
    "floor": [(0.0, 0.0), (-0.0, -0.0), (0.5, 0.0), (-0.5, -1), (INF, INF), (-INF, -INF), (NAN, NAN)],
    "ceil": [(0.0, 0.0), (-0.0, -0.0), (0.5, 1), (-0.5, -0.0), (INF, INF), (-INF, -INF), (NAN, NAN)],
    "sign": [(0.0, 0.0), (-0.0, -0.0), (INF, 1), (-INF, -1), (3, 1), (-3, -1), (NAN, NAN)],
    "copysign": [(1, -0.0, -1), (-1, 0.0, 1), (INF, -1, -INF), (0.0, -INF, -0.0)],
    "fmod": [
        (0.0, 3, 0.0), (-0.0, 3, -0.0), (5, INF, 5), (-5, -INF, -5), (INF, 3, NAN), (-INF, 3, NAN),
        (5, 0.0, NAN), (5, -0.0, NAN), (0.0, 0.0, NAN), (NAN, 1, NAN), (1, NAN, NAN), (INF, INF, NAN),
        (6, 3, 0.0), (-6, 3, -0.0), (5, -3, 2), (-5, 3, -2), (1e30, 1e-6, 0.0), (-1e30, 1e-6, -0.0),
    ],
    "atan2": [
        (0.0, 0.0, 0.0), (-0.0, 0.0, -0.0), (0.0, -0.0, PI), (-0.0, -0.0, -PI), (0.0, -1, PI),
        (-0.0, -1, -PI), (0.0, 1, 0.0), (-0.0, 1, -0.0), (1, 0.0, PI / 2), (-1, 0.0, -PI / 2), (1, -0.0, PI / 2),
        (1, INF, 0.0), (-1, INF, -0.0), (1, -INF, PI), (-1, -INF, -PI), (INF, 1, PI / 2), (-INF, 1, -PI / 2),
        (INF, INF, PI / 4), (-INF, INF, -PI / 4), (INF, -INF, 3 * PI / 4), (-INF, -INF, -3 * PI / 4),
        (1, 1, PI / 4), (-1, -1, -3 * PI / 4), (NAN, 1, NAN), (1, NAN, NAN), (NAN, INF, NAN), (INF, NAN, NAN),
    ],
    "pow": [
        (0.0, -3, INF), (-0.0, -3, -INF), (0.0, -2, INF), (-0.0, -2, INF), (-0.0, -0.5, INF), (0.0, -INF, INF),
        (0.0, 3, 0.0), (-0.0, 3, -0.0), (-0.0, 2, 0.0), (-0.0, 0.5, 0.0), (-1, INF, 1), (-1, -INF, 1), (1, NAN, 1),
        (NAN, 0.0, 1), (NAN, -0.0, 1), (INF, 0.0, 1), (0.0, 0.0, 1), (1, INF, 1), (1, -INF, 1), (-2, 0.5, NAN),
        (0.5, -INF, INF), (2, -INF, 0.0), (0.5, INF, 0.0), (2, INF, INF), (-0.5, INF, 0.0), (-2, INF, INF),
        (-INF, -3, -0.0), (-INF, -2, 0.0), (-INF, -0.5, 0.0), (-INF, 3, -INF), (-INF, 2, INF), (-INF, 0.5, INF),
        (INF, -1, 0.0), (INF, 1, INF), (NAN, 1, NAN), (2, NAN, NAN), (-2, 3, -8), (-2, 2, 4), (-2, -3, -0.125),
        (2, 1e30, INF), (2, -1e30, 0.0), (0.5, 1e30, 0.0), (-2, 1e30, INF), (-1, 1e30, 1), (1, 1e30, 1),
        (0.0, INF, 0.0), (-1, 8388607, -1), (-1, 8388606, 1), (-1, 0.5, NAN), (-3, 1, -3), (10, 2, 100),
        (2, -126, 2.0**-126),
    ],
}
# fmt: on


@pytest.mark.parametrize("p", PRECISIONS, **by_name)
@pytest.mark.parametrize("name", FUNCTIONS)
def test_special_values_follow_annex_f(library: Library, name: str, p: Precision):
    for *values, expected in SPECIAL[name]:
        (got,) = library(name, p, *([v] for v in values))
        if math.isnan(expected):
            assert got.view(p.bits) == p.nan_bits, f"{name}{tuple(values)} = {got}, not the canonical NaN"
        else:
            # Compared as bits, so that the sign of zero counts. Multiples of pi are the nearest ones.
            assert got.view(p.bits) == p.dtype(expected).view(p.bits), f"{name}{tuple(values)} = {got}"


@pytest.mark.parametrize("p", PRECISIONS, **by_name)
@pytest.mark.parametrize("name", [name for name in FUNCTIONS if name not in KEEP_NAN])
def test_a_nan_result_is_always_the_same_one(library: Library, name: str, p: Precision):
    """Its sign and payload depend on the processor and on the order of operands, so they are not handed on."""
    sign = 1 << (8 * np.dtype(p.dtype).itemsize - 1)
    nan = np.array([p.nan_bits, p.nan_bits + 1, p.nan_bits + sign, p.nan_bits + sign + 5], p.bits).view(p.dtype)
    columns = (
        [(nan,)] if name in ONE_ARGUMENT else [(nan, nan), (nan, np.full_like(nan, 2)), (np.full_like(nan, 2), nan)]
    )
    for column in columns:
        assert set(library(name, p, *column).view(p.bits).tolist()) == {p.nan_bits}


@pytest.mark.parametrize("p", PRECISIONS, **by_name)
def test_odd_and_even_functions_are_symmetric_bit_for_bit(library: Library, p: Precision):
    for name in ("sin", "tan", "sinh", "tanh", "asin", "atan"):
        (x,) = arguments(name, p, 2000)
        np.testing.assert_array_equal(library(name, p, -x), -library(name, p, x))
    for name in ("cos", "cosh"):
        (x,) = arguments(name, p, 2000)
        np.testing.assert_array_equal(library(name, p, -x), library(name, p, x))


# ---- The same bits everywhere -------------------------------------------------------------------------------

IDENTITY_POINTS = 100_000 // (2 * len(FUNCTIONS))


def identity_arguments(name: str, p: Precision) -> list[np.ndarray]:
    """Arguments inside and outside the stated range, special values included."""
    rng = np.random.default_rng(7)
    columns = arguments(name, p, IDENTITY_POINTS)
    wild = [any_finite(rng, p, columns[0].size) for _ in columns]
    size = min(w.size for w in wild)
    special = zip(*SPECIAL[name], strict=True)  # the last of its columns, the expected values, has no partner here
    return [np.concatenate([c, w[:size], s]).astype(p.dtype) for c, w, s in zip(columns, wild, special, strict=False)]


@functools.cache
def all_identity_arguments() -> dict[tuple[str, Precision], list[np.ndarray]]:
    return {(name, p): identity_arguments(name, p) for p in PRECISIONS for name in FUNCTIONS}


def digests(path: Path) -> dict[str, str]:
    library = Library(path)
    return {
        name + p.suffix: hashlib.sha256(library(name, p, *columns).tobytes()).hexdigest()
        for (name, p), columns in all_identity_arguments().items()
    }


@pytest.fixture(scope="session")
def reference_digests(builds: dict[str, Path]) -> dict[str, str]:
    label = "gcc-O0" if "gcc-O0" in builds else "clang-O0"
    return digests(builds[label])


@pytest.mark.parametrize("name", ["gcc", "clang"])
def test_every_build_gives_the_same_bits(builds: dict[str, Path], name: str, request: pytest.FixtureRequest):
    compiler(name)
    reference = request.getfixturevalue("reference_digests")
    for label in builds_of(name):
        assert digests(builds[label]) == reference, f"{label} differs from the unoptimised scalar build"


def test_gcc_vectorises_every_function(builds: dict[str, Path]):
    """Branch-free in fact and not only in intention: a data-dependent jump would stop the vectoriser.

    Plain SSE2 cannot compare integers of 64 bits, so that only the wider instruction sets are asked for everything.
    """
    if not is_gnu(compiler("gcc")) or platform.machine() not in ("x86_64", "AMD64"):
        pytest.skip("the report read here is that of GNU gcc for x86-64")
    lines = loops_source().splitlines()
    loops = {i for i, line in enumerate(lines, 1) if " LOOP for " in line}
    assert len(loops) == 2 * len(FUNCTIONS)
    for label in builds_of("gcc"):
        report = builds[label].with_suffix(".txt")
        if "-lanes-avx" in label:
            found = re.findall(r"loops\.c:(\d+):\d+: \S+ loop vectorized", report.read_text())
            missing = loops - {int(line) for line in found}
            assert not missing, (label, [lines[i - 1] for i in sorted(missing)])


# ---- The headers as source ----------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["gcc", "clang", "g++", "clang++"])
@pytest.mark.parametrize("level", ["-O0", "-O2"])
def test_headers_compile_without_a_warning(name: str, level: str, tmp_path: Path):
    plus = name.endswith("++")
    for header in HEADERS.values():
        source = tmp_path / f"{header.stem}.{'cpp' if plus else 'c'}"
        source.write_text(f'#include "{header.name}"\n#include "{header.name}"\n')
        language = ["-std=c++17"] if plus else ["-std=c99", "-Wmissing-prototypes"]
        command = [compiler(name), *language, *WARNINGS, "-Wdouble-promotion", level, f"-I{RUNTIME}", "-c", str(source)]
        result = subprocess.run([*command, "-o", str(tmp_path / "out.o")], capture_output=True, text=True)
        assert result.returncode == 0, result.stderr


def without_comments(header: Path) -> str:
    return re.sub(r"/\*.*?\*/", " ", header.read_text(), flags=re.DOTALL)


def test_float_functions_keep_to_float(tmp_path: Path):
    """No declaration, constant, promotion or call of double: each is an error in this build."""
    assert not re.search(r"\b(double|uint64_t|long)\b", without_comments(HEADERS["float"]))
    lines = ['#include "gnc_mathf.h"']
    for name in FUNCTIONS:
        call = f"gnc_{name}f({'a' if name in ONE_ARGUMENT else 'a, b'})"
        lines.append(f"float use_{name}(float a, float b);")
        lines.append(f"float use_{name}(float a, float b) {{ (void)b; return {call}; }}")
    source = tmp_path / "only_float.c"
    source.write_text("\n".join(lines) + "\n")
    for name in ("gcc", "clang"):
        if name == "clang" and shutil.which(name) is None:
            continue
        extra = ["-Wunsuffixed-float-constants"] if is_gnu(compiler(name)) else []
        options = ["-std=c99", *WARNINGS, "-Wdouble-promotion", *extra, f"-I{RUNTIME}"]
        command = [compiler(name), *options, "-c", str(source)]
        result = subprocess.run([*command, "-o", str(tmp_path / "out.o")], capture_output=True, text=True)
        assert result.returncode == 0, result.stderr


def test_the_only_library_function_is_the_square_root():
    for header in HEADERS.values():
        calls = set(re.findall(r"\b([a-z]\w*)\(", without_comments(header)))
        foreign = {c for c in calls if not c.startswith("gnc_")} - {"defined", "void"}
        assert foreign <= {"sqrt", "sqrtf", "memcpy"}, foreign


@pytest.mark.parametrize("p", PRECISIONS, **by_name)
def test_arithmetic_that_is_not_ieee_is_refused(p: Precision, tmp_path: Path):
    source = tmp_path / "fast.c"
    source.write_text(f'#include "{HEADERS[p.name].name}"\n')
    command = [
        compiler("gcc"),
        "-std=c99",
        "-ffast-math",
        f"-I{RUNTIME}",
        "-c",
        str(source),
        "-o",
        str(tmp_path / "out.o"),
    ]
    result = subprocess.run(command, capture_output=True, text=True)
    assert result.returncode != 0
    assert "IEEE" in result.stderr
