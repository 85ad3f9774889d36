"""The descent on functions whose minima are published or follow from calculus, and its journal."""

import json

import numpy as np
import pytest

from casadi_gnc.errors import TuningError
from casadi_gnc.tuning import evolution
from casadi_gnc.tuning.descent import Iterate, Problem, begin, descend
from casadi_gnc.tuning.iterates import Iterates
from casadi_gnc.tuning.state import resumed


def differences(costs):
    def slopes(z):
        step = 1e-6 * np.eye(len(z))
        return ((costs(z + step) - costs(z - step)) / 2e-6).T

    return slopes


def problem(costs, *, worst=True, conditions=lambda z: np.zeros(0), allowed=lambda z: True, slopes=None, reach=5.0):
    ends = np.full(2, reach)
    return Problem(costs, slopes or differences(costs), conditions, allowed, -ends, ends, worst)


def cb2(x):
    """Return the three functions of Charalambous and Conn (1978), CB2: smallest largest value 1.9522245."""
    a, b = x[..., 0], x[..., 1]
    return np.stack([a**2 + b**4, (2 - a) ** 2 + (2 - b) ** 2, 2 * np.exp(b - a)], -1)


def rosenbrock(x):
    a, b = x[..., 0], x[..., 1]
    return (100 * (b - a**2) ** 2 + (1 - a) ** 2)[..., None]


def last(iterates):
    return list(iterates)[-1]


def test_smallest_largest_value_of_a_published_problem():
    posed = problem(cb2)
    found = last(descend(posed, begin(posed, np.array([1.0, -0.1])), 30))
    assert found.done
    assert found.value == pytest.approx(1.9522245, rel=2e-4)


def test_narrow_valley_of_one_function():
    posed = problem(rosenbrock, worst=False)
    found = last(descend(posed, begin(posed, np.array([-1.2, 1.0])), 100))
    assert found.value < 1e-4


def test_mean_of_several_is_what_calculus_says():
    """The mean of squared distances from points is smallest at their centre: (1, 2) of these, with value 8/3."""
    points = np.array([[0.0, 0.0], [2.0, 2.0], [1.0, 4.0]])
    posed = problem(lambda x: ((x[..., None, :] - points) ** 2).sum(-1), worst=False)
    found = last(descend(posed, begin(posed, np.array([-3.0, -3.0])), 30))
    assert found.value == pytest.approx(10.0 / 3.0, rel=2e-4)
    assert found.z == pytest.approx([1.0, 2.0], abs=0.02)


def test_a_condition_that_holds_is_kept_and_met_at_the_minimum():
    """With a <= 0.5 the smallest largest value of CB2 lies on that line; there, by a search along it, at 0.5."""
    posed = problem(cb2, conditions=lambda z: np.array([0.5 - z[0]]))
    found = last(descend(posed, begin(posed, np.array([0.0, -0.1])), 30))
    line = cb2(np.column_stack([np.full(200001, 0.5), np.linspace(-2, 2, 200001)])).max(axis=1).min()
    assert found.z[0] <= 0.5 + 1e-9
    assert found.value == pytest.approx(line, rel=2e-4)


def test_points_that_are_not_allowed_are_never_taken():
    posed = problem(cb2, allowed=lambda z: z[1] < 0.5)
    iterates = list(descend(posed, begin(posed, np.array([1.0, -0.1])), 30))
    assert all(one.z[1] < 0.5 for one in iterates)
    assert iterates[-1].value < cb2(np.array([1.0, -0.1])).max()


@pytest.mark.parametrize("factor", [np.nan, -1.0])
def test_slopes_that_lie_are_replaced_by_sampling(factor, monkeypatch):
    monkeypatch.setattr(evolution, "serves", lambda size: False)
    posed = problem(cb2, slopes=lambda z: factor * differences(cb2)(z))
    iterates = list(descend(posed, begin(posed, np.array([4.0, -4.0])), 40))
    assert "sampling" in {one.how for one in iterates}
    assert iterates[-1].value < 2.3


def stairs(x):
    """Return the narrow valley in stairs of a quarter, flat between them, so slopes say nothing; least 0 at (1, 1)."""
    return np.floor(4 * rosenbrock(x)) / 4


@pytest.mark.packages("cma")
@pytest.mark.parametrize("lying", [stairs, lambda x: -rosenbrock(x)])
def test_slopes_that_lie_are_replaced_by_cma_es(lying):
    """Down to the lowest stair, or to a thousandth along the valley; twice the same with one seed."""
    costs = stairs if lying is stairs else rosenbrock
    posed = problem(costs, worst=False, slopes=differences(lying))
    iterates = list(descend(posed, begin(posed, np.array([-3.0, 4.0])), 40))
    assert "evolution" in {one.how for one in iterates}
    assert iterates[-1].value <= 1e-3
    again = list(descend(posed, begin(posed, np.array([-3.0, 4.0])), 40))
    assert [one.data() for one in again] == [one.data() for one in iterates]


@pytest.mark.packages("cma")
def test_cma_es_keeps_conditions_and_what_is_allowed():
    """In a <= 0.5 and b <= 0.2 the least of the stairs is that of a fine grid there."""
    posed = problem(
        stairs, worst=False, slopes=lambda z: np.full((1, 2), np.nan), conditions=lambda z: np.array([0.5 - z[0]]),
        allowed=lambda z: z[1] <= 0.2,
    )  # fmt: skip
    iterates = list(descend(posed, begin(posed, np.array([-1.0, -1.0])), 40))
    grid = np.stack(np.meshgrid(np.linspace(-5, 0.5, 1101), np.linspace(-5, 0.2, 1041)), -1).reshape(-1, 2)
    assert all(one.z[0] <= 0.5 + 1e-9 and one.z[1] <= 0.2 for one in iterates[1:])
    assert iterates[-1].value == stairs(grid).min()


def test_costs_fall_and_never_rise():
    posed = problem(cb2)
    values = [one.value for one in descend(posed, begin(posed, np.array([4.0, -4.0])), 30)]
    assert values == sorted(values, reverse=True)


def test_an_iterate_goes_on_from_its_data():
    posed = problem(cb2)
    whole = [one.data() for one in descend(posed, begin(posed, np.array([4.0, -4.0])), 8)]
    half = Iterate.of_data(json.loads(json.dumps(whole[2])))
    assert [one.data() for one in descend(posed, half, 8)] == whole[3:]


def test_journal_goes_on_after_its_last_whole_line(tmp_path):
    path = tmp_path / "tuned.toml.journal"
    first = Iterates(path, {"seed": 1, "values": [0.1, 1e-17]})
    first.add(number=1, z=[0.3])
    first.add(number=2, z=[0.1 + 0.2])
    with path.open("a") as file:
        file.write('{"number": 3, "z": [0.')
    again = Iterates(path, {"seed": 1, "values": [0.1, 1e-17]})
    assert again.kept == [{"number": 1, "z": [0.3]}, {"number": 2, "z": [0.1 + 0.2]}]
    again.add(number=3)
    assert Iterates(path, {"seed": 1, "values": [0.1, 1e-17]}).kept[-1] == {"number": 3}
    with pytest.raises(TuningError, match="is the journal of another tuning"):
        Iterates(path, {"seed": 2, "values": [0.1, 1e-17]})
    again.close()
    assert not path.exists()


def test_a_journal_of_other_bytes_is_told(tmp_path):
    path = tmp_path / "tuned.toml.journal"
    path.write_bytes(b"\xff\xfe\n\x80")
    with pytest.raises(TuningError, match="is the journal of another tuning"):
        Iterates(path, {"seed": 1})
    for line in ({}, {"cases": [{}]}, [1], None):
        with pytest.raises(TuningError, match="the last iterate of the journal cannot be read"):
            resumed([line])


@pytest.mark.parametrize("content", ["", '{"se'])
def test_a_journal_without_a_whole_line_begins_anew(tmp_path, content):
    path = tmp_path / "tuned.toml.journal"
    path.write_text(content)
    assert Iterates(path, {"seed": 1}).kept == []
    assert Iterates(path, {"seed": 1}).kept == []
