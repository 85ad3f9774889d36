"""Truth: linear programs (scipy) for triples and zonotopes, mixed-integer programs for propellant and bound."""

import importlib.util
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from scipy.optimize import linprog

from casadi_gnc.allocation import AllocationProblem
from casadi_gnc.allocation.joint_pulses import JointPulses
from casadi_gnc.allocation.pulse_optimum import PulseRules, best_pulses
from casadi_gnc.allocation.pulses import Pulse, Valves
from casadi_gnc.allocation.thruster_triples import facets, triples
from casadi_gnc.errors import AllocationError

PERIOD = 0.2
#: Four at each end of a box, which push across, as the columns of torque per force.
ACROSS = [0.8, 0.8, -0.8, -0.8]
BOX = np.array([[*ACROSS, 0, 0, 0, 0], [0, 0, 0, 0, *ACROSS], [-0.48, 0.52, 0.48, -0.52, 0.51, -0.49, -0.51, 0.49]])
VALVES = Valves(((0, 1), (4, 5)), 3)


def columns_of(matrix):
    return [tuple(map(float, column)) for column in np.asarray(matrix).T]


@pytest.mark.parametrize("pairs", [(), ((0, 1), (2, 3), (2, 4))])
def test_some_triple_is_the_answer_of_the_linear_program(pairs, rng):
    """Of each set of valves that may be open together one program; the least of them is the cheapest triple."""
    count = 7
    matrix, prices = rng.normal(size=(3, count)), rng.uniform(0.5, 1.0, count)
    found = triples(columns_of(matrix), list(prices), Valves(pairs))
    sets = [[i for i in range(count) if mask >> i & 1] for mask in range(2**count)]
    allowed = [each for each in sets if not any(i in each and j in each for i, j in pairs)]
    largest = [each for each in allowed if not any(set(each) < set(other) for other in allowed)]
    for _ in range(5):
        effort = matrix @ rng.uniform(0, 1, count)
        programs = [linprog(prices[each], A_eq=matrix[:, each], b_eq=effort) for each in largest]
        right = min((each.fun for each in programs if each.status == 0), default=np.inf)
        impulses = [np.array(each.inverse) @ effort for each in found]
        costs = [prices[list(each.thrusters)] @ v for each, v in zip(found, impulses, strict=True) if v.min() >= -1e-12]
        assert min(costs, default=np.inf) == pytest.approx(right, rel=1e-9)


def gauge(matrix, halves, error):
    """Return the least s such that error = sum A_i d_i, |d_i| <= s halves_i."""
    count = matrix.shape[1]
    sides = [np.hstack([sign * np.eye(count), -halves[:, None]]) for sign in (1, -1)]
    exact = np.hstack([matrix, np.zeros((3, 1))])
    free = [(None, None)] * count + [(0, None)]
    return linprog(np.eye(count + 1)[-1], np.vstack(sides), np.zeros(2 * count), exact, error, bounds=free).fun


def test_facets_bound_the_zonotope(rng):
    for matrix in (rng.normal(size=(3, 5)), BOX):
        halves = rng.uniform(0.5, 2.0, matrix.shape[1])
        normals = np.array(facets(columns_of(matrix), list(halves)))
        for error in rng.normal(size=(5, 3)):
            assert np.abs(normals @ error).max() == pytest.approx(gauge(matrix, halves, error), rel=1e-9)


@pytest.mark.parametrize(
    ("pulses", "most", "valves"),
    [
        ([Pulse(0.02, 0.005)] * 8, [1.0] * 8, VALVES),
        ([Pulse(0.02, 0.0), Pulse(0.0, 0.03), *[Pulse(0.04, 0.04)] * 6], [1.0, 2.0, *[0.7] * 6], Valves()),
    ],
    ids=["a flight's", "unlike ones"],
)
def test_half_a_least_bit_and_the_bound_hold(pulses, most, valves, rng):
    """Sample by sample: rules kept, the error in the zonotope, the impulse accounted for, the bound below the best."""
    prices = list(np.linspace(0.7, 1.0, 8)) if len(set(pulses)) > 1 else [1.0] * 8
    modulation = JointPulses(pulses, most, valves, columns=columns_of(BOX), prices=prices)
    asked, memory = ca.SX.sym("asked", 8), ca.SX.sym("memory", 9)
    step = ca.Function("step", [asked, memory], modulation(asked, modulation.memory.split(memory), PERIOD))
    rules = PulseRules(pulses, PERIOD, valves)
    problem = AllocationProblem(BOX, 0.0, most, effort_weight=prices)
    halves, left = np.array(most) * [max(each.least_on, each.quantum) / 2 for each in pulses], np.zeros(9)
    for number in range(40):
        torque = rng.normal(size=3) * [0.01, 0.1, 0.3][number % 3]
        one = linprog(np.ones(8), A_eq=BOX, b_eq=torque).x
        impulse = BOX @ (one * PERIOD + left[:8])
        told, left = (np.array(each).ravel() for each in step(one, left))
        assert rules.broken(told * PERIOD / most) == []
        error = impulse - BOX @ told * PERIOD
        assert np.abs(BOX @ left[:8] - error).max() < 1e-9
        assert gauge(BOX, halves, error) <= 1 + 1e-8
        if number % 8 == 0:
            best = best_pulses(problem, impulse, rules, error=np.abs(error).sum())
            assert prices @ told * PERIOD - left[8] <= best.propellant + 1e-7
    assert left[8] >= 0


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"pulses": [Pulse(0.02, 0.005, carries=False)] * 8}, "actuator 1 makes pulses without carry"),
        ({"pulses": [*[Pulse(0.02)] * 7, Pulse()]}, "actuator 8 makes pulses without least bit"),
        ({"valves": Valves((), 2)}, "at most 2 valves open, expected 3 or more"),
        ({"columns": columns_of(BOX * [[1], [1], [0]])}, "no three thrusters that may be open together"),
        ({"most": [ca.SX.sym("most"), *[1.0] * 7]}, "set up for fixed numbers; choose each to vary them"),
    ],
)
def test_what_cannot_be_chosen_together_is_refused(changes, told):
    given = {"pulses": [Pulse(0.02, 0.005)] * 8, "most": [1.0] * 8, "columns": columns_of(BOX), "prices": [1.0] * 8}
    with pytest.raises(AllocationError, match=told):
        JointPulses(**{**given, **changes})


def test_too_many_triples_are_refused(monkeypatch):
    monkeypatch.setattr("casadi_gnc.allocation.joint_pulses.MOST_TRIPLES", 11)
    with pytest.raises(
        AllocationError, match="would look at 24 triples of thrusters, expected 11 at most; choose each"
    ):
        JointPulses([Pulse(0.02)] * 8, [1.0] * 8, columns=columns_of(BOX), prices=[1.0] * 8)


@pytest.mark.slow
def test_propellant_is_near_the_mixed_integer_optimum():
    """Three hundred samples of flights, without rules for the valves and with; the worst of a wait is half a bit."""
    path = Path(__file__).parents[1] / "bench" / "pulse_rounding.py"
    spec = importlib.util.spec_from_file_location("bench_pulse_rounding", path)
    assert spec
    assert spec.loader
    bench = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(bench)
    for valves in bench.VALVES.values():
        found = bench.measured(valves, 100, "pinv", "together", least_too=False)
        assert found["instances"] == 100
        assert found["ratio"] <= 1.05
        assert found["largest_error_half_bits"] <= 1
        assert found["bound_N_s"] >= 0.5 * found["best_N_s"]
