"""Packages of allocation files: the words of the Python back end, faults at run time, other data, what is refused."""

import hashlib
from pathlib import Path

import numpy as np
import pytest
from packages import C99, STRICT, made_in_surroundings, needs_target, run, units

import casadi_gnc as gnc
from casadi_gnc.allocation import AllocationStatus, Allocator
from casadi_gnc.delivery.vectors import read_vectors
from casadi_gnc.embedded import boards, targets
from casadi_gnc.errors import GncError
from casadi_gnc.problem_files.allocation_file import load_allocation

FILE = """format = 1
kind = "allocation"
title = "Eight thrusters"
sample_period_s = 0.1

[matrices]
effectiveness = {matrix}
lower = 0.0
upper = 2.0
max_rate_per_s = 5.0
units = ["N m", "N m", "N m"]

[weights]
effort = 0.01
accuracy = 100.0
{options}"""


def written(folder: Path, options: str = "") -> Path:
    """Return a file of eight thrusters in random directions."""
    matrix = np.round(np.random.default_rng(8).normal(size=(3, 8)), 3).tolist()
    (folder / "eight.toml").write_text(FILE.format(matrix=matrix, options=options))
    return folder / "eight.toml"


@pytest.fixture(scope="module")
def package(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("allocator")
    rng = np.random.default_rng(2)
    rows = "\n".join(",".join(map(repr, row)) for row in rng.normal(size=(100, 3)).tolist())
    (folder / "commands.csv").write_text(f"u1,u2,u3\n{rows}\n")
    priorities = "[options]\npriorities = [1, 1, 2]\n"
    gnc.generate(written(folder, priorities), folder / "eight", commands=folder / "commands.csv")
    return folder / "eight"


def numbers(package: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return inputs, outputs and status of the shipped samples."""
    inputs, outputs = read_vectors(package, "float64")
    return inputs.view(float), np.ascontiguousarray(outputs[:, :-1]).view(float), outputs[:, -1].astype(np.int64)


def test_words_are_those_of_the_python_back_end_and_faults_keep_the_certificate(package):
    case = load_allocation(package / "problem.toml")
    allocator, count = Allocator(case.problem, "online"), case.problem.count
    inputs, outputs, status = numbers(package)
    for row, found, told in zip(inputs, outputs, status, strict=True):
        command, health, held = row[:3], row[3 : 3 + count], row[3 + count :]
        lower, upper = case.problem.box(allocator.previous)
        lower, upper = (np.where(health == 0, one, np.where(health == 2, held, 0.0)) for one in (lower, upper))
        answer = allocator.solve(command * case.row_scale, box=(lower, upper))
        if told & 2:
            assert answer.status is AllocationStatus.BAD_COMMAND
            allocator.previous = found[:count]
            continue
        assert told == 0
        assert answer.status.is_certified
        assert (found[:count].view(np.uint64) == answer.forces.view(np.uint64)).all()
        assert found[count + 1] <= 1e-6 * found[count]
    dead, stuck = inputs[:, 3 : 3 + count] == 1, inputs[:, 3 : 3 + count] == 2
    assert dead.any()
    assert stuck.any()
    assert not outputs[:, :count][dead].any()
    assert (outputs[:, :count][stuck] == inputs[:, 3 + count :][stuck]).all()
    # The same commands with a fault have another answer.
    assert (np.abs(outputs[100:164, :count] - outputs[:64, :count]).max(axis=1) > 0.01).mean() > 0.5


def test_the_running_code_can_say_what_it_is(package):
    source = hashlib.sha256((package / "eight.c").read_bytes()).hexdigest()
    assert f'#define EIGHT_IDENTITY "eight {source[:16]} double"' in (package / "eight.h").read_text()


@pytest.mark.slow
def test_the_package_builds_strictly_and_is_sound(package, tmp_path):
    for unit in units(package):
        assert not run("gcc", *C99, *STRICT, "-c", unit, "-o", tmp_path / "unit.o").stderr
    found = gnc.verify(package)
    assert found["is_sound"]
    assert found["comparisons"][-1]["what"].endswith("against the back end online of casadi-gnc allocate")
    assert found["comparisons"][-1]["words"] == 0


@pytest.mark.slow
def test_a_package_does_not_depend_on_the_surroundings(tmp_path):
    script = f"import sys, casadi_gnc; casadi_gnc.generate({str(written(tmp_path))!r}, sys.argv[1])"
    first, second = made_in_surroundings(script, tmp_path)
    assert first == second
    assert len(first) > 10


CHANGED = r"""
#include "eight.h"
#include <math.h>
int main(void)
{
    static eight_params params, before;
    static eight_state state;
    eight_input input = {{0.3, -0.2, 0.1}, {0}, {0}};
    eight_output output, other;
    int wrong = eight_step(&state, &params, &input, &output) != EIGHT_NOT_INITIALISED;
    eight_reset(0, &params);
    eight_reset(&state, 0);
    if (eight_init(0) != 1 || eight_configure(0) != 1) return 94;
    wrong |= (eight_init(&params) != 0) << 1;
    wrong |= (eight_step(&state, &params, &input, &output) != EIGHT_NOT_INITIALISED) << 2;
    eight_reset(&state, &params);
    if (eight_step(&state, &params, &input, &output) != EIGHT_NOT_CONFIGURED || output.force[0] != 0.0) return 96;
    if (eight_configure(&params) != 0) return 95;
    eight_reset(&state, &params);
    wrong |= (eight_step(&state, &params, &input, &output) != 0) << 3;
    params.problem.m1[3] = -1.0; /* refused: what is used stays */
    wrong |= (eight_configure(&params) != 1) << 4;
    eight_reset(&state, &params);
    (void)eight_step(&state, &params, &input, &other);
    wrong |= (other.force[0] != output.force[0]) << 5;
    params.problem.m1[3] = 0.01;
    params.upper[0] = 0.0;
    params.lower[0] = 0.0;
    wrong |= (eight_configure(&params) != 0) << 6;
    eight_reset(&state, &params);
    (void)eight_step(&state, &params, &input, &other);
    wrong |= (other.force[0] != 0.0 || other.status != 0) << 7;
    input.health[1] = 7;
    if ((eight_step(&state, &params, &input, &other) & EIGHT_HEALTH_REFUSED) == 0 || other.force[1] != 0.0) return 99;
    state.work.command[0] = -state.work.command[0] - 1.0;
    if (eight_step(&state, &params, &input, &other) != EIGHT_STATE_DAMAGED || other.force[1] != 0.0) return 97;
    params.upper[0] = nan("");
    if (eight_configure(&params) != 1 || eight_step(&state, 0, &input, &other) != EIGHT_NOT_INITIALISED) return 98;
    (void)before;
    return wrong;
}
"""


def test_changed_data_are_taken_or_refused_as_a_whole_and_misuse_is_told(package, tmp_path):
    (tmp_path / "changed.c").write_text(CHANGED)
    done = run(
        "gcc",
        *C99,
        "-DEIGHT_CHECK_STATE=1",
        "-DEIGHT_CONFIGURE_FIRST=1",
        f"-I{package}",
        tmp_path / "changed.c",
        *units(package),
        "-lm",
        "-o",
        tmp_path / "changed",
    )
    assert done.returncode == 0, done.stderr
    assert run(tmp_path / "changed").returncode == 0


@pytest.mark.slow
@needs_target("cortex-m4f")
@needs_target("cortex-m7")
@needs_target("ppc64")
def test_words_are_the_same_on_targets(tmp_path):
    for real, target in (("float32", "cortex-m4f"), ("float64", "cortex-m7")):
        gnc.generate(written(tmp_path), tmp_path / real, real=real)
        assert gnc.verify(tmp_path / real, [target])["words"] == 0
        _, expected = read_vectors(tmp_path / real, real)
        assert (targets.measure(tmp_path / real, "eight", boards.find("ppc64")).outputs == expected).all()


PROPELLANT = '[options]\nobjective = "propellant"\npriorities = [0, 1, 1]\n'
LIMIT = '[[limit]]\nname = "bus"\ncoefficients = [1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0]\nmost = 3.0\n'


@pytest.mark.parametrize(
    ("options", "given", "sentence"),
    [
        ("[options]\nkeep_direction = true\n", {}, "eight: keep_direction is solved by linear programs"),
        ("[options]\nleast_force_N = 0.1\n", {}, "eight: least_force_N is solved by a search"),
        (PROPELLANT, {}, 'eight: objective = "propellant" is solved by linear programs'),
        (PROPELLANT + LIMIT, {}, 'eight: objective = "propellant" is solved by linear programs'),
        (LIMIT, {}, "limit"),
        ("", {"rate": 10.0}, "rate is not for an allocation file"),
        ("", {"commands": "short.csv"}, "short.csv, line 1: column u3 is missing"),
        ("", {"name": "int"}, "'int' is a keyword"),
    ],
)
def test_what_does_not_fly_is_told_and_nothing_is_written(tmp_path, monkeypatch, options, given, sentence):
    monkeypatch.chdir(tmp_path)
    Path("short.csv").write_text("u1,u2\n1,2\n")
    with pytest.raises(GncError, match=sentence):
        gnc.generate(written(tmp_path, options), tmp_path / "out", **given)
    assert not (tmp_path / "out").exists()
