"""The on-board allocator in flight: whole flights in one C call, equal to the cone solver's."""

import numpy as np
import pytest

import casadi_gnc
from casadi_gnc.allocation import SolverInFlight
from casadi_gnc.errors import NoCompilerError
from casadi_gnc.status import StepStatus


def with_cone_solver(mission, scheme):
    from dataclasses import replace

    actuation = mission.scheme(scheme).actuation
    allocator = SolverInFlight(actuation.allocator.problem, "clarabel")
    return mission.with_scheme(scheme, actuation=replace(actuation, allocator=allocator))


@pytest.mark.parametrize("problem", ["huang2020/slew", "huang2020/detumble"])
def test_flight_is_the_cone_solvers(problem):
    """60 s: forces differ within both gaps (1e-8 and 1e-6); saturated tumbling amplifies that."""
    mission = casadi_gnc.load(problem).with_timing(duration=60.0)
    scheme = "funnel_robust" if "slew" in problem else "observer_robust"
    online = casadi_gnc.fly(mission, scheme)
    cone = casadi_gnc.fly(with_cone_solver(mission, scheme))
    calm = "slew" in problem
    assert np.allclose(online["rate"], cone["rate"], atol=2e-9 if calm else 2e-5)
    assert np.allclose(online["achieved"], cone["achieved"], atol=2e-8 if calm else 2e-6)
    assert online.statuses.keys() <= cone.statuses.keys()


@pytest.mark.parametrize("problem", ["huang2020/slew", "huang2020/detumble"])
@pytest.mark.parametrize("mode", ["sampled", "continuous"])
def test_whole_flights_are_certified(problem, mode):
    mission = casadi_gnc.load(problem)
    scheme = "funnel_robust" if "slew" in problem else "observer_robust"
    flight = casadi_gnc.fly(mission, scheme, mode=mode)
    assert not {StepStatus.ALLOCATION_INEXACT, StepStatus.ALLOCATION_FAILED} & flight.statuses.keys()
    assert np.all(flight["duality_gap"] <= 1.01e-8 * flight["allocation_cost"] + 1e-13)


def test_certificate_is_recomputed_from_the_problem():
    """The gap in the record is that of `AllocationProblem.gap` on the recorded forces."""
    mission = casadi_gnc.load("huang2020/slew").with_timing(duration=30.0)
    flight = casadi_gnc.fly(mission, "funnel_robust")
    problem = mission.scheme("funnel_robust").actuation.allocator.problem
    previous = np.zeros(12)
    for k in range(301):
        force, command = flight["force"][k], flight["limited"][k]
        cost = problem.objective(force, command, previous)
        assert flight["allocation_cost"][k] == pytest.approx(cost, rel=1e-9, abs=1e-18)
        previous = force


@pytest.mark.parametrize("mode", ["sampled", "continuous"])
def test_virtual_machine_calls_the_same_allocator(mode):
    mission = casadi_gnc.load("huang2020/detumble").with_timing(duration=100.0, mode=mode)
    machine = casadi_gnc.fly(mission, "observer_robust", engine="vm")
    compiled = casadi_gnc.fly(mission, "observer_robust", maths="libm")
    assert np.array_equal(machine.samples.view(np.uint64), compiled.samples.view(np.uint64))


def test_second_flight_repeats_the_first():
    mission = casadi_gnc.load("huang2020/slew").with_timing(duration=50.0)
    flights = [casadi_gnc.fly(mission, "funnel_robust") for _ in range(2)]
    assert np.array_equal(flights[0].samples, flights[1].samples)


def test_without_a_compiler_the_cone_solver_allocates(monkeypatch):
    from casadi_gnc.system import compilers

    def none():
        raise NoCompilerError("no C compiler found")

    monkeypatch.setattr(compilers, "find", none)
    mission = casadi_gnc.load("huang2020/slew").with_timing(duration=2.0)
    flight = casadi_gnc.fly(mission, "funnel_robust")
    assert flight.made["engine"] == "vm"
    assert any("no C compiler found" in note for note in flight.notes)
    assert np.all(np.isfinite(flight.samples))
