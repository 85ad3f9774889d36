"""Who builds a package otherwise than it must be built is told: by the compiler, or by the replay.

Truth: the effect of each flag, named in the compilers' manuals; a build that is none of these replays every word.
"""

import os
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from packages import copied, made, run

from casadi_gnc.delivery.fmu import generate_fmu

DOUBLE = ("huang2020/slew", "pd_pinv", "float64")
FLOAT = ("huang2020/slew", "pd_pinv", "float32")
#: Flags that change words or take tests for NaN away, and what the user reads.
WRONG = {
    "-ffast-math": "without -ffast-math",
    "-Ofast": "without -ffast-math",
    "-ffinite-math-only": "without -ffinite-math-only",
    "-funsafe-math-optimizations": "sums in their order|sums are reordered",
    "-fassociative-math -fno-signed-zeros -fno-trapping-math": "sums in their order|sums are reordered",
    "-freciprocal-math": "divisions as they stand|divisions became products",
    "-fno-signed-zeros": "signs of zeros",
    "-mfma -ffp-contract=fast": "operations are fused",
}
GCC_ONLY = {"-mfpmath=387": "FLT_EVAL_METHOD 0", "-fsingle-precision-constant": "gnc_constants_must_be_doubles_"}
CLANG_ONLY = {"-fno-honor-nans": "NaN passes for a number"}
RIGHT = ["", "-O0", "-O3", "-fno-trapping-math", "-frounding-math", "-std=gnu11", "-mfma", "-fno-builtin"]


def has_fma():
    try:
        return " fma " in Path("/proc/cpuinfo").read_text(encoding="utf-8")
    except OSError:
        return False


def build(folder, compiler, flags):
    return run("make", "-s", "test", f"CC={compiler.command[0]}", f"CFLAGS=-O2 {flags}", folder=folder)


@pytest.mark.parametrize("package", [DOUBLE, FLOAT], ids=["double", "float"])
def test_flags_that_change_words_are_told(package, compiler, tmp_path):
    folder, gcc = copied(made(*package), tmp_path), compiler.command[0] == "gcc"
    for flags, sentence in {**WRONG, **(GCC_ONLY if gcc else CLANG_ONLY)}.items():
        if ("fma" in flags and not has_fma()) or (flags == "-fsingle-precision-constant" and package is FLOAT):
            continue
        if flags == "-mfpmath=387" and os.uname().machine != "x86_64":
            continue
        done = build(folder, compiler, flags)
        assert done.returncode != 0, flags
        assert re.search(sentence, done.stdout + done.stderr), (flags, done.stdout + done.stderr)


@pytest.mark.parametrize("package", [DOUBLE, FLOAT], ids=["double", "float"])
def test_flags_that_leave_the_words_are_not(package, compiler, tmp_path):
    folder = copied(made(*package), tmp_path)
    for flags in RIGHT:
        if "fma" in flags and not has_fma():
            continue
        done = build(folder, compiler, flags)
        assert done.returncode == 0, (flags, done.stdout + done.stderr)
        assert done.stdout.endswith(" 0 words differ\n")


def every_unit(folder, unit):
    """Return all units that are made of a controller: those that fly, the replay's, the mock-up unit's."""
    with zipfile.ZipFile(unit) as archive:
        archive.extractall(folder.parent / "unit")
    wrapper = folder.parent / "unit" / "sources" / "fmu.c"
    return [*sorted(folder.glob("*.c")), folder / "test" / "replay.c", wrapper]


@pytest.mark.parametrize("real", ["float64", "float32"])
def test_every_unit_refuses_for_itself(real, compiler, tmp_path):
    """A build may give one file other flags than the rest; the allocator's files count too."""
    folder = copied(made("huang2020/slew", "funnel_robust", real), tmp_path)
    unit = generate_fmu("huang2020/slew", tmp_path / "slew.fmu", scheme="funnel_robust", real=real, name="slew")
    sources = every_unit(folder, unit)
    assert len(sources) == 14
    flags = {"-ffinite-math-only": "gnc_math must see NaN", "-ffast-math": "without -ffast-math"}
    if real == "float64":
        flags["-Ddouble=float"] = "doubles_must_have_64_bits_"
    for source in sources:
        for flag, sentence in flags.items():
            if flag == "-Ddouble=float" and source.name in ("replay.c", "fmu.c"):  # they compute nothing that flies
                continue
            done = run(*compiler.command, "-std=c99", flag, "-fsyntax-only", source)
            assert done.returncode != 0, (source, flag)
            assert sentence in done.stderr, (source, done.stderr)


@pytest.mark.skipif(not has_fma(), reason="the processor has no fused operations")
@pytest.mark.parametrize("real", ["float64", "float32"])
def test_init_refuses_a_build_with_fused_operations(real, compiler, tmp_path):
    """No compiler tells of it. Each of controller and allocator finds it where it alone was built so."""
    folder = made("huang2020/slew", "funnel_robust", real)
    sources = [*sorted(folder.glob("*.c")), folder / "test" / "replay.c", folder / "test" / "vectors.c"]
    told = {"slew.c": "init refused this build", "slew_allocate_setup.c": "init refused its own defaults"}
    objects = {}
    for source in sources:
        for way, flags in (("right", ["-ffp-contract=off"]), ("fused", ["-mfma", "-ffp-contract=fast"])):
            if way == "fused" and source.name not in told:
                continue
            objects[source.name, way] = tmp_path / f"{source.stem}-{way}.o"
            command = [*compiler.command, "-std=c99", "-O2", *flags, "-c", source, "-o", objects[source.name, way]]
            done = run(*command)
            assert done.returncode == 0, done.stderr
    for wrong in (None, *told):
        chosen = [objects[source.name, "fused" if source.name == wrong else "right"] for source in sources]
        assert run(*compiler.command, *chosen, "-lm", "-o", tmp_path / "replay").returncode == 0
        done = run(tmp_path / "replay")
        assert (done.returncode == 0) == (wrong is None), done.stdout
        assert told.get(wrong, " 0 words differ") in done.stdout


#: What switches the processor before main, as another library of the same program may.
SWITCHES = {
    "upward": ("#include <fenv.h>\n{ (void)fesetround(FE_UPWARD); }", "rounding is not to nearest"),
    "towards zero": ("#include <fenv.h>\n{ (void)fesetround(FE_TOWARDZERO); }", "rounding is not to nearest"),
    "flush to zero": ("#include <xmmintrin.h>\n{ _mm_setcsr(_mm_getcsr() | 0x8000u); }", "subnormal numbers count"),
    "subnormals are zero": (
        "#include <xmmintrin.h>\n{ _mm_setcsr(_mm_getcsr() | 0x0040u); }",
        "subnormal numbers count",
    ),
}


@pytest.mark.parametrize("package", [DOUBLE, FLOAT], ids=["double", "float"])
@pytest.mark.parametrize("switch", SWITCHES)
def test_a_switched_processor_is_found(switch, package, tmp_path):
    if "xmm" in SWITCHES[switch][0] and os.uname().machine != "x86_64":
        pytest.skip("the switch is one of x86")
    folder, (body, sentence) = made(*package), SWITCHES[switch]
    include, statement = body.split("\n")
    unit = tmp_path / "switch.c"
    unit.write_text(f"{include}\n__attribute__((constructor)) static void before(void)\n{statement}\n")
    sources = [folder / "slew.c", folder / "test" / "replay.c", folder / "test" / "vectors.c"]
    program = tmp_path / "replay"
    done = run("gcc", "-std=c99", "-O2", "-ffp-contract=off", *sources, unit, "-lm", "-o", program)
    assert done.returncode == 0, done.stderr
    done = run(program)
    assert done.returncode == 1
    assert f"this build does not compute as it must: {sentence}" in done.stdout


def test_a_program_linked_with_fast_math_is_found(tmp_path):
    """Some versions of gcc put a start-up file into it that switches subnormal numbers off; then the replay says so."""
    folder, objects = made(*DOUBLE), []
    for source in (folder / "slew.c", folder / "test" / "replay.c", folder / "test" / "vectors.c"):
        objects.append(tmp_path / f"{source.stem}.o")
        assert run("gcc", "-std=c99", "-O2", "-ffp-contract=off", "-c", source, "-o", objects[-1]).returncode == 0
    done = run("gcc", "-ffast-math", "-Wl,--trace", *objects, "-lm", "-o", tmp_path / "replay")
    switched = "crtfastmath" in done.stdout + done.stderr
    assert (run(tmp_path / "replay").returncode != 0) == switched


def test_what_is_asked_for_is_built(tmp_path):
    """Another compiler, other flags, another version of the same compiler: never the program of before."""
    folder = copied(made(*DOUBLE), tmp_path)
    assert run("make", "-s", "test", folder=folder).returncode == 0
    stamp = (folder / "build" / "replay").stat().st_mtime_ns
    assert run("make", "-s", "test", folder=folder).returncode == 0
    assert (folder / "build" / "replay").stat().st_mtime_ns == stamp
    assert run("make", "-s", "test", "CC=/bin/false", folder=folder).returncode != 0
    assert run("make", "-s", "test", folder=folder).returncode == 0
    for setting in ("CFLAGS=-O2 -ffinite-math-only", "CPPFLAGS=-D__FAST_MATH__", "LDFLAGS=-no-such-flag"):
        assert run("make", "-s", "test", setting, folder=folder).returncode != 0, setting
    wrapper, version = tmp_path / "compiler", tmp_path / "version"
    wrapper.write_text(f'#!/bin/sh\n[ "$1" = --version ] && exec cat {version}\necho "built anew" >&2\nexec cc "$@"\n')
    wrapper.chmod(0o755)
    said = []
    for number in ("1", "1", "2"):
        version.write_text(number)
        said.append(run("make", "-s", "test", f"CC={wrapper}", folder=folder).stderr)
    assert said == ["built anew\n", "", "built anew\n"]


@pytest.mark.parametrize("scheme", ["pd_pinv", "funnel_robust"])
@pytest.mark.parametrize("real", ["float64", "float32"])
def test_the_printed_command_links(scheme, real, tmp_path):
    """As printed, and without the flag that makes the library's square root needless."""
    folder = copied(made("huang2020/slew", scheme, real), tmp_path)
    lines = re.search(r"```sh\n(.*?)```", (folder / "README.md").read_text(), re.DOTALL)[1]
    for text in (lines, lines.replace("-fno-math-errno ", ""), lines.replace("-O2", "-O0 -fno-builtin")):
        done = subprocess.run(["sh", "-e", "-c", text], cwd=folder, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        assert done.stdout.endswith(" 0 words differ\n")


def test_cmake_builds_the_replay_with_the_same_flags(tmp_path):
    cmake = [sys.executable, "-c", "import sys, cmake; sys.exit(cmake.cmake())"]
    folder = made(*DOUBLE)
    done = run(*cmake, "-S", folder, "-B", tmp_path, "-DCMAKE_C_FLAGS=-O2 -march=native", "-DCMAKE_VERBOSE_MAKEFILE=ON")
    assert done.returncode == 0, done.stderr
    done = run(*cmake, "--build", tmp_path)
    assert done.returncode == 0, done.stderr
    compiled = [line for line in done.stdout.splitlines() if " -c " in line and "-march=native" in line]
    assert len(compiled) == 3
    assert all("-ffp-contract=off" in line and "-std=c99" in line for line in compiled)
    assert run(tmp_path / "slew_replay").returncode == 0
