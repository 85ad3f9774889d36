"""What is left at each instant of a flight, of a record whose margins are known by hand."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from casadi_gnc.missions.requirements import Requirement
from casadi_gnc.missions.requirements.instants import instants

TIME = np.arange(6.0)
SIGNALS = {
    "time": TIME,
    "angle": np.array([3.0, 2.0, 1.0, 0.5, 0.2, 0.1]),
    "rate": np.array([0.0, 0.3, 0.3, 0.1, 0, 0]),
}
FLIGHT: Any = SimpleNamespace(time=TIME, signals=SIGNALS, diverged=False)


@pytest.mark.parametrize(
    ("formula", "margin", "asked"),
    [
        ("always[2, 4](angle <= 0.7)", [-2.3, -1.3, -0.3, 0.2, 0.5, 0.6], (2.0, 4.0)),
        ("always[3, end](angle <= 0.7 and rate <= 0.2)", [-2.3, -1.3, -0.3, 0.1, 0.2, 0.2], (3.0, 5.0)),
        ("eventually[1, 9](angle <= 0.7)", [-2.3, -1.3, -0.3, 0.2, 0.5, 0.6], (1.0, 5.0)),
    ],
)
def test_margins_of_an_instant(formula, margin, asked):
    found = instants(Requirement("A", formula=formula), FLIGHT)
    assert found is not None
    assert found.margin == pytest.approx(margin)
    assert found.asked == asked


@pytest.mark.parametrize(
    "formula", ["always[0, 3](eventually[0, 1](angle <= 0.7))", "angle <= 4 and always(rate <= 1)"]
)
def test_conditions_over_time_within_another_have_none(formula):
    assert instants(Requirement("A", formula=formula), FLIGHT) is None


def test_a_bound_on_a_metric_has_none():
    assert instants(Requirement("A", metric="late", at_most=1.0), FLIGHT) is None
