"""What cppcheck's MISRA add-on finds in packages is what their DEVIATIONS.md says, with a reason each."""

import re
import subprocess
from pathlib import Path

import casadi as ca
import pytest
from packages import made
from printed_functions import everything

from casadi_gnc.embedded.controller import Options
from casadi_gnc.embedded.deviations import DEVIATIONS, deviations
from casadi_gnc.embedded.flight_function import flight_function
from casadi_gnc.embedded.frames import package_files
from casadi_gnc.embedded.packable import PackableFunction
from casadi_gnc.embedded.package import put

OPTIONS = ("--addon=misra", "--std=c99", "--quiet", "--enable=style", "--suppress=missingIncludeSystem")
MEANING = ("-DUINT64_C(c)=c##ULL", "-DUINT32_C(c)=c##U")


def found(folder: Path, name: str) -> set[str]:
    """Return the rules that the add-on says are broken in what was printed."""
    command = ["cppcheck", *OPTIONS, "--template={file} {id}", *MEANING, "-I.", f"{name}.c"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True)
    return set(re.findall(rf"^{name}\.[ch] misra-c2012-([\d.]+)$", done.stderr, re.MULTILINE))


def said(folder: Path) -> set[str]:
    """Return the rules of the printed C that a package says it breaks."""
    text = (folder / DEVIATIONS).read_text().split("## In what is the same")[0]
    return set(re.findall(r"^\| ([\d.]+) \| (?:required|advisory) \| .{20,} \|$", text, re.MULTILINE))


def function_package(folder: Path, function: ca.Function) -> Path:
    """Write what flies of a function's package."""
    options = Options(function.name())
    put(folder, package_files(PackableFunction(flight_function(function)), options))
    return folder


@pytest.mark.slow
@pytest.mark.tools("cppcheck")
def test_each_rule_that_is_broken_is_written_down_and_each_that_is_written_down_is_broken(tmp_path):
    of_function = function_package(tmp_path / "everything", everything())
    of_mission = made("huang2020/slew", "funnel_robust", "float64", ("attitude_gain", "rate_gain"), steps=40)
    rules = found(of_function, "everything") | found(of_mission, "slew")
    assert said(of_function) == said(of_mission)
    assert rules == said(of_function)


def test_only_the_runtime_that_a_package_carries_is_told_of():
    with_allocator = deviations("law", ["law.c", "law_allocate_setup.c", "gnc_math.h"])
    without = deviations("law", ["law.c", "gnc_math.h"])
    assert "`gnc_allocate_setup.c: problem_is_sound`" in with_allocator
    assert "gnc_allocate" not in without
    assert "gnc_math.h" in without
