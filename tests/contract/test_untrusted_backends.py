"""Back ends that lie, and that fail: what is certified does not depend on what they say."""

from types import SimpleNamespace

import numpy as np
import pytest
from installed_backends import CASES, answer, is_inside, oracle

from casadi_gnc.allocation import AllocationStatus, backends, solve
from casadi_gnc.allocation.backends import BackEnd, Capability, Found
from casadi_gnc.errors import GncError


@pytest.fixture
def fake(monkeypatch):
    """Register a back end "fake" that finds what a function of the sample says."""

    def register(find, capabilities=Capability.ROBUST | Capability.EXACT):
        home = BackEnd(capabilities, (), (1e-6, 1e-10), lambda problem: SimpleNamespace(find=find))
        monkeypatch.setitem(backends.REGISTRY._registered, "fake", home)

    return register


N, V = 12, 8
UNUSABLE = {
    "nan": np.full(N, np.nan),
    "one nan": np.append(np.zeros(N - 1), np.nan),
    "infinite": np.full(N, np.inf),
    "too short": np.zeros(N - 1),
    "one number": np.array(1e-3),
    "one number in a list": np.array([1e-3]),
    "a matrix": np.zeros((N, 1)),
}


@pytest.mark.parametrize("forces", UNUSABLE.values(), ids=UNUSABLE)
def test_unusable_forces_are_a_failure_and_the_last_ones_stay(fake, forces):
    fake(lambda *sample: Found(forces, np.full(V, 1 / V), claimed=True))
    case = CASES["5 mm, random 0"]
    found = solve(case.problem, case.command, case.previous, backend="fake")
    assert found.status is AllocationStatus.FAILED
    assert found.claimed
    assert np.array_equal(found.forces, case.previous)


WRONG = {
    "zero": np.zeros(N),
    "full": np.full(N, oracle.MAX_FORCE),
    "far outside": np.full(N, 1e6),
    "beyond squares": np.full(N, -1e300),
    "half": np.full(N, oracle.MAX_FORCE / 2),
}
WEIGHTS = {
    "equal": np.full(V, 1 / V),
    "none": None,
    "nan": np.full(V, np.nan),
    "negative": -np.ones(V),
    "zero": np.zeros(V),
    "too many": np.ones(V + 1),
    "huge": np.full(V, 1e300),
}


@pytest.mark.parametrize("forces", WRONG.values(), ids=WRONG)
@pytest.mark.parametrize("weights", WEIGHTS.values(), ids=WEIGHTS)
def test_a_liar_is_not_certified(fake, forces, weights):
    fake(lambda *sample: Found(forces, weights, claimed=True))
    case = CASES["5 mm, random 0"]
    found = solve(case.problem, case.command, case.previous, backend="fake")
    assert found.status is AllocationStatus.NOT_CERTIFIED
    assert is_inside(case, found.forces)
    best = answer("clarabel", "5 mm, random 0")
    assert found.objective - found.duality_gap <= best.objective  # even a liar's bound holds
    assert abs(found.vertex_weights.sum() - 1) < 1e-12


@pytest.mark.parametrize("weights", WEIGHTS.values(), ids=WEIGHTS)
def test_good_forces_are_certified_whatever_the_multipliers(fake, weights):
    best = answer("ipopt", "5 mm, random 0").forces
    fake(lambda *sample: Found(best, weights, claimed=False))
    case = CASES["5 mm, random 0"]
    found = solve(case.problem, case.command, case.previous, backend="fake")
    assert found.status is AllocationStatus.OPTIMAL
    assert not found.claimed


@pytest.mark.parametrize("error", [RuntimeError("it broke"), TypeError("it broke"), ZeroDivisionError("it broke")])
def test_a_back_end_that_raises_is_heard(fake, error):
    def find(*sample):
        raise error

    fake(find)
    with pytest.raises((type(error), GncError), match="it broke"):
        solve(CASES["no error"].problem, oracle.COMMAND, backend="fake")
