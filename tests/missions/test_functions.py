"""mission.plant(), law(), step() and closed_loop() are the flight's own mathematics."""

import casadi as ca
import numpy as np
import pytest

import casadi_gnc
from casadi_gnc.errors import FlightError


def test_closed_loop_repeats_the_flight(detumble):
    """Folding closed_loop over samples gives the flown states (libm on both sides)."""
    flight = casadi_gnc.fly(detumble, "observer_pinv", maths="libm")
    loop = detumble.closed_loop("observer_pinv")
    x = np.array(detumble.start)
    start = detumble.scheme("observer_pinv").law.start(0.0, ca.DM(x[3:]))
    state = {"x": x, "m": start, "force": np.zeros(12), "good": x}
    for k in range(50):
        found = loop(t=k * 0.1, **state)
        assert np.allclose(np.array(state["x"]).ravel(), np.hstack([flight["mrp"][k], flight["rate"][k]]), atol=1e-13)
        state = {name: found[f"{name}_next"] for name in state}


def test_ports_are_named(detumble):
    assert detumble.plant().name_in() == ["t", "x", "force"]
    assert detumble.law("observer_pinv").name_out() == ["wanted", "memory_rate", "disturbance_estimate"]
    step = detumble.step("observer_pinv")
    assert step.name_in() == ["t", "y", "good", "m", "force"]
    assert step.name_out() == ["force_next", "m_next", "good_next", "wanted", "limited", "status"]


def test_linearised_rate_loop_has_the_designed_poles(detumble):
    """Near rest, unsaturated and with exact actuators: observer pole e^(-beta h) and rate pole."""
    mission = detumble.with_scheme("observer_pinv")
    law, h = mission.scheme().law, 0.1
    function = mission.law()
    zero = np.zeros
    a = ca.Function("a", function.sx_in(), [ca.jacobian(function(*function.sx_in())[0], function.sx_in()[1])])
    slope = np.array(a(0, zero(6), zero(6), zero(3)))[:, 3:]
    expected = -np.diag([0.49019, 1.2089, 1.2916]) * (0.4 + law.observer.through)
    assert np.allclose(slope, expected, rtol=1e-12)
    assert law.observer.through == pytest.approx((1 - np.exp(-27 * h)) / h)


def test_solver_in_the_loop_has_no_closed_form(detumble):
    with pytest.raises(FlightError, match="iterative solver, which has no closed form"):
        detumble.closed_loop("observer_robust")
    with pytest.raises(FlightError, match="of a sampled mission"):
        detumble.with_timing(mode="continuous").step("observer_pinv")
    with pytest.raises(FlightError, match="no scheme 'x' in detumble; there is damping_pinv"):
        detumble.scheme("x")


def test_bad_measurements_are_survived(detumble):
    """NaN, infinities and huge values: last good measurement, status bit, bounded forces, recovery."""
    step = detumble.step("observer_pinv")
    good, m, force = np.array(detumble.start), np.zeros(6), np.zeros(12)
    for bad in (np.nan, np.inf, -np.inf, 1e300, 11.0):
        y = np.array(detumble.start)
        y[4] = bad
        found = step(t=0.0, y=y, good=good, m=m, force=force)
        assert int(found["status"]) & 1
        assert np.array_equal(np.array(found["good_next"]).ravel(), good)
        forces = np.array(found["force_next"])
        assert np.all((forces >= 0) & (forces <= 3.75e-3))
        assert np.all(np.isfinite(np.array(found["m_next"])))
    assert not int(step(t=0.0, y=good, good=good, m=m, force=force)["status"]) & 1
