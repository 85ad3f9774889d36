"""The generated flight as a C programmer meets it: strict compilers, two of them, no warning."""

import subprocess

import pytest

import casadi_gnc
from casadi_gnc.allocation import online
from casadi_gnc.missions import tapes
from casadi_gnc.missions.engines import flight_source
from casadi_gnc.system import assets

STRICT = ["-std=c99", "-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-Wmissing-prototypes", "-pedantic", "-Werror"]
FLIGHTS = [
    ("huang2020/detumble", "damping_pinv"),
    ("huang2020/detumble", "observer_robust"),
    ("huang2020/slew", "funnel_pinv"),
    ("huang2020/slew_as_printed", "funnel_robust"),
]


@pytest.mark.parametrize("maths", ["gnc", "libm"])
@pytest.mark.parametrize("mode", ["sampled", "continuous"])
@pytest.mark.parametrize(("problem", "scheme"), FLIGHTS)
def test_strict_compilers_have_nothing_to_say(compiler, problem, scheme, mode, maths, tmp_path):
    mission = casadi_gnc.load(problem).with_timing(mode=mode)
    chosen = mission.scheme(scheme)
    built = tapes.tapes_of(mission, chosen)
    unit = tmp_path / "flight.c"
    unit.write_text(flight_source(mission, chosen, built, maths))
    flags = [] if built.symbolic else list(online.flags(chosen.actuation.allocator.problem))
    include = f"-I{assets.folder('codegen') / 'runtime'}"
    done = subprocess.run(
        [*compiler.command, *STRICT, *flags, include, "-O1", "-c", str(unit), "-o", str(tmp_path / "flight.o")],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr[:2000]


def test_source_is_the_same_every_time():
    """No date, no path, no order of a set: two builds of one mission give one text."""
    texts = []
    for _ in range(2):
        mission = casadi_gnc.load("huang2020/slew")
        chosen = mission.scheme("funnel_robust")
        texts.append(flight_source(mission, chosen, tapes.tapes_of(mission, chosen)))
    assert texts[0] == texts[1]
    assert "MIT-0" in texts[0]


def test_one_gain_changes_only_constants():
    mission = casadi_gnc.load("huang2020/detumble")
    changed = mission.with_scheme("observer_pinv", rate_gain=0.41)
    lines = []
    for one in (mission, changed):
        chosen = one.scheme("observer_pinv")
        lines.append(flight_source(one, chosen, tapes.tapes_of(one, chosen)).splitlines())
    assert len(lines[0]) == len(lines[1])
    different = [(a, b) for a, b in zip(*lines, strict=True) if a != b]
    assert different
    assert all(a.split("=")[0] == b.split("=")[0] for a, b in different)
