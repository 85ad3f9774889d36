"""Packages of functions: what is written, what it says of bad inputs, what verification finds, and what is refused."""

import hashlib
import json
import shutil
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from packages import C99, STRICT, made_in_surroundings, needs_target, run, units

import casadi_gnc as gnc
from casadi_gnc.embedded.controller import Options
from casadi_gnc.embedded.flight_function import flight_function
from casadi_gnc.embedded.function_source import function_files
from casadi_gnc.embedded.package import put
from casadi_gnc.errors import GncError

PORTS = {"i": {"unit": "N m s", "initial": [0.25, -0.5]}, "x": {"unit": "rad", "note": "error of attitude"}}


def law() -> ca.Function:
    """Return a controller with an integral, a table and a linear system."""
    x, i, b = ca.MX.sym("x", 2), ca.MX.sym("i", 2), ca.MX.sym("b", 2, 2)
    gain = ca.interpolant("gain", "linear", [[0, 0.5, 2]], [1, 2, 4])
    u = -gain(ca.norm_2(x)) * x - ca.solve(b, i)
    return ca.Function("law", [x, i, b], [u, i + 0.01 * x, ca.norm_2(u)], ["x", "i", "b"], ["u", "i_next", "size"])


@pytest.fixture(scope="module")
def package(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("function") / "law"
    law().save(str(folder.parent / "law.casadi"))
    rng = np.random.default_rng(3)
    rows = rng.normal(size=(60, 6)) + np.array([0, 0, 4, 0, 0, 4])
    rows[20, 3:6] = rows[20, 2] * np.array([1, 1, 1])  # singular
    rows[21, 1] = np.nan
    gnc.generate(law(), folder, state={"i": "i_next"}, ports=PORTS, rate=100, vectors=rows)
    np.save(folder.parent / "rows.npy", rows)
    return folder


def words_of(folder: Path) -> np.ndarray:
    """Return the shipped outputs: u, size, i and the status."""
    from casadi_gnc.delivery.vectors import read_vectors

    words = read_vectors(folder, "float64")[1]
    return np.column_stack([np.ascontiguousarray(words[:, :-1]).view(float), words[:, -1].astype(float)])


def test_the_package_steps_as_the_function_does_and_holds_what_was_good(package):
    function, state, rows = law(), np.array([0.25, -0.5]), np.load(package.parent / "rows.npy")
    held = np.zeros(3)
    for k, (row, found) in enumerate(zip(rows, words_of(package), strict=True)):
        assert found[-1] == {20: 4, 21: 1}.get(k, 0)
        if k not in (20, 21):
            u, after, size = function(row[:2], state, row[2:].reshape(2, 2, order="F"))
            held, state = np.array(ca.vertcat(u, size)).ravel(), np.array(after).ravel()
        # Twenty roundings of a system of condition at most 10.
        np.testing.assert_allclose(found[:3], held, rtol=5e-14)
        np.testing.assert_array_equal(found[3:5], state)


def test_the_package_builds_strictly_as_c_and_as_cpp_and_replays_itself(package, tmp_path):
    for unit in units(package):
        assert not run("gcc", *C99, *STRICT, "-c", unit, "-o", tmp_path / "unit.o").stderr
    done = run("make", "-C", shutil.copytree(package, tmp_path / "copy"), "test")
    assert "60 steps, 6 words each, 0 words differ" in done.stdout, done.stdout + done.stderr


def test_header_and_readme_say_names_shapes_units_and_the_period(package):
    header, readme = (package / "law.h").read_text(), (package / "README.md").read_text()
    assert "law_real x[2]; /* rad, error of attitude */" in header
    assert "law_real b[4]; /* -, 2 x 2, column by column */" in header
    assert "#define LAW_PERIOD_S 0.01" in header
    assert "`i[0]` = 0.25, `i[1]` = -0.5" in readme
    assert "| 4 | `LAW_SINGULAR` |" in readme
    kept = hashlib.sha256((package / "function.json").read_bytes()).hexdigest()
    assert f'#define LAW_IDENTITY "law {kept[:16]} double"' in header


@pytest.mark.slow
def test_verification_rebuilds_the_saved_function_and_demands_the_shipped_words(package, tmp_path):
    found = gnc.verify(package)
    assert found["is_sound"]
    assert [one["exact"] for one in found["comparisons"]][-1] is False  # there are calls in it
    copy = Path(shutil.copytree(package, tmp_path / "copy"))
    kept = json.loads((copy / "function.json").read_text())
    (copy / "function.json").write_text(json.dumps({**kept, "initial": [0.5, 0.0]}))
    with pytest.raises(GncError, match=r"function.json was changed since the package was generated"):
        gnc.verify(copy)


MISUSE = r"""
#include <string.h>
#include "law.h"
int main(void)
{
    law_state state;
    law_input input = {{1.0, 2.0}, {1.0, 0.0, 0.0, 1.0}};
    law_output output;
    int wrong = 0;
    memset(&state, 0xa5, sizeof state);
    memset(&output, 0xa5, sizeof output);
    wrong |= law_step(&state, &input, &output) != LAW_NOT_INITIALISED || output.status != LAW_NOT_INITIALISED;
    wrong |= (output.u[0] != 0.0) << 1;
    wrong |= (law_init(0) != 1) << 2;
    wrong |= (law_init(&state) != 0) << 3;
    wrong |= (law_step(&state, &input, 0) != LAW_NOT_INITIALISED) << 4;
    wrong |= (law_step(0, &input, &output) != LAW_NOT_INITIALISED) << 5;
    wrong |= (law_step(&state, &input, &output) != 0 || output.u[0] == 0.0) << 6;
    state.memory.i[1] += 1e-9;
    wrong |= (law_step(&state, &input, &output) != LAW_STATE_DAMAGED || output.u[0] != 0.0) << 7;
    return wrong;
}
"""


def test_misuse_is_told_and_gives_safe_outputs(package, tmp_path):
    (tmp_path / "misuse.c").write_text(MISUSE)
    build = run(
        "gcc",
        *C99,
        "-DLAW_CHECK_STATE=1",
        f"-I{package}",
        tmp_path / "misuse.c",
        *units(package),
        "-lm",
        "-o",
        tmp_path / "misuse",
    )
    assert build.returncode == 0, build.stderr
    assert run(tmp_path / "misuse").returncode == 0


CLOCK = r"""
#include <math.h>
#include <string.h>
#include "timed.h"
static timed_state state;
static timed_output output;
static uint32_t step(double time, double x)
{
    timed_input input = {time, x};
    return timed_step(&state, &input, &output);
}
int main(void)
{
    uint32_t first = 0;
    (void)timed_init(&state);
    first |= step(3.0, 1.0) | step(3.1, 1.0) | step(3.24, 1.0); /* late by less than half a period */
    if (first != 0 || step(3.24, 1.0) != TIMED_TIME_SHIFTED || step(3.34, 1.0) != 0) return 1;
    if (step(1.0, 1.0) != TIMED_TIME_SHIFTED || step(7.0, 2.0) != TIMED_TIME_SHIFTED || output.y != 8.0) return 2;
    if (step(nan(""), 2.0) != (TIMED_TIME_SHIFTED | TIMED_INPUT_REFUSED) || output.y != 8.0) return 3;
    if (step(7.1, nan("")) != TIMED_INPUT_REFUSED || step(7.2, 1.0) != 0) return 4;
    state.memory.i += 1.0;
    return step(7.3, 1.0) == TIMED_STATE_DAMAGED ? 0 : 5;
}
"""


def test_a_time_that_does_not_advance_by_the_period_is_told(tmp_path):
    """Where the function has a time and a rate, and whoever compiles asks for it; the checksum covers both."""
    time, x, i = (ca.SX.sym(name) for name in ("time", "x", "i"))
    function = ca.Function("timed", [time, x, i], [i + x + 0 * time, i + x], ["time", "x", "i"], ["y", "i_next"])
    own = flight_function(function, state={"i": "i_next"}, rate=10)
    assert own.statuses[32][0] == "TIME_SHIFTED"
    assert 32 not in flight_function(function, state={"i": "i_next"}).statuses
    put(tmp_path, {**function_files(own, Options("timed")), "main.c": CLOCK})
    macros = ["-DTIMED_CHECK_TIME=1", "-DTIMED_CHECK_STATE=1"]
    sources = [tmp_path / "main.c", tmp_path / "timed.c"]
    build = run("gcc", *C99, *STRICT, *macros, "-o", tmp_path / "run", *sources, "-lm")
    assert build.returncode == 0, build.stderr
    assert run(tmp_path / "run").returncode == 0


@pytest.mark.slow
def test_a_package_does_not_depend_on_the_surroundings(tmp_path):
    law().save(str(tmp_path / "law.casadi"))
    first, second = made_in_surroundings(
        f"import sys, casadi_gnc; casadi_gnc.generate({str(tmp_path / 'law.casadi')!r}, sys.argv[1], "
        f"state={{'i': 'i_next'}}, ports={PORTS!r}, real='float32', steps=40)",
        tmp_path,
    )
    assert first == second
    assert len(first) > 10


@pytest.mark.parametrize("real", ["float64", "float32"])
@needs_target("cortex-m4f")
@needs_target("cortex-m7")
@needs_target("rv64")
@needs_target("ppc64")
def test_words_are_the_same_on_targets(tmp_path, real):
    gnc.generate(law(), tmp_path / "law", state={"i": "i_next"}, real=real, steps=100)
    found = gnc.verify(tmp_path / "law", ["cortex-m4f", "cortex-m7", "rv64", "ppc64"])
    assert found["words"] == 0
    assert [row["target"] for row in found["targets"]] == ["cortex-m4f", "cortex-m7", "rv64", "ppc64"]


def one(*names: str) -> ca.Function:
    x = ca.SX.sym("x")
    return ca.Function("one", [x], [x], [names[0]], [names[1]])


def refused(folder: Path) -> dict[str, tuple[dict, str]]:
    """Return what cannot be generated, and what is said."""
    (folder / "text.casadi").write_text("u = -x")
    (folder / "short.csv").write_text("x[0],x[1],b[0],b[1],b[2]\n1,2,3,4,5\n")
    (folder / "row.csv").write_text("x[0],x[1],b[0],b[1],b[2],b[3]\n1,2,3,4,5,6\n1,2,3\n")
    pair = {"state": {"i": "i_next"}}
    return {
        "no function": ({"thing": folder / "text.casadi"}, "text.casadi is no CasADi function .* Function.save"),
        "missing": ({"thing": folder / "none.casadi"}, "none.casadi is no file"),
        "keyword": ({"thing": one("int", "y")}, "the port 'int' is a keyword of C"),
        "status": ({"thing": one("x", "status")}, "an output is called 'status'"),
        "no input": ({"thing": one("x", "y"), "state": {"x": "y"}}, "one has no input beside its state"),
        "pair": ({"state": {"i": "j"}}, "the state pair i:j names the output 'j'; law has u, i_next, size"),
        "shape": ({"state": {"b": "u"}}, "the state pair b:u has shapes 2 x 2 and 2 x 1"),
        "initial": (
            {**pair, "ports": {"i": {"initial": [1, 2, 3]}}},
            "the initial value of i is .*, expected 2 finite",
        ),
        "no state": ({**pair, "ports": {"x": {"initial": 1}}}, "the port x has an initial value and is no state"),
        "port": ({**pair, "ports": {"z": {"unit": "m"}}}, "something is said of the port 'z'"),
        "rate": ({**pair, "rate": 0.0}, "the rate is 0 steps a second"),
        "column": ({**pair, "vectors": folder / "short.csv"}, r"short.csv, line 1: the column 'b\[3\]' is missing"),
        "row": ({**pair, "vectors": folder / "row.csv"}, "row.csv, line 3: 3 entries, expected 6"),
        "scheme": ({**pair, "scheme": "best"}, "scheme is not for a function"),
        "mission": ({"thing": "huang2020/detumble", "rate": 10.0}, "rate is not for a mission"),
        "real": ({**pair, "real": "float16"}, "real is 'float16'"),
    }


@pytest.mark.parametrize("name", [
    "no function", "missing", "keyword", "status", "no input", "pair", "shape", "initial", "no state", "port", "rate",
    "column", "row", "scheme", "mission", "real",
])  # fmt: skip
def test_what_cannot_be_generated_is_told_in_one_sentence_and_nothing_is_written(tmp_path, name):
    options, sentence = refused(tmp_path)[name]
    thing = options.pop("thing", law())
    with pytest.raises(GncError, match=sentence) as told:
        gnc.generate(thing, tmp_path / "out", **options)
    assert "\n" not in str(told.value)
    assert not (tmp_path / "out").exists()
