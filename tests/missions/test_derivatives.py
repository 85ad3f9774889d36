"""Derivatives of operations, of largest and least, of formulas and of metrics.

Truths: differences of the values themselves, extrapolated (Richardson), and what is known of soft maxima.
"""

import casadi as ca
import numpy as np
import pytest
from differences import richardson

from casadi_gnc.mathematics.linearised import linearised
from casadi_gnc.mathematics.soft import slack, soft_maximum, soft_minimum
from casadi_gnc.missions.requirements import Requirement, evaluating
from casadi_gnc.missions.scheme import Metric
from casadi_gnc.missions.sensitivities.outcomes import _OfMetric
from casadi_gnc.missions.sensitivities.robustness import weighed_robustness
from casadi_gnc.signals import Layout, Signal

X = ca.SX.sym("x", 3)
#: Every operation that a tape may have, at a point where it is smooth.
OPERATIONS = [
    X[0] + 2 * X[1] - X[2], X[0] * X[1] * X[2], X[0] / X[1], -X[0], X[0] ** 2, 1 / X[1], 2 * X[0],
    ca.exp(X[0]), ca.log(X[1]), ca.expm1(X[0]), ca.log1p(X[1]), X[1] ** X[0], X[1] ** 2.5, ca.sqrt(X[1]),
    ca.sin(X[0]), ca.cos(X[0]), ca.tan(X[0]), ca.asin(X[0]), ca.acos(X[0]), ca.atan(X[0]), ca.atan2(X[0], X[2]),
    ca.sinh(X[0]), ca.cosh(X[0]), ca.tanh(X[0]), ca.asinh(X[0]), ca.acosh(1 + X[1]), ca.atanh(X[0]),
    ca.fabs(X[2]), ca.floor(X[1]) * X[0], ca.ceil(X[1]) * X[0], ca.fmod(X[1], X[0]), ca.sign(X[2]) * X[1],
    ca.copysign(X[0], X[2]), ca.hypot(X[0], X[1]), ca.fmin(X[0], X[1]), ca.fmax(X[0], X[1]),
    ca.if_else(X[0] < X[1], X[0] * X[2], ca.sqrt(X[0] - X[1])), ca.if_else(X[0] > X[1], ca.log(X[2]), X[2]),
]  # fmt: skip
AT = np.array([0.3, 1.7, -0.6])


def finite(column):
    values = np.array(column).ravel()
    return np.where(np.isfinite(values), values, 0.0)


@pytest.mark.parametrize("one", OPERATIONS, ids=str)
def test_every_operation_has_its_derivative(one):
    tape = ca.Function("f", [X], [one], ["x"], ["y"])
    three = linearised(tape, ())
    value, partials = three.values(AT)
    assert float(value) == float(tape(AT))
    back = np.array(three.reverse(finite(partials), 1.0)).ravel()
    for i, direction in enumerate(np.eye(3)):
        slope, _ = richardson(lambda x: float(tape(x)), AT, direction, 1e-2)
        assert float(three.forward(finite(partials), direction)) == pytest.approx(slope, rel=1e-7, abs=1e-8)
        assert back[i] == pytest.approx(slope, rel=1e-7, abs=1e-8)


def test_a_root_at_zero_and_a_branch_that_was_not_taken_leave_no_mark():
    for one in (ca.sqrt(ca.sumsqr(X)), ca.if_else(X[0] < 1, X[1], ca.log(X[0]) / X[0])):
        three = linearised(ca.Function("f", [X], [one], ["x"], ["y"]), ())
        _, partials = three.values([0, 0, 0])
        gradient = np.array(three.reverse(finite(partials), 1.0)).ravel()
        assert np.isfinite(gradient).all()


def test_what_stays_still_has_no_derivative():
    tape = ca.Function("f", [X, ca.SX.sym("t")], [X[0] * X[1], X[0] > 1], ["x", "t"], ["y", "flags"])
    three = linearised(tape, ("t", "flags"))
    assert three.moving == ("x",)
    assert three.forward.name_out() == ["y"]
    assert three.forward.name_in() == ["partials", "x"]


def test_soft_maxima_lie_where_they_are_said_to():
    numbers = np.random.default_rng(1).standard_normal(50)
    for temperature in (1e-9, 1e-3, 0.1, 3.0):
        value, counts = soft_maximum(numbers, temperature)
        assert 0 <= value - numbers.max() <= slack(50, temperature)
        assert counts.sum() == pytest.approx(1)
        low, _ = soft_minimum(numbers, temperature)
        assert 0 <= numbers.min() - low <= slack(50, temperature)
    assert soft_maximum(numbers, 0.0)[0] == numbers.max()


FORMULAS = [
    "always(x[1] <= 2)", "eventually[1, 4](x[1] > 1) and not x[2] > 3", "always[0, 9](eventually[0, 3](x[1] >= 0))",
    "held[2](x[1] < 3) or always[3, 5](x[2] < 1)", "(x[1] < 1.5) until[1, 6] (x[2] > 0.5)",
    "not ((x[1] < 1.5) until[0, 6] (x[2] > 0.5))", "always[3, 20](held[2](x[1] < 3) until[2, 5] (x[2] > 1))",
]  # fmt: skip
LAYOUT = Layout((Signal("time"), Signal("x", 2)))


@pytest.mark.parametrize("formula", FORMULAS)
def test_robustness_counts_its_margins(formula):
    row = LAYOUT.symbol("row")
    bound = Requirement("A", formula=formula).bind(LAYOUT, row, 1.0)
    margins = np.random.default_rng(7).standard_normal((len(bound.margins), 25))
    exact, counts, none = weighed_robustness(bound.tree, margins, 0.0)
    assert none == 0
    assert exact == evaluating.robustness(bound.tree, margins)[0]
    assert set(np.abs(counts).ravel()) == {0, 1}
    for temperature in (1e-6, 0.2):
        value, counts, most = weighed_robustness(bound.tree, margins, temperature)
        assert abs(value - exact) <= most
        direction = np.random.default_rng(8).standard_normal(margins.shape)
        slope = richardson(
            lambda m, T=temperature: weighed_robustness(bound.tree, m, T)[0], margins, direction, temperature / 20
        )[0]
        assert float((counts * direction).sum()) == pytest.approx(slope, rel=1e-5, abs=1e-7)


@pytest.mark.parametrize("norm", ["max", "two"])
@pytest.mark.parametrize("kind", ["settling", "reaching", "peak", "least", "final", "mean", "sample_sum"])
def test_metrics_count_their_samples(kind, norm):
    rng = np.random.default_rng(3)
    asked = np.exp(-np.arange(20.0) / 6)[:, None] * (1 + 0.2 * rng.random((20, 2)))
    metric = Metric("m", kind, "x", threshold=0.6, norm=norm, after=1.0, until=8.0)
    outcome = _OfMetric(metric, LAYOUT, 0.5)
    exact = outcome.weigh(asked, 0.0)
    for temperature in (1e-4, 0.05):
        found = outcome.weigh(asked, temperature)
        assert abs(found.value - exact.value) <= found.slack + 1e-15
        direction = rng.standard_normal(asked.shape)
        slope = richardson(lambda a, T=temperature: outcome.weigh(a, T).value, asked, direction, 1e-6)[0]
        assert float((found.weights * direction).sum()) == pytest.approx(slope, rel=1e-5, abs=1e-7)
