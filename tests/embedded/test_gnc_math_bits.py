# SPDX-License-Identifier: MIT-0
"""The same source, built by several compilers at several levels, scalar and as vector code, gives the same bits."""

from __future__ import annotations

import functools
import hashlib
import os
import platform
import re
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from math_functions import (
    FUNCTIONS,
    HEADERS,
    ONE_ARGUMENT,
    PRECISIONS,
    RUNTIME,
    WARNINGS,
    Library,
    Precision,
    build_all,
    compiler,
    is_gnu,
    loops_source,
    zig,
)
from math_truth import SPECIAL, any_finite, arguments

#: Compilers beyond the first, each by a test of its own where it is installed.
CLANG, PLUS, CLANG_PLUS = (pytest.param(name, marks=pytest.mark.tools(name)) for name in ("clang", "g++", "clang++"))
#: The zig compiler is asked where its wheel is installed.
COMPILERS = ["gcc", CLANG, *(["zig"] if zig() else [])]


#: Of a compiler's name: label to library.
Builds = Callable[[str], dict[str, Path]]


@pytest.fixture(scope="module")
def builds(tmp_path_factory: pytest.TempPathFactory) -> Builds:
    folder = tmp_path_factory.mktemp("gnc_math")
    return functools.cache(lambda name: build_all(folder, name))


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


@pytest.fixture(scope="module")
def reference_digests(builds: Builds) -> dict[str, str]:
    return digests(builds("gcc")["gcc-O0"])


@pytest.mark.slow
@pytest.mark.parametrize("name", COMPILERS)
def test_every_build_gives_the_same_bits(builds: Builds, name: str, reference_digests: dict[str, str]):
    for label, library in builds(name).items():
        assert digests(library) == reference_digests, f"{label} differs from the unoptimised scalar build"


def test_gcc_vectorises_every_function(builds: Builds):
    """Branch-free in fact and not only in intention: a data-dependent jump would stop the vectoriser.

    Plain SSE2 cannot compare integers of 64 bits, so that only the wider instruction sets are asked for everything.
    """
    if not is_gnu(compiler("gcc")) or platform.machine() not in ("x86_64", "AMD64"):
        pytest.skip("the report read here is that of GNU gcc for x86-64")
    lines = loops_source().splitlines()
    loops = {i for i, line in enumerate(lines, 1) if " LOOP for " in line}
    assert len(loops) == 2 * len(FUNCTIONS)
    for label, library in builds("gcc").items():
        if "-lanes-avx" in label:
            report = library.with_suffix(".txt").read_text()
            found = re.findall(r"loops\.c:(\d+):\d+: \S+ loop vectorized", report)
            missing = loops - {int(line) for line in found}
            assert not missing, (label, [lines[i - 1] for i in sorted(missing)])


# ---- The headers as source ----------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["gcc", CLANG, PLUS, CLANG_PLUS])
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


@pytest.mark.parametrize("name", ["gcc", CLANG])
def test_float_functions_keep_to_float(name: str, tmp_path: Path):
    """No declaration, constant, promotion or call of double: each is an error in this build."""
    assert not re.search(r"\b(double|uint64_t|long)\b", without_comments(HEADERS["float"]))
    lines = ['#include "gnc_mathf.h"']
    for function in FUNCTIONS:
        call = f"gnc_{function}f({'a' if function in ONE_ARGUMENT else 'a, b'})"
        lines.append(f"float use_{function}(float a, float b);")
        lines.append(f"float use_{function}(float a, float b) {{ (void)b; return {call}; }}")
    source = tmp_path / "only_float.c"
    source.write_text("\n".join(lines) + "\n")
    extra = ["-Wunsuffixed-float-constants"] if is_gnu(compiler(name)) else []
    options = ["-std=c99", *WARNINGS, "-Wdouble-promotion", "-DGNC_NO_DOUBLE", *extra, f"-I{RUNTIME}"]
    command = [compiler(name), *options, "-c", str(source)]
    result = subprocess.run([*command, "-o", str(tmp_path / "out.o")], capture_output=True, text=True)
    assert result.returncode == 0, result.stderr


def test_the_only_library_function_is_the_square_root():
    for header in HEADERS.values():
        text = without_comments(header)
        foreign = {call for call in re.findall(r"\b([a-z]\w*)\(", text) if not call.startswith("gnc_")}
        assert foreign <= {"defined", "void", "sizeof"}, foreign
        named = set(re.findall(r"__builtin_\w+|\b(?:sqrtf?|memcpy)\b", text))
        assert named <= {f"__builtin_{name}" for name in ("memcpy", "sqrt", "sqrtf", "fabs", "fabsf")} | {
            "memcpy",
            "sqrt",
            "sqrtf",
        }


#: Flags that gcc tells of, each a part of -ffast-math or of its kind, and what the user reads.
NOT_IEEE = {
    "-ffast-math": "IEEE",
    "-Ofast": "IEEE",
    "-ffinite-math-only": "NaN and infinity",
    "-funsafe-math-optimizations": "sums in their order",
    "-freciprocal-math": "divisions as they stand",
    "-fno-signed-zeros": "signs of zeros",
    "-mfpmath=387": "FLT_EVAL_METHOD",
    "-fsingle-precision-constant": "constants_must_be_doubles_",
}


@pytest.mark.parametrize("flag", NOT_IEEE)
@pytest.mark.parametrize("header", ["gnc_math.h", "gnc_mathf.h", "gnc_allocate_internal.h"])
def test_arithmetic_that_is_not_ieee_is_refused(header: str, flag: str, tmp_path: Path):
    if "single" in flag and header == "gnc_mathf.h":
        return  # its constants are floats as they stand
    if "387" in flag and os.uname().machine != "x86_64":
        return
    source = tmp_path / "fast.c"
    source.write_text(f'#include "{header}"\n')
    sizes = [f"-DGNC_ALLOC_{size}=1" for size in "NRPV"]
    command = [compiler("gcc"), "-std=c99", flag, *sizes, "-DGNC_ALLOC_PREFIX=one", f"-I{RUNTIME}"]
    result = subprocess.run(
        [*command, "-c", str(source), "-o", str(tmp_path / "out.o")], capture_output=True, text=True
    )
    assert result.returncode != 0
    assert NOT_IEEE[flag] in result.stderr
