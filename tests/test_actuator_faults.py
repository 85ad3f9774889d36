"""Truth: the closed forms of the profile, and what must be refused."""

import casadi as ca
import numpy as np
import pytest

from casadi_gnc.errors import FlightError
from casadi_gnc.mechanics.actuator_faults import ActuatorFault, FaultSchedule

ONES = ca.DM.ones(3)


def made(schedule: FaultSchedule, t: float, command=ONES) -> np.ndarray:
    return np.array(schedule.apply(t, command)).ravel()


@pytest.mark.parametrize("t", [0.0, 4.9, 5.0, 5.5, 9.0, 14.99, 15.0, 15.1, 1e4])
def test_profile_of_the_paper(t):
    """Section IV: (e_1, u_2) from 5 s, e_2 from 10 s, (e_3, u_3) from 5 s to 15 s, growth 1/s."""
    schedule = FaultSchedule(
        3,
        (
            ActuatorFault(1, effectiveness=0.5, start=5.0),
            ActuatorFault(2, bias=0.2, start=5.0),
            ActuatorFault(2, effectiveness=0.5, start=10.0),
            ActuatorFault(3, effectiveness=0.0, bias=-0.2, start=5.0, end=15.0),
        ),
    )
    five, ten = (1 - np.exp(-max(t - start, 0.0)) for start in (5.0, 10.0))
    third = five if t < 15.0 else 0.0
    command = np.array([0.3, -0.4, 0.7])
    expected = np.array([1 - 0.5 * five, 1 - 0.5 * ten, 1 - third]) * command + [0, 0.2 * five, -0.2 * third]
    assert np.allclose(made(schedule, t, ca.DM(command)), expected, atol=1e-15)


def test_far_from_the_fault_nothing_overflows():
    """exp of the elapsed time would be infinite long before the start; the profile is exactly 0 there."""
    schedule = FaultSchedule(1, (ActuatorFault(1, 0.5, start=5e3, growth=10.0),))
    t = ca.SX.sym("t")
    f = ca.Function("f", [t], [schedule.apply(t, ca.DM([1.0])), ca.jacobian(schedule.apply(t, ca.DM([1.0])), t)])
    assert [float(v) for v in f(0.0)] == [1.0, 0.0]
    assert float(f(6e3)[0]) == 0.5


def test_growth_and_repeated_faults():
    schedule = FaultSchedule(
        2, (ActuatorFault(1, 0.2, start=1.0, end=2.0, growth=3.0), ActuatorFault(1, 0.4, start=2.0))
    )
    command = ca.DM([1.0, 1.0])
    assert made(schedule, 1.5, command) == pytest.approx([1 - 0.8 * (1 - np.exp(-1.5)), 1.0])
    assert made(schedule, 2.0, command) == pytest.approx([1.0, 1.0])
    assert made(schedule, 50.0, command) == pytest.approx([0.4, 1.0])


@pytest.mark.parametrize(
    ("fault", "message"),
    [
        ({"effectiveness": -0.1}, "fault of actuator 1: effectiveness is -0.1, expected 0 .dead. to 1 .sound."),
        ({"effectiveness": 1.5}, "effectiveness is 1.5"),
        ({"effectiveness": float("nan")}, "effectiveness is nan"),
        ({"bias": float("inf")}, "bias is inf"),
        ({"start": -1.0}, "starts at -1 s, expected 0 s or later"),
        ({"start": 15.0, "end": 5.0}, "ends at 5 s, before it starts at 15 s"),
        ({"start": 5.0, "end": 5.0}, "ends at 5 s"),
        ({"growth": 0.0}, "growth is 0 1/s, expected a positive number"),
    ],
)
def test_senseless_faults_are_refused(fault, message):
    with pytest.raises(FlightError, match=message):
        ActuatorFault(1, **fault)


@pytest.mark.parametrize("number", [0, -1, 4])
def test_actuators_that_do_not_exist_are_refused(number):
    with pytest.raises(FlightError, match=f"fault of actuator {number}, but there are 1 to 3"):
        FaultSchedule(3, (ActuatorFault(number, 0.5),))


def test_overlap_is_refused_where_the_same_quantity_is_changed():
    first = ActuatorFault(2, 0.5, start=5.0, end=15.0)
    with pytest.raises(FlightError, match="two faults of actuator 2 overlap, from 5 s to 15 s and from 10 s;"):
        FaultSchedule(3, (first, ActuatorFault(2, 0.2, start=10.0)))
    FaultSchedule(3, (first, ActuatorFault(2, 0.2, start=15.0)))
    FaultSchedule(3, (first, ActuatorFault(1, 0.2, start=10.0)))
    FaultSchedule(3, (first, ActuatorFault(2, bias=0.2, start=10.0)))  # as the paper has it
