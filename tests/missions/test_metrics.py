"""Truth: the definitions, evaluated by numpy over the recorded samples."""

import numpy as np
import pytest

import casadi_gnc
from casadi_gnc.status import StepStatus


@pytest.fixture(scope="module")
def flight():
    return casadi_gnc.fly(casadi_gnc.load("huang2020/detumble"), "observer_pinv")


def test_folds_are_their_definitions(flight):
    rate = np.abs(flight["rate"]).max(axis=1)
    above = np.flatnonzero(rate >= 2e-3)
    assert flight.metrics["settling_time"] == pytest.approx(flight.time[above[-1] + 1])
    assert flight.metrics["steady_rate"] == rate[flight.time >= 1400].max()
    for name, signal in (("torque_sample_sum", "achieved"), ("force_sample_sum", "force")):
        assert flight.metrics[name] == pytest.approx(np.linalg.norm(flight[signal], axis=1).sum(), rel=1e-12)


def test_statuses_are_counted(flight):
    status = flight["status"].astype(int)
    for bit in StepStatus:
        raised = np.flatnonzero(status & bit.value)
        if raised.size:
            assert flight.statuses[bit] == (raised.size, flight.time[raised[0]])
        else:
            assert bit not in flight.statuses


def test_decimation_changes_what_is_kept_and_nothing_else(flight, detumble):
    thinned = casadi_gnc.fly(detumble, "observer_pinv", decimation=7)
    assert np.array_equal(thinned.samples, flight.samples[::7])
    assert thinned.metrics == flight.metrics
    assert thinned.statuses == flight.statuses


def test_progress_is_told_and_changes_nothing(flight, detumble):
    seen = []
    again = casadi_gnc.fly(detumble, "observer_pinv", progress=lambda done, total: seen.append((done, total)))
    assert seen[-1] == (15001, 15001)
    assert np.array_equal(again.samples, flight.samples)
