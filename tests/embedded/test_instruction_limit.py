"""A limit of instructions that a package is generated with: the number needed is told, and is enough."""

import re

import casadi as ca
import pytest
from packages import needs_target
from typer.testing import CliRunner

import casadi_gnc as gnc
from casadi_gnc.cli.main import app
from casadi_gnc.errors import PackageError

FILE = """format = 1
kind = "allocation"
title = "Four thrusters"

[matrices]
effectiveness = [[1.0, -1.0, 0.5, -0.5]]
lower = 0.0
upper = 2.0
units = ["N m"]

[weights]
effort = 0.01
accuracy = 100.0
"""


def law() -> ca.Function:
    x = ca.SX.sym("x", 3)
    return ca.Function("law", [x], [ca.sin(x) * x[0]], ["x"], ["u"])


def needed(thing, folder, limit: int) -> int:
    """Return the number that a refusal names."""
    with pytest.raises(PackageError, match=f"at_most_instructions is {limit}; allow ") as told:
        gnc.generate(thing, folder, target=["cortex-m7"], at_most_instructions=limit)
    assert not list(folder.parent.glob(f"*{folder.name}*"))
    (number,) = re.findall(r"a step may take (\d+) on cortex-m7", str(told.value))
    assert str(told.value).endswith(f"allow {number}")
    return int(number)


@pytest.mark.slow
@needs_target("cortex-m7")
def test_the_number_needed_is_told_and_is_the_least_that_is_taken(tmp_path):
    number = needed(law(), tmp_path / "law", 10)
    assert needed(law(), tmp_path / "law", number - 1) == number
    gnc.generate(law(), tmp_path / "law", target=["cortex-m7"], at_most_instructions=number)
    (row,) = gnc.verify(tmp_path / "law", ["cortex-m7"])["targets"]
    assert row["instructions_bound"] == number


@pytest.mark.slow
@needs_target("cortex-m7")
def test_an_allocator_has_a_bound_to_hold(tmp_path):
    (tmp_path / "four.toml").write_text(FILE)
    assert needed(tmp_path / "four.toml", tmp_path / "out", 20_000) > 100_000


@pytest.mark.slow
@needs_target("rv64")
def test_a_target_without_a_bound_is_refused(tmp_path):
    told = "a step has no proved bound on rv64: only the instructions of Cortex-M are read; leave"
    with pytest.raises(PackageError, match=told):
        gnc.generate(law(), tmp_path / "law", target=["rv64"], at_most_instructions=10**6)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (["--at-most-instructions", "0", "--target", "cortex-m7"], "at_most_instructions is 0, expected 1 or more"),
        (["--at-most-instructions", "9"], "counted on a target; name one, as cortex-m7"),
        (["--at-most-instructions", "9", "--format", "fmu"], "leave out what is for others"),
    ],
)
def test_a_limit_that_cannot_be_held_is_told(tmp_path, options, told):
    done = CliRunner().invoke(app, ["generate", "huang2020/allocation", "--out", str(tmp_path / "out"), *options])
    assert done.exit_code != 0
    assert told in str(done.exception)
    assert not list(tmp_path.iterdir())
