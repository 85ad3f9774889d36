"""Truth: rigid-body dynamics about the reference, the geometry of eigenaxis turns, formulas of the field, Basilisk."""

import math

import casadi as ca
import numpy as np
import pytest

import casadi_gnc
from casadi_gnc.errors import LawError
from casadi_gnc.laws import BDot, Modes, MrpFeedback, QuaternionFeedback, advance
from casadi_gnc.mechanics import quaternions
from casadi_gnc.mechanics.reaction_wheels import TorqueGyrostat, WheelArray
from casadi_gnc.mechanics.rigid_body import RigidBody

INERTIA = np.array([[90.0, 2, -3], [2, 80, 1], [-3, 1, 60]])
SPIN = [0.1, 0.2, 0.15, 0.12]
GAINS = {"attitude_gain": 3.5, "rate_gain": 30.0}


def dense(value) -> np.ndarray:
    return np.array(ca.DM(value)).ravel()


def carrying(rng) -> tuple[TorqueGyrostat, np.ndarray]:
    axes = rng.standard_normal((3, 4))
    axes /= np.linalg.norm(axes, axis=0)
    return TorqueGyrostat(ca.DM(INERTIA), wheels=WheelArray(ca.DM(axes), ca.DM(SPIN))), axes


def seen(law, rng, **given) -> ca.DM:
    """Return a measurement of random size with a small turn, some of it given."""
    turn = 0.3 * rng.standard_normal(3)
    q = quaternions.from_rotation_vector(ca.DM(turn))
    rate, reference = 0.1 * rng.standard_normal(3), 0.05 * rng.standard_normal(3)
    told = {
        "mrp": quaternions.to_mrp(q),
        "quaternion": q,
        "rate": rate,
        "body_rate": rate + reference,
        "reference_rate": reference,
        "reference_acceleration": 0.01 * rng.standard_normal(3),
        "wheel_speed": 100 * rng.standard_normal(4),
        **given,
    }
    return ca.DM(law.inputs.pack(**{name: ca.DM(told[name]) for name in law.inputs.names}))


@pytest.mark.parametrize("make", [MrpFeedback, QuaternionFeedback])
def test_on_its_reference_a_body_with_wheels_stays_there(make, rng):
    """Without errors the torque is what makes the body turn as the reference does: J w' + w x (J w + h) = u."""
    body, axes = carrying(rng)
    gains = GAINS if make is MrpFeedback else {"frequency": 0.1}
    extra = {"compensation": "body"} if make is MrpFeedback else {}
    law = make(body, **gains, **extra)
    w, moving = 0.05 * rng.standard_normal(3), 0.01 * rng.standard_normal(3)
    speed = 100 * rng.standard_normal(4)
    y = seen(
        law,
        rng,
        mrp=[0.0] * 3,
        quaternion=[1.0, 0, 0, 0],
        rate=[0.0] * 3,
        body_rate=w,
        reference_rate=w,
        reference_acceleration=moving,
        wheel_speed=speed,
    )
    whole = INERTIA @ w + axes @ (np.array(SPIN) * (speed + axes.T @ w))
    assert np.allclose(dense(law.command(0.0, y, ca.DM.zeros(0, 1))), INERTIA @ moving + np.cross(w, whole), rtol=1e-13)


def test_mrp_feedback_damps_without_work_of_the_gyroscopic_torque(rng):
    """V = w_e'J w_e/2 + 2 K ln(1 + s's) falls by w_e'P w_e, whatever turns: the proof in Schaub and Junkins, 8.4.1."""
    law = MrpFeedback(RigidBody(ca.DM(INERTIA)), **GAINS)
    for _ in range(10):
        y = seen(law, rng)
        now = law.inputs.split(y)
        u, w = dense(law.command(0.0, y, None)), dense(now.body_rate)
        rate, reference = dense(now.rate), dense(now.reference_rate)
        accelerated = np.linalg.solve(INERTIA, u - np.cross(w, INERTIA @ w))
        relative = accelerated - dense(now.reference_acceleration) + np.cross(w, reference)
        falling = rate @ INERTIA @ relative + GAINS["attitude_gain"] * (dense(now.mrp) @ rate)
        assert falling == pytest.approx(-GAINS["rate_gain"] * rate @ rate, rel=1e-10)


def test_the_integral_takes_a_constant_torque(rng):
    """Sampled, from rest, a torque of 0.02 N m: without the integral the attitude stays off by torque/K."""
    for gain, left in ((0.0, 0.02 / 3.5), (0.01, 0.0)):
        law = MrpFeedback(RigidBody(ca.DM(INERTIA)), **GAINS, integral_gain=gain, hold=0.5)
        y, m = law.inputs.symbol("y"), law.memory.symbol("m")
        none = ca.SX.zeros(3)
        step = ca.Function("step", [y, m], [law.command(0.0, y, m), advance(law, 0.0, y, m, none, none)])
        s, w, own = np.zeros(3), np.zeros(3), np.zeros(law.memory.size)
        for _ in range(3000):
            u, own = (dense(each) for each in step(np.r_[s, w, w, np.zeros(6)], own))
            w = w + 0.5 * np.linalg.solve(INERTIA, np.add(u, [0.02, 0, 0]) - np.cross(w, INERTIA @ w))
            s = s + 0.5 * w / 4  # small turns
        assert s[0] == pytest.approx(left, rel=0.02, abs=1e-5)


def test_the_integral_stays_within_its_limit(rng):
    law = MrpFeedback(RigidBody(ca.DM(INERTIA)), **GAINS, integral_gain=0.01, integral_limit=0.5)
    y = seen(law, rng, mrp=[0.1, -0.1, 0.1])
    outside = dense(law.rate(0.0, y, ca.DM([0.6, 0.6, 0.1]), None, None))
    assert np.allclose(outside, [0.0, -0.35, 0.35])


def test_an_eigenaxis_turn_keeps_its_axis_and_its_rate():
    """120 degrees at a limit of 0.02 rad/s, an inertia with products: the axis of the error stays, the rate too."""
    law = QuaternionFeedback(RigidBody(ca.DM(INERTIA)), frequency=0.2, damping_ratio=0.9, rate_limit=0.02, hold=0.1)
    y = law.inputs.symbol("y")
    command = ca.Function("command", [y], [law.command(0.0, y, None)])
    axis = np.array([2.0, -1, 2]) / 3
    q, w, fastest = np.r_[math.cos(math.pi / 3), math.sin(math.pi / 3) * axis], np.zeros(3), 0.0
    for _ in range(2000):
        u = dense(command(np.r_[q, w, w, np.zeros(6)]))
        w = w + 0.1 * np.linalg.solve(INERTIA, u - np.cross(w, INERTIA @ w))
        q = dense(quaternions.compose(quaternions.from_rotation_vector(ca.DM(0.1 * w)), ca.DM(q)))
        fastest = max(fastest, np.linalg.norm(w))
        assert np.linalg.norm(np.cross(w, axis)) < 1e-12
    assert fastest == pytest.approx(0.02, rel=1e-3)
    assert np.linalg.norm(q[1:]) < 1e-6


def test_bdot_damps_what_is_across_the_field():
    """Steady in the filter, B' = -w x B, and the torque is -k times the rate across the field."""
    law = BDot(damping_gain=2e-3, filter_time=2.0)
    b, w = np.array([2e-5, -1e-5, 3e-5]), np.array([0.02, 0.05, -0.03])
    slope = -np.cross(w, b)
    along = b / np.linalg.norm(b)
    torque = dense(law.command(0.0, ca.DM(b), ca.DM(b - 2.0 * slope)))
    assert np.allclose(torque, -2e-3 * (w - along * (along @ w)), rtol=1e-12)
    assert abs(torque @ b) < 1e-20
    assert np.allclose(dense(law.rate(0.0, ca.DM(b), ca.DM(b - 2.0 * slope), None, None)), slope)
    assert np.isfinite(dense(law.command(0.0, ca.DM.zeros(3), law.start(0.0, ca.DM.zeros(3))))).all()


def test_modes_follow_each_other():
    """The shipped flight: detumble, acquire, point, lost, again; safe when the reference runs away; and back."""
    flight = casadi_gnc.fly("satellites/safe_mode")
    mode, time = flight["mode"].astype(int), flight.time
    changes = np.flatnonzero(np.diff(mode))
    assert [int(mode[0]), *(int(mode[i + 1]) for i in changes)] == [0, 1, 2, 1, 2, 3, 0, 1, 2]
    safe = time[mode == 3]
    assert safe[-1] - safe[0] == pytest.approx(60, abs=0.3)
    assert 900 < safe[0] < 910
    assert flight.metrics["pointing_error"] < 0.05


def test_modes_that_would_take_turns():
    body = RigidBody(ca.DM(INERTIA))
    keys = {**GAINS, "damping_gain": 1.0, "frequency": 0.1, "rate_limit": 0.01, "calm_rate": 0.005, "near_angle": 0.1}
    with pytest.raises(LawError, match="near_angle is 0.1 and lost_angle 0.05, expected less"):
        Modes(body, **keys, lost_angle=0.05, alarm_rate=0.03)


@pytest.mark.packages("Basilisk")
@pytest.mark.parametrize(("integral_gain", "kind"), [(0.0, "reference"), (0.0, "body"), (0.01, "reference")])
def test_basilisk_commands_the_same_torque(integral_gain, kind, rng):
    """Its mrpFeedback, four wheels, ten random states; its integral counts the present sample from the third on."""
    from Basilisk.architecture import messaging
    from Basilisk.fswAlgorithms import mrpFeedback
    from Basilisk.utilities import SimulationBaseClass, macros

    hold = 0.5
    body, axes = carrying(rng)
    law = MrpFeedback(body, **GAINS, integral_gain=integral_gain, compensation=kind, hold=hold)
    simulation = SimulationBaseClass.SimBaseClass()
    simulation.CreateNewProcess("fsw").addTask(simulation.CreateNewTask("task", macros.sec2nano(hold)))
    module = mrpFeedback.mrpFeedback()
    module.K, module.P, module.Ki = GAINS["attitude_gain"], GAINS["rate_gain"], integral_gain or -1.0
    module.integralLimit, module.controlLawType = 1e3, 0 if kind == "reference" else 1
    simulation.AddModelToTask("task", module)
    vehicle, array = messaging.VehicleConfigMsgPayload(), messaging.RWArrayConfigMsgPayload()
    vehicle.ISCPntB_B = list(INERTIA.ravel())
    array.GsMatrix_B, array.JsList, array.numRW = list(axes.T.ravel()), SPIN, 4
    messages = [messaging.VehicleConfigMsg().write(vehicle), messaging.RWArrayConfigMsg().write(array)]
    guidance, speeds = messaging.AttGuidMsg(), messaging.RWSpeedMsg()
    module.vehConfigInMsg.subscribeTo(messages[0])
    module.rwParamsInMsg.subscribeTo(messages[1])
    module.guidInMsg.subscribeTo(guidance)
    module.rwSpeedsInMsg.subscribeTo(speeds)
    simulation.InitializeSimulation()
    integral = np.zeros(3)
    for k in range(10):
        y = seen(law, rng)
        now, at = law.inputs.split(y), macros.sec2nano(k * hold)
        told, turning = messaging.AttGuidMsgPayload(), messaging.RWSpeedMsgPayload()
        told.sigma_BR, told.omega_BR_B = list(dense(now.mrp)), list(dense(now.rate))
        told.omega_RN_B, told.domega_RN_B = list(dense(now.reference_rate)), list(dense(now.reference_acceleration))
        turning.wheelSpeeds = list(dense(now.wheel_speed))
        guidance.write(told, at)
        speeds.write(turning, at)
        simulation.ConfigureStopTime(at)
        simulation.ExecuteSimulation()
        expected = np.array(module.cmdTorqueOutMsg.read().torqueRequestBody)
        integral = integral + (GAINS["attitude_gain"] * hold * dense(now.mrp) if k > 1 else 0.0)
        found = dense(law.command(0.0, y, ca.DM(integral[: law.memory.size])))
        assert np.abs(found - expected).max() < 1e-12 * np.abs(expected).max()
