"""The C of the online allocator as it is compiled: warnings, size, stack, words of all compilers, threads."""

import re
import subprocess
import threading

import numpy as np
import online_allocator as oa
import pytest
from online_allocator import Allocator
from online_answers import PLAIN, recorded

STRICT = ["-ffp-contract=off", "-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-pedantic", "-Werror"]
SIZES = [(12, 3, 3, 8), (12, 3, 0, 1), (4, 3, 3, 8), (4, 3, 1, 2), (24, 6, 8, 64), (1, 1, 0, 1), (64, 6, 0, 1)]


@pytest.mark.parametrize(
    "command",
    [
        "gcc -std=c99 -Wmissing-prototypes",
        pytest.param("clang -std=c99 -Wmissing-prototypes", marks=pytest.mark.tools("clang")),
        pytest.param("g++ -std=c++17 -x c++", marks=pytest.mark.tools("g++")),
        pytest.param("clang++ -std=c++17 -x c++", marks=pytest.mark.tools("clang++")),
    ],
)
@pytest.mark.parametrize("size", SIZES, ids=str)
@pytest.mark.parametrize("single", [False, True], ids=["double", "float"])
def test_compiles_without_a_warning(command, size, single, tmp_path):
    for name in oa.SOLVER_FILES:
        subprocess.run(
            [
                *command.split(),
                "-O2",
                *STRICT,
                *oa.defines(*size, single),
                "-c",
                str(oa.SOURCES / name),
                "-o",
                str(tmp_path / "x.o"),
            ],
            check=True,
        )


def small_build(tmp_path, *flags):
    for name in oa.SOLVER_FILES:
        subprocess.run(
            [
                "gcc",
                "-std=c99",
                "-Os",
                "-ffp-contract=off",
                "-fno-asynchronous-unwind-tables",  # for C++ exceptions and debuggers: no code, not on board
                *flags,
                *oa.defines(12, 3, 3, 8),
                "-c",
                str(oa.SOURCES / name),
                "-o",
                str(tmp_path / name.replace(".c", ".o")),
            ],
            check=True,
        )
    return [str(tmp_path / name.replace(".c", ".o")) for name in oa.SOLVER_FILES]


def test_code_is_small_and_has_no_state(tmp_path):
    lines = subprocess.run(["size", *small_build(tmp_path)], check=True, capture_output=True, text=True).stdout
    text, data, bss = np.array([[int(x) for x in line.split()[:3]] for line in lines.splitlines()[1:]]).sum(axis=0)
    assert text < 24_000
    assert data == bss == 0


def test_needs_nothing_from_outside_but_sqrt_and_memory_moves(tmp_path):
    out = subprocess.run(["nm", *small_build(tmp_path)], check=True, capture_output=True, text=True).stdout
    own = set(re.findall(r" [TtRr] (\w+)", out))
    assert set(re.findall(r" U (\w+)", out)) - own <= {"sqrt", "memcpy", "memset", "memcmp"}


def test_stack_is_small(tmp_path):
    """Frames by the compiler's report, calls by the disassembly: the deepest chain, no recursion."""
    objects = small_build(tmp_path, "-fstack-usage", "-fno-inline-functions-called-once")
    frame, calls = {}, {}
    for name in oa.SOLVER_FILES:
        for line in (tmp_path / name.replace(".c", ".su")).read_text().splitlines():
            where, size, kind = line.split("\t")
            assert "dynamic" not in kind or "bounded" in kind
            frame[where.split(":")[-1]] = int(size) + 8  # and the return address
    for file in objects:
        function = None
        for line in subprocess.run(
            ["objdump", "-dr", file], check=True, capture_output=True, text=True
        ).stdout.splitlines():
            if match := re.match(r"[0-9a-f]+ <([\w.]+)>:", line):
                function = match[1]
                calls.setdefault(function, set())
            elif match := re.search(r"R_X86_64_(?:PLT32|PC32)\s+([\w.]+?)-0x4", line) or re.search(
                r"(?:call|jmp)\s+[0-9a-f]+ <([\w.]+)>", line
            ):
                calls[function].add(match[1])

    def depth(function, path=()):
        assert function not in path, "recursion"
        below = [depth(f, (*path, function)) for f in calls.get(function, ()) if f in frame and f != function]
        return frame[function] + max(below, default=0)

    assert depth("gnc_alloc_solve") < 8192, depth("gnc_alloc_solve")


def outputs(allocator, flight):
    _, results = allocator.sequence(flight["u"], flight["previous"], flight["lower"], flight["upper"])
    return b"".join(results[name].tobytes() for name in results.dtype.names)  # without the padding


def words_of(compiler, flags, flight):
    allocator = Allocator(12, 3, 3, 8, compiler=compiler, flags=flags)
    allocator.setup(*PLAIN)
    words = outputs(allocator, flight)
    assert outputs(allocator, flight) == words  # and on every run
    return words


@pytest.mark.parametrize(
    ("compiler", "levels"),
    [
        pytest.param("gcc", [oa.FAST_FLAGS], marks=pytest.mark.slow),
        pytest.param("gcc", [["-O1"], ["-O2"], ["-O3"], ["-O3", "-march=native"]], marks=pytest.mark.slow),
        pytest.param("clang", [["-O0"], ["-O2"], ["-O3", "-march=native"]], marks=pytest.mark.tools("clang")),
    ],
    ids=["gcc, fast flags", "gcc, other levels", "clang"],
)
def test_same_words_from_every_compiler_and_level(compiler, levels):
    flight = {name: rows[:1500] for name, rows in recorded("noisy slew").items()}
    plain = words_of("gcc", ["-O0"], flight)
    differ = [flags for flags in levels if words_of(compiler, flags, flight) != plain]
    assert not differ


def test_threads_do_not_disturb_each_other(thrusters):
    flight = {name: rows[:1000] for name, rows in recorded("slew").items()}
    alone, found = outputs(thrusters, flight), []
    threads = [threading.Thread(target=lambda: found.append(outputs(thrusters, flight))) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == [alone] * 4


def test_two_solvers_in_one_program(tmp_path):
    (tmp_path / "main.c").write_text("""
#define GNC_ALLOC_PREFIX wheels
#define GNC_ALLOC_N 4
#define GNC_ALLOC_R 3
#define GNC_ALLOC_P 1
#define GNC_ALLOC_V 2
#include "gnc_allocate.h"
#undef GNC_ALLOC_PREFIX
#undef GNC_ALLOC_N
#undef GNC_ALLOC_P
#undef GNC_ALLOC_V
#define GNC_ALLOC_PREFIX jets
#define GNC_ALLOC_N 6
#define GNC_ALLOC_P 0
#define GNC_ALLOC_V 1
#include "gnc_allocate.h"
static wheels_workspace ww; static wheels_data wd; static wheels_problem wp; static wheels_result wr;
static jets_workspace jw; static jets_data jd; static jets_problem jp; static jets_result jr;
int main(void)
{
    const double u[3] = {0.1, 0.2, -0.1}, zero[6] = {0};
    const double low[6] = {-1, -1, -1, -1, -1, -1}, high[6] = {1, 1, 1, 1, 1, 1};
    int i;
    wp.h = jp.h = 1e6;
    for (i = 0; i < 3; ++i) { wp.A0[i][i] = 1; wp.A0[i][3] = 0.5; jp.A0[i][i] = jp.A0[i][i + 3] = 1; }
    for (i = 0; i < 6; ++i) { jp.m1[i] = 1; if (i < 4) { wp.m1[i] = 1; wp.E[0][i] = 1; } }
    wp.D[0][0][0] = 0.01; wp.D[1][0][0] = -0.01;
    if (wheels_setup(&wd, &wp) || jets_setup(&jd, &jp)) return 1;
    wheels_reset(&ww); jets_reset(&jw);
    if (wheels_solve(&ww, &wd, u, zero, low, high, 0, &wr)) return 2;
    if (jets_solve(&jw, &jd, u, zero, low, high, 0, &jr)) return 2;
    for (i = 0; i < 3; ++i) {
        if (jr.force[i] - u[i] / 2 > 1e-6 || u[i] / 2 - jr.force[i] > 1e-6) return 3;
        if (wr.unallocated[i] > 1e-3 || wr.unallocated[i] < -1e-3) return 4;
    }
    return 0;
}
""")
    objects = []
    for prefix, size in (("wheels", (4, 3, 1, 2)), ("jets", (6, 3, 0, 1))):
        for name in oa.SOLVER_FILES:
            objects.append(str(tmp_path / f"{prefix}_{name}.o"))
            subprocess.run(
                [
                    "gcc",
                    "-std=c99",
                    "-O2",
                    *oa.defines(*size, prefix=prefix),
                    "-c",
                    str(oa.SOURCES / name),
                    "-o",
                    objects[-1],
                ],
                check=True,
            )
    subprocess.run(
        [
            "gcc",
            "-std=c99",
            *STRICT,
            f"-I{oa.SOURCES}",
            str(tmp_path / "main.c"),
            *objects,
            "-lm",
            "-o",
            str(tmp_path / "main"),
        ],
        check=True,
    )
    subprocess.run([str(tmp_path / "main")], check=True)
