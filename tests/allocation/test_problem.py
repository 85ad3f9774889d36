"""What an allocation problem refuses, and in which words."""

import numpy as np
import pytest

from casadi_gnc.allocation import AllocationProblem
from casadi_gnc.errors import AllocationError

A = np.array([[1.0, -1.0, 0.5], [0.0, 1.0, 1.0]])
E, D = np.ones((2, 3)), np.zeros((4, 2, 2))
NAN, INF = np.nan, np.inf

REFUSED = [
    ({"effectiveness": [1.0, 2.0]}, r"effectiveness has shape \(2,\), expected 2 dimensions of finite numbers"),
    ({"effectiveness": [[1.0, NAN, 0.0]]}, "effectiveness .* finite numbers"),
    ({"effectiveness": np.zeros((2, 0))}, "effectiveness has shape 2 x 0; there is nothing to allocate"),
    ({"effectiveness": np.zeros((0, 3))}, "effectiveness has shape 0 x 3; there is nothing to allocate"),
    ({"coupling": E}, "coupling and errors describe the uncertainty together; give both or neither"),
    ({"errors": D}, "coupling and errors describe the uncertainty together"),
    ({"coupling": np.ones((2, 4)), "errors": D}, r"errors has shape \(4, 2, 2\) and coupling \(2, 4\); expected"),
    ({"coupling": E, "errors": np.zeros((4, 3, 2))}, r"expected \(vertices, 2, P\) and \(P, 3\)"),
    ({"coupling": E, "errors": np.zeros((0, 2, 2))}, r"errors has shape \(0, 2, 2\)"),
    ({"coupling": E, "errors": np.full((4, 2, 2), INF)}, "errors .* finite numbers"),
    ({"coupling": E * NAN, "errors": D}, "coupling .* finite numbers"),
    ({"lower": [0.0, 1.0]}, r"lower has shape \(2,\), expected 3 finite numbers or one for all"),
    ({"upper": [1.0, NAN, 1.0]}, "upper .* expected 3 finite numbers"),
    ({"upper": INF}, "upper .* expected 3 finite numbers"),
    ({"lower": [0.0, 2.0, 0.0]}, r"actuator 2: lower bound 2.0 exceeds upper 1.0"),
    ({"effort_weight": -1.0}, r"effort_weight must not be negative; its least entry is -1.0"),
    ({"change_weight": [1.0, -2.0, 1.0]}, r"change_weight must not be negative; its least entry is -2.0"),
    ({"effort_weight": INF}, "effort_weight .* finite numbers"),
    ({"max_step": -1e-3}, "max_step must not be negative"),
    ({"max_step": NAN}, "max_step .* expected 3 numbers"),
    ({"preferred": [0.0] * 4}, r"preferred has shape \(4,\)"),
    ({"accuracy_weight": 0.0}, "accuracy_weight is 0.0, expected a positive number"),
    ({"accuracy_weight": NAN}, "accuracy_weight is nan"),
    ({"accuracy_weight": INF}, "accuracy_weight is inf"),
]


@pytest.mark.parametrize(("wrong", "message"), REFUSED)
def test_wrong_data_are_refused(wrong, message):
    with pytest.raises(AllocationError, match=message):
        AllocationProblem(**({"effectiveness": A, "lower": 0.0, "upper": 1.0} | wrong))


def test_what_is_allowed():
    problem = AllocationProblem(A, [0.0, 1.0, -1.0], 1.0, effort_weight=0, change_weight=0, max_step=INF)
    assert problem.count == 3
    assert not problem.is_robust
    assert problem.vertices.shape == (1, 2, 3)
    assert AllocationProblem(A, 0, 1, coupling=E, errors=D).is_robust is False  # no error is no uncertainty
    assert AllocationProblem(A, 0, 1, coupling=E, errors=D + 1).is_robust is True


def test_box_is_amplitude_and_rate_and_amplitude_wins():
    problem = AllocationProblem(A, 0.0, 1.0, max_step=0.25)
    lower, upper = problem.box(np.array([0.5, 0.1, 3.0]))
    assert lower.tolist() == [0.25, 0.0, 1.0]
    assert upper.tolist() == [0.75, 0.35, 1.0]


def test_data_are_copied():
    given = A.copy()
    problem = AllocationProblem(given, 0.0, 1.0)
    given[:] = 0
    assert np.array_equal(problem.effectiveness, A)
