"""Two engines, one text: the same words."""

import hashlib

import numpy as np
import pytest

import casadi_gnc
from casadi_gnc.missions import tapes
from casadi_gnc.missions.engines import CompiledEngine
from casadi_gnc.missions.flying import begin
from casadi_gnc.system import compilers

FLIGHTS = [
    ("huang2020/detumble", "damping_pinv"),
    ("huang2020/detumble", "observer_pinv"),
    ("huang2020/slew", "funnel_pinv"),
    ("huang2020/slew", "pd_pinv"),
]


def words_that_differ(a: np.ndarray, b: np.ndarray) -> int:
    return int((a.view(np.uint64) != b.view(np.uint64)).sum())


@pytest.mark.parametrize("mode", ["sampled", "continuous"])
@pytest.mark.parametrize(("problem", "scheme"), FLIGHTS)
def test_virtual_machine_and_c_agree_over_a_whole_flight(problem, scheme, mode):
    """With the C library's functions on both sides every word of every sample is the same."""
    mission = casadi_gnc.load(problem)
    machine = casadi_gnc.fly(mission, scheme, engine="vm", mode=mode)
    compiled = casadi_gnc.fly(mission, scheme, engine="c", maths="libm", mode=mode)
    assert compiled.made["engine"] == "c"
    assert machine.samples.shape[0] == mission.timing.samples >= 10001
    assert words_that_differ(machine.samples, compiled.samples) == 0
    assert machine.metrics == compiled.metrics
    assert machine.statuses == compiled.statuses


def test_virtual_machine_and_c_agree_with_a_solver_in_the_loop():
    mission = casadi_gnc.load("huang2020/slew").with_timing(duration=20.0)
    machine = casadi_gnc.fly(mission, "funnel_robust", engine="vm")
    compiled = casadi_gnc.fly(mission, "funnel_robust", maths="libm")
    assert words_that_differ(machine.samples, compiled.samples) == 0


def flown(mission, scheme, compiler: compilers.Compiler, optimise: str, maths="gnc") -> np.ndarray:
    chosen = mission.scheme(scheme)
    built = tapes.tapes_of(mission, chosen)
    engine = CompiledEngine(mission, chosen, built, maths, compiler=compiler, optimise=optimise)
    carried = begin(mission, built, engine)
    record = np.zeros((mission.timing.samples, built.row.size))
    assert engine.run(carried, 0, mission.timing.samples, 1, record) == mission.timing.samples
    return record


@pytest.mark.parametrize("optimise", ["-O0", "-O1", "-O2", "-O3"])
@pytest.mark.parametrize("mode", ["sampled", "continuous"])
def test_gnc_math_gives_one_result_whatever_the_compiler(compiler, optimise, mode, reference):
    mission = casadi_gnc.load("huang2020/slew").with_timing(mode=mode)
    record = flown(mission, "funnel_pinv", compiler, optimise)
    assert hashlib.sha256(record.tobytes()).hexdigest() == reference(mode)


@pytest.fixture(scope="module")
def reference():
    """Return the hash of the same flight by the first compiler found, at -O2."""
    known = {}

    def of(mode: str) -> str:
        if mode not in known:
            mission = casadi_gnc.load("huang2020/slew").with_timing(mode=mode)
            record = flown(mission, "funnel_pinv", compilers.find(), "-O2")
            known[mode] = hashlib.sha256(record.tobytes()).hexdigest()
        return known[mode]

    return of


def test_gnc_math_differs_from_libm_only_in_last_bits(detumble):
    """A stable flight forgets last bits: what they change stays at the rounding level."""
    ours = casadi_gnc.fly(detumble, "observer_pinv", maths="gnc")
    theirs = casadi_gnc.fly(detumble, "observer_pinv", maths="libm")
    assert np.allclose(ours["rate"], theirs["rate"], atol=1e-12)
    assert np.allclose(ours["achieved"], theirs["achieved"], atol=1e-12)
