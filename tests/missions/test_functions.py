"""mission.plant(), law(), step() and closed_loop() are the flight's own mathematics."""

import casadi as ca
import numpy as np
import pytest

import casadi_gnc
from casadi_gnc.errors import FlightError
from casadi_gnc.laws import advance


def test_closed_loop_repeats_the_flight(detumble):
    """Folding closed_loop over samples gives the flown states (libm on both sides)."""
    flight = casadi_gnc.fly(detumble, "observer_pinv", maths="libm")
    loop = detumble.closed_loop("observer_pinv")
    state = detumble.loop_start("observer_pinv")
    for k in range(50):
        found = loop(t=k * 0.1, **state)
        assert np.allclose(np.array(state["x"]).ravel(), np.hstack([flight["mrp"][k], flight["rate"][k]]), atol=1e-13)
        state = {name: found[f"{name}_next"] for name in state}


def test_ports_are_named(detumble):
    assert detumble.plant().name_in() == ["t", "x", "actuators"]
    assert detumble.law("observer_pinv").name_out() == ["wanted", "memory_rate", "disturbance_estimate"]
    step = detumble.step("observer_pinv")
    assert step.name_in() == ["t", "y", "good", "m", "actuators"]
    assert step.name_out() == ["actuators_next", "m_next", "good_next", "wanted", "limited", "status"]


def test_linearised_loop_has_the_designed_poles(detumble):
    """At rest with exact actuators and inertia: 1 - h k2, e^(-beta h) and e^(-k4 h), three of each."""
    law, h = detumble.scheme("observer_pinv").law, 0.1
    rate, m = ca.SX.sym("rate", 3), law.memory.symbol("m")
    torque = law.command(0.0, rate, m)
    moved = ca.vertcat(
        rate + h * law.body.acceleration(ca.DM.zeros(3), rate, torque), advance(law, 0.0, rate, m, torque, torque)
    )
    at = ca.Function("at", [rate, m], [ca.jacobian(moved, ca.vertcat(rate, m))])
    # The known engine torque must be balanced for this to be a rest: it is, by the command.
    poles = np.sort(np.linalg.eigvals(np.array(at(np.zeros(3), np.zeros(6)))).real)
    assert np.allclose(poles, np.repeat([np.exp(-2.7), np.exp(-0.05), 1 - h * 0.4], 3), atol=1e-6)


def test_solver_in_the_loop_has_no_closed_form(detumble):
    with pytest.raises(FlightError, match="iterative solver, which has no closed form"):
        detumble.closed_loop("observer_robust")
    with pytest.raises(FlightError, match="of a sampled mission"):
        detumble.with_timing(mode="continuous").step("observer_pinv")
    with pytest.raises(FlightError, match="no scheme 'x' in detumble; there is damping_pinv"):
        detumble.scheme("x")


def test_columns_of_the_wrong_length_are_refused(detumble):
    law = detumble.scheme("observer_pinv").law
    with pytest.raises(ValueError, match=r"a column of 6 rows, expected 3 \(rate\)"):
        law.start(0.0, ca.DM.zeros(6))
