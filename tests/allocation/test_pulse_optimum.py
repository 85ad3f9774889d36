"""Truth: every combination of widths of small problems, tried one by one."""

from itertools import product

import numpy as np
import pytest

from casadi_gnc.allocation import AllocationProblem
from casadi_gnc.allocation.pulse_optimum import PulseRules, best_pulses
from casadi_gnc.allocation.pulses import Pulse, Valves
from casadi_gnc.errors import AllocationError

PERIOD = 0.2


def widths_of(pulse):
    """Return every width that a pulse can have."""
    steps = pulse.quantum * np.arange(1, int(PERIOD / pulse.quantum + 1e-9) + 1)
    found = {0.0, PERIOD, *(w for w in steps if w >= pulse.least_on - 1e-12)}
    return sorted(found | ({pulse.least_on} if pulse.least_on else set()))


@pytest.mark.parametrize(
    ("pulse", "valves"),
    [
        (Pulse(0.08, 0.04), Valves()),
        (Pulse(0.0, 0.07), Valves(((0, 1),))),  # nor is the period
        (Pulse(0.04, 0.04), Valves(((0, 1), (1, 2)), 2)),
    ],
    ids=["free", "a pair", "pairs and two open"],
)
def test_no_combination_is_better(pulse, valves, rng):
    for _ in range(2):
        problem = AllocationProblem(rng.normal(size=(2, 4)), 0.0, rng.uniform(0.5, 2.0, 4))
        rules = PulseRules([pulse] * 4, PERIOD, valves)
        wanted = problem.effectiveness @ (problem.upper * rng.uniform(0, 0.1, 4))
        found = best_pulses(problem, wanted, rules)
        assert not rules.broken(found.widths)
        tried = [np.array(one) for one in product(widths_of(pulse), repeat=4) if not rules.broken(one)]
        errors = [np.abs(wanted - problem.effectiveness @ (problem.upper * one)).sum() for one in tried]
        assert found.error == pytest.approx(min(errors), abs=1e-8)
        spent = [problem.upper @ one for one, error in zip(tried, errors, strict=True) if error <= min(errors) + 1e-9]
        assert found.propellant == pytest.approx(min(spent), abs=1e-8)
        assert found.bound <= found.propellant + 1e-8
        loose = best_pulses(problem, wanted, rules, error=0.1)
        cheap = min(problem.upper @ one for one, error in zip(tried, errors, strict=True) if error <= 0.1)
        assert loose.propellant == pytest.approx(cheap, rel=2e-6, abs=1e-8)


def test_broken_rules_are_told():
    rules = PulseRules([Pulse(0.06, 0.03)] * 3, PERIOD, Valves(((0, 1),), 1))
    assert rules.broken([0.0, 0.0, 0.09]) == rules.broken([0.06, 0.0, 0.0]) == rules.broken([PERIOD, 0.0, 0.0]) == []
    told = rules.broken([0.03, 0.1, 0.3])
    assert [part in " ".join(told) for part in ("0.03 s is not from", "0.1 s is no multiple", "0.3 s is not from")]
    assert told[-2:] == ["thrusters 1 and 2 are open together", "3 valves are open, at most 1 may"]


@pytest.mark.parametrize(
    ("made", "told"),
    [
        (lambda: PulseRules([Pulse(0.3)], PERIOD), "least width is 0.3 s, expected 0 to the period, 0.2 s"),
        (lambda: PulseRules([Pulse(0.0, 0.3)], PERIOD), "quantum is 0.3 s, expected 0 to the period, 0.2 s"),
        (lambda: PulseRules([Pulse(), Pulse(0.05, 0.04)], PERIOD), "thruster 2: no whole number of quanta of 0.04 s"),
        (lambda: PulseRules([Pulse()] * 2, PERIOD, Valves(((0, 2),))), "valves 1 and 3 never together"),
        (lambda: PulseRules([Pulse()] * 2, PERIOD, Valves(((1, 1),))), "expected two different ones of 1 to 2"),
        (lambda: PulseRules([Pulse()], PERIOD, Valves((), 0)), "at most 0 valves open, expected 1 or more"),
    ],
)
def test_rules_that_are_none_are_refused(made, told):
    with pytest.raises(AllocationError, match=told):
        made()


def test_an_error_that_cannot_be_kept_is_told():
    problem, rules = AllocationProblem(np.array([[1.0]]), 0.0, 1.0), PulseRules([Pulse(0.08, 0.04)], PERIOD)
    with pytest.raises(AllocationError, match="no pulses keep this error"):
        best_pulses(problem, [1.0], rules, error=0.1)
    with pytest.raises(AllocationError, match="impulse has shape"):
        best_pulses(problem, [1.0, 2.0], rules)
