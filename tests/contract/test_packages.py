"""Every shipped law with every allocation becomes C that strict compilers take and CasADi's machine repeats."""

import re

import numpy as np
import pytest
from packages import run

import casadi_gnc
from casadi_gnc.delivery.packaging import generate
from casadi_gnc.delivery.vectors import fly_package
from casadi_gnc.embedded import compare, package
from casadi_gnc.embedded.controller import Options
from casadi_gnc.embedded.host import HostPackage
from casadi_gnc.embedded.machine import Machine
from casadi_gnc.missions.onboard import describe, sampled
from casadi_gnc.problem_files.document import read, shipped

STRICT = ("-O1", "-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-Wdouble-promotion", "-pedantic", "-Werror")
STEPS, SPOILED = 60, 12


def kinds():
    """Return one shipped scheme of each pair of a law, as printed or not, and a kind of allocation."""
    found = {}
    for name in shipped():
        if read(name).data.get("kind") != "mission":
            continue
        for scheme in casadi_gnc.load(name).schemes:
            law, allocator = type(scheme.law).__name__, type(scheme.actuation.allocator).__name__
            found.setdefault((law, bool(scheme.law.printed), allocator), (name, scheme.name))
    return sorted(found.values())


#: One of each way of allocating; the others are slow.
QUICK = ("huang2020/slew", "shi2020/docking", "tao2019/case1")


@pytest.mark.parametrize(
    ("problem", "scheme"),
    [kind if kind[0] in QUICK else pytest.param(*kind, marks=pytest.mark.slow) for kind in kinds()],
)
def test_every_kind_of_controller(problem, scheme, tmp_path):
    """Float and double in closed loop; double with the C library's functions against the virtual machine."""
    mission = sampled(casadi_gnc.load(problem))
    controller, inputs = describe(mission, scheme), np.zeros(0)
    outputs = controller.outputs.size + 1
    for real, maths in (("float", "gnc"), ("double", "gnc"), ("double", "libm")):
        folder, options = tmp_path / f"{real}-{maths}", Options("controller", real, maths)
        files = package.flight_files(controller, options)
        package.put(folder, {**files, "test/replay.h": package.replay_header(controller, options, STEPS)})
        host = HostPackage(folder, "controller", flags=(*STRICT, *(("-fno-builtin",) if maths == "libm" else ())))
        if maths == "gnc":
            inputs, words = fly_package(mission, mission.scheme(scheme), host, outputs, STEPS, SPOILED)
        else:
            words = host.replay(inputs, outputs)
            machine = Machine(controller).replay(compare.as_numbers(inputs))
            expected = compare.as_words(machine, inputs.dtype)
            expected[:, -1] = machine[:, -1].astype(int)
            assert int((words != expected).sum()) == 0
        assert int(np.bitwise_or.reduce(words[:, -1].astype(np.int64))) & ~sum(controller.statuses) == 0
        assert np.isfinite(compare.as_numbers(np.ascontiguousarray(words[:, :-1]))).all()


#: Rules that generated code does not keep, all advisory but the last, and why.
DEVIATIONS = {
    "2.4": "the tags of the enumerations name what the constants are for",
    "2.5": "the period is a macro for the caller",
    "20.5": "#undef lets the header of a second controller give the allocator other sizes",
    "21.15": "the bits of a number are read by memcpy, as the rules of aliasing allow",
    "8.7": "configure and init are for the caller, who is not in the package",
}


@pytest.mark.tools("cppcheck")
@pytest.mark.parametrize("real", ["float64", "float32"])
def test_generated_code_keeps_the_misra_rules(real, tmp_path):
    """cppcheck's MISRA C:2012 add-on on what we generate; the files of the runtime have their own gate."""
    gains = ("rate_gain", "observer_gain")
    folder = tmp_path / "detumble"
    generate("huang2020/detumble", folder, scheme="observer_robust", real=real, tunable=gains, steps=64, frame="xtce")
    done = run(
        "cppcheck", "--addon=misra", "--std=c99", "--quiet", "--enable=warning,style,performance,portability",
        "--suppress=missingIncludeSystem", "-DUINT64_C(c)=c##ULL", "-DUINT32_C(c)=c##U",
        "--template={file}:{line}: {id}: {message}", "-I.", "detumble.c", "xtce/detumble_telemetry.c",
        folder=folder,
    )  # fmt: skip
    told = done.stdout + done.stderr
    findings = re.findall(r"^(?:xtce/)?(detumble\w*\.[ch]):(\d+): ([\w.-]+): ", told, re.MULTILINE)
    strange = [found for found in findings if found[2].removeprefix("misra-c2012-") not in DEVIATIONS]
    assert done.returncode == 0
    assert findings  # the add-on really ran: a deviation is always found
    assert not strange
