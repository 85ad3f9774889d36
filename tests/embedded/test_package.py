"""A package is what it says: words of the simulated flight, strict C, no memory of its own, the same bytes again."""

import os
import re
import sys

import numpy as np
import pytest
from packages import C99, STRICT, copied, made, made_in_surroundings, run, units

import casadi_gnc
from casadi_gnc.delivery.verifying import read_vectors
from casadi_gnc.embedded import compare

SLEW = ("huang2020/slew", "funnel_pinv")
ROBUST = ("huang2020/slew", "funnel_robust")
TUNABLE = ("attitude_gain", "rate_gain", "filter_time_constant")
PACKAGES = [
    (*SLEW, "float64", ()),
    (*SLEW, "float32", TUNABLE),
    (*ROBUST, "float64", TUNABLE),
    (*ROBUST, "float32", ()),
]


@pytest.mark.parametrize("case", [SLEW, ROBUST, ("huang2020/detumble", "observer_robust")], ids=str)
def test_vectors_are_the_simulated_flight(case):
    """Truth: the flight engine, which runs the same law by other C. Bad measurements begin at sample 1000."""
    problem, scheme = case
    _, outputs = read_vectors(made(problem, scheme), "float64")
    mission = casadi_gnc.load(problem)
    flown = casadi_gnc.fly(mission.with_timing(duration=999 * mission.timing.sample_period), scheme)
    numbers = compare.as_numbers(np.ascontiguousarray(outputs[:1000, :-1]))
    recorded = np.hstack([flown.block(name) for name in ("force", "wanted", "limited")])
    assert (numbers[:, : recorded.shape[1]].view(np.uint64) == recorded.view(np.uint64)).all()
    assert (outputs[:1000, -1] == flown["status"].astype(int)).all()


#: gcc compiles C++ only where g++ is installed too.
CPP17 = pytest.param(["-x", "c++", "-std=c++17", "-ffp-contract=off"], marks=pytest.mark.tools("g++"), id="c++17")


@pytest.mark.parametrize("language", [pytest.param(C99, id="c99"), CPP17])
@pytest.mark.parametrize("case", PACKAGES, ids=lambda case: f"{case[1]}-{case[2]}")
def test_strict_compilers_have_nothing_to_say(case, language, compiler, tmp_path):
    command = list(compiler.command)
    folder = made(*case)
    for source in [*units(folder), folder / "test" / "replay.c", folder / "test" / "vectors.c"]:
        done = run(*command, *language, *STRICT, "-O2", "-c", f"-I{folder}", source, "-o", tmp_path / "unit.o")
        assert done.returncode == 0, done.stderr[:2000]


@pytest.mark.parametrize("case", PACKAGES, ids=lambda case: f"{case[1]}-{case[2]}")
def test_includes_nothing_but_its_own(case, compiler):
    """Neither in the text that flies nor in what the compiler really reads."""
    folder = made(*case)
    own = {path.name for path in folder.iterdir()}
    for source in units(folder):
        read = run(*compiler.command, *C99, "-H", "-fsyntax-only", source).stderr
        direct = set(re.findall(r'#include [<"](.+?)[>"]', source.read_text())) - own
        assert direct <= {"stdint.h", "string.h"}, direct
        # A system header may bring its own family (bits/..., features.h), never another public one.
        opened = {line.lstrip(". ").rsplit("/", 1)[-1] for line in read.splitlines() if line.startswith((". ", ".. "))}
        strange = opened & {"math.h", "stdio.h", "stdlib.h", "assert.h", "stdbool.h", "errno.h", "float.h"}
        assert not strange, (source.name, strange)


@pytest.mark.parametrize("case", PACKAGES, ids=lambda case: f"{case[1]}-{case[2]}")
def test_has_no_memory_of_its_own(case, tmp_path):
    """No data, no bss, no heap, frames of a fixed size, and one prefix for all it exports."""
    folder = made(*case)
    for source in units(folder):
        product = tmp_path / f"{source.stem}.o"
        done = run("gcc", *C99, "-O2", "-fstack-usage", "-c", source, "-o", product, folder=tmp_path)
        assert done.returncode == 0, done.stderr
        kinds = {line.split()[-2]: line.split()[-1] for line in run("nm", product).stdout.splitlines()}
        assert not set(kinds) & {"D", "d", "B", "b", "C"}, kinds
        for line in run("nm", "-g", product).stdout.splitlines():
            kind, symbol = line.split()[-2:]
            allowed = {"memset", "memcpy", "memcmp", "__stack_chk_fail"}
            assert symbol.startswith("slew_") or (kind == "U" and symbol in allowed), symbol
        usage = product.with_suffix(".su").read_text().splitlines()
        assert usage
        # bounded: the compiler aligns the frame
        assert {line.split("\t")[2] for line in usage} <= {"static", "dynamic,bounded"}


def test_replays_with_make_alone():
    """No Python: an empty environment with a compiler and make."""
    for case in PACKAGES:
        done = run("make", "-s", "test", folder=made(*case), environment={"PATH": os.defpath})
        assert done.returncode == 0, done.stdout + done.stderr
        assert "1024 steps" in done.stdout
        assert " 0 words differ" in done.stdout


def test_replay_notices_one_word(tmp_path):
    folder = copied(made(*SLEW), tmp_path)
    vectors = folder / "test" / "vectors.c"
    text = vectors.read_text()
    word = text.rindex("0x3f")  # in the outputs, which come last
    changed = f"{int(text[word + 4], 16) ^ 1:x}"
    vectors.write_text(text[: word + 4] + changed + text[word + 5 :])
    done = run("make", "-s", "test", folder=folder)
    assert done.returncode != 0
    assert " 1 words differ" in done.stdout


def test_builds_with_cmake(tmp_path):
    cmake = [sys.executable, "-c", "import sys, cmake; sys.exit(cmake.cmake())"]
    folder = made(*ROBUST, "float64", TUNABLE)
    for command in (["-S", folder, "-B", tmp_path, "-DCMAKE_BUILD_TYPE=Release"], ["--build", tmp_path]):
        done = run(*cmake, *command)
        assert done.returncode == 0, done.stdout + done.stderr
    assert run(tmp_path / "slew_replay").returncode == 0


def test_readme_tells_how_to_call_it(tmp_path):
    """The C of the README compiles once the user's own functions exist, and is short."""
    folder = made(*ROBUST, "float64", TUNABLE)
    example = re.search(r"```c\n(.*?)```", (folder / "README.md").read_text(), re.DOTALL).group(1)
    assert len([line for line in example.splitlines() if line.strip()]) <= 20
    declared = "".join(
        f"void {name}(slew_real *);" for name in re.findall(r"\b((?:read|command)_\w+)\(", example)
    ) + "void report(uint32_t); void controller_start(void); void controller_every_period(double);"  # fmt: skip
    unit = tmp_path / "caller.c"
    unit.write_text(example.replace('#include "slew.h"', f'#include "slew.h"\n{declared}'))
    done = run("gcc", "-std=c99", "-Wall", "-Wextra", "-Werror", f"-I{folder}", "-c", unit, "-o", tmp_path / "caller.o")
    assert done.returncode == 0, done.stderr


AGAIN = """
import sys
from casadi_gnc.delivery.packaging import generate
generate("huang2020/slew", __import__("pathlib").Path(sys.argv[1]), scheme="funnel_robust", tunable=["rate_gain"])
"""


@pytest.mark.slow
def test_the_same_bytes_in_other_surroundings(tmp_path):
    first, second = made_in_surroundings(AGAIN, tmp_path)
    assert first == second
    assert len(first) > 10


def test_one_gain_changes_only_its_constants(tmp_path):
    source = (tmp_path / "slew.toml", casadi_gnc.system.assets.folder("problems") / "huang2020" / "slew.toml")
    source[0].write_text(source[1].read_text().replace("rate_gain = 2.0", "rate_gain = 2.01"))
    lines = []
    for problem in (source[0], source[1]):
        text = (made(str(problem), "funnel_pinv") / "slew.c").read_text()
        lines.append(text.splitlines())
    assert len(lines[0]) == len(lines[1])
    different = [(a, b) for a, b in zip(*lines, strict=True) if a != b]
    assert 0 < len(different) < 10
    assert all(a.split("=")[0] == b.split("=")[0] and re.search(r"= -?[0-9.]+;", a) for a, b in different)


TUNING = r"""
#include <math.h>
#include <stdio.h>
#include "replay.h"
static replay_params params;
static replay_state state;
/* Print status of configure and a hash of 200 steps' outputs, after each change of the gains. */
static void fly(const char *what)
{
    unsigned long long hash = 14695981039346656037ull;
    long k;
    int i;
    replay_reset(&state);
    for (k = 0; k < 200; k++) {
        replay_input in;
        replay_output out;
        replay_word words[REPLAY_OUTPUTS];
        replay_load(k, &in);
        (void)replay_step(&state, &params, &in, &out);
        replay_store(&out, words);
        for (i = 0; i < REPLAY_OUTPUTS; i++) hash = (hash ^ words[i]) * 1099511628211ull;
        if (k == 150) printf("%s %.17g\n", what, (double)out.wanted[0]);
    }
    printf("%s hash %llx\n", what, hash);
}
int main(void)
{
    (void)replay_init(&params);
    fly("default");
    params.rate_gain = (slew_real)2.5;
    fly("unconfigured"); /* a change that was not taken into use changes nothing */
    printf("configure %d\n", (int)slew_configure(&params));
    fly("changed");
    params.rate_gain = (slew_real)NAN;
    printf("configure %d\n", (int)slew_configure(&params));
    params.rate_gain = (slew_real)0;
    printf("configure %d\n", (int)slew_configure(&params));
    fly("refused");
    return 0;
}
"""


def test_tunable_gains_stay_variables(tmp_path):
    """Truth: the package of a file with the other gain, in which it is folded (last bits may differ)."""
    folder = made(*SLEW, "float64", TUNABLE)
    unit = tmp_path / "tuning.c"
    unit.write_text(TUNING)
    sources = [*units(folder), folder / "test" / "vectors.c", unit]
    build = ["gcc", *C99, "-O2", f"-I{folder}", f"-I{folder / 'test'}", *sources, "-lm", "-o", tmp_path / "tuning"]
    done = run(*build)
    assert done.returncode == 0, done.stderr
    said = run(tmp_path / "tuning").stdout.splitlines()
    values = dict(line.rsplit(" ", 1) for line in said if not line.startswith("configure"))
    assert [line for line in said if line.startswith("configure")] == ["configure 0", "configure 1", "configure 1"]
    assert values["unconfigured hash"] == values["default hash"]
    assert values["refused hash"] == values["changed hash"] != values["default hash"]
    # The same measurements through CasADi's machine, with the gain folded.
    from casadi_gnc.embedded.machine import Machine
    from casadi_gnc.missions.onboard import describe

    mission = casadi_gnc.load("huang2020/slew").with_scheme("funnel_pinv", rate_gain=2.5)
    inputs, _ = read_vectors(folder, "float64")
    rows = Machine(describe(mission)).replay(compare.as_numbers(inputs[:151]))
    place = describe(mission).outputs.place("wanted").start
    assert float(values["changed"]) == pytest.approx(rows[150, place], rel=1e-9)
    assert float(values["default"]) != pytest.approx(rows[150, place], rel=1e-3)


def test_package_of_a_float_law_has_no_double(tmp_path):
    """In the text: no constant without suffix, no double; what targets link is tested with the targets."""
    text = (made(*SLEW, "float32", TUNABLE) / "slew.c").read_text()
    assert not re.search(r"\bdouble\b", text)
    assert not re.search(r"(?<![\w.])\d+\.\d*(?:e[+-]?\d+)?(?![\w.])", re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL))
