"""Truth: the momentum of the whole craft in space, work, scipy's integrator, and the paper's digits."""

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from casadi_gnc.mathematics.integrators import runge_kutta
from casadi_gnc.mechanics import reaction_wheels as wheels
from casadi_gnc.mechanics.actuator_faults import ActuatorFault, FaultSchedule
from casadi_gnc.mechanics.attitude import frame_rotation
from casadi_gnc.mechanics.disturbances import Harmonics
from casadi_gnc.vehicles.wheel_spacecraft.plant import SensorError, WheelSpacecraft

J = np.array([[12.0, 0.4, -0.3], [0.4, 14.0, 0.2], [-0.3, 0.2, 22.0]])
MOUNTED = np.column_stack([np.eye(3), np.full(3, 3**-0.5)])
ROTATION = frame_rotation(np.pi / 4, np.pi / 7, np.pi / 3)
C, JW = np.array(wheels.free_axes(ROTATION, MOUNTED)), 0.338
START = np.array([0.3, -0.2, 0.4, 0.05, -0.08, 0.06, 90.0, -60.0, 40.0, 20.0])
HARMONIC = Harmonics((0.01, -0.02, 0.0), (0.3, 0.2), ((0.05, 0, 0.01), (0.0, 0.03, 0)), (np.pi / 2, 0.0))


def craft(orbit_rate=0.0, max_speed=np.inf, **changes) -> WheelSpacecraft:
    array = wheels.WheelArray(ca.DM(C), JW, max_speed=max_speed)
    return WheelSpacecraft(wheels.Gyrostat(ca.DM(J), orbit_rate=orbit_rate, wheels=array), **changes)


def command(t):
    return np.array([0.8 * np.sin(t), -0.5 * np.cos(0.7 * t), 0.6 * np.sin(0.4 * t + 1), -0.9 * np.cos(t)])


def rate_of(plant: WheelSpacecraft):
    t, x, a = ca.SX.sym("t"), plant.state.symbol("x"), plant.inputs.symbol("a")
    f = ca.Function("f", [t, x, a], [plant.rate(t, x, a, ca.DM.zeros(plant.noise.size))])
    return lambda t, x, a: np.array(f(t, x, a)).ravel()


def fly(plant: WheelSpacecraft, duration: float, acceleration=command) -> np.ndarray:
    """States at 0 and at the end, by scipy to 1e-12."""
    f = rate_of(plant)
    found = solve_ivp(
        lambda t, x: f(t, x, acceleration(t)), (0, duration), START, method="DOP853", rtol=1e-12, atol=1e-13
    )
    return found.y.T


def to_space(x: np.ndarray) -> np.ndarray:
    """Body to inertial frame, by scipy: the MRP of a turn is its axis times tan(angle/4)."""
    return Rotation.from_mrp(x[:3]).as_matrix()


def momentum(x: np.ndarray) -> np.ndarray:
    """J w + C Jw Omega, seen from space; J is that of the craft with its wheels locked."""
    return to_space(x) @ (J @ x[3:6] + C @ (JW * x[6:]))


def test_whole_momentum_is_conserved_whatever_the_wheels_do():
    """Wheels only move momentum about; 40 s of hard manoeuvres, integrated to 1e-12 a step."""
    path = fly(craft(), 40.0)
    moments = np.array([momentum(x) for x in path])
    assert np.abs(moments - moments[0]).max() < 1e-9 * np.linalg.norm(moments[0])
    body = np.array([to_space(x) @ J @ x[3:6] for x in path])
    assert np.abs(body - body[0]).max() > 0.1  # and much of it went between body and wheels


def test_rate_of_the_whole_momentum_is_the_external_torque(rng):
    """dH/dt in space along the flow equals gravity gradient and disturbance, at any state and command."""
    plant = craft(orbit_rate=0.02, disturbance=HARMONIC)
    f, h = rate_of(plant), 1e-5
    for _ in range(5):
        t, a = rng.uniform(0, 30), rng.uniform(-2, 2, 4)
        x = np.concatenate([rng.uniform(-0.5, 0.5, 3), rng.uniform(-0.2, 0.2, 3), rng.uniform(-100, 100, 4)])
        slope = f(t, x, a)
        change = (momentum(x + h * slope) - momentum(x - h * slope)) / (2 * h)
        down = to_space(x).T[:, 2]  # the orbit frame's z axis from the body
        d = [
            0.01 + 0.05 * np.cos(0.3 * t),
            -0.02 + 0.03 * np.sin(0.2 * t),
            0.01 * np.cos(0.3 * t),
        ]
        external = to_space(x) @ (3 * 0.02**2 * np.cross(down, J @ down) + d)
        # The central difference leaves h^2 times third derivatives of some 10 N m s.
        assert np.allclose(change, external, atol=1e-8)


def test_energy_grows_by_the_work_of_the_motors():
    """Motor i makes Jw (Omega_i' + c_i' w') on the wheel (its whole spin) and turns it by Omega_i against the body."""
    plant = craft()
    f = rate_of(plant)

    def energy(x):
        """Of the body with wheels locked, and of the wheels' spin: w'Jw/2 + w'C Jw Omega + Jw Omega^2/2."""
        w, speed = x[3:6], x[6:]
        return w @ J @ w / 2 + w @ C @ (JW * speed) + JW * speed @ speed / 2

    def with_work(t, z):
        slope = f(t, z[:10], command(t))
        motors = JW * (slope[6:10] + C.T @ slope[3:6])
        return np.append(slope, motors @ z[6:10])

    found = solve_ivp(with_work, (0, 20), np.append(START, 0.0), method="DOP853", rtol=1e-12, atol=1e-12)
    end = found.y[:, -1]
    assert energy(end[:10]) - energy(START) == pytest.approx(end[10], rel=1e-9)
    assert abs(end[10]) > 10


def test_runge_kutta_of_the_tapes_converges_to_scipy():
    plant = craft(orbit_rate=1e-3, disturbance=HARMONIC)
    t, x, told = ca.SX.sym("t"), plant.state.symbol("x"), ca.DM([0.5, -0.3, 0.2, 0.1])

    def end(h: float) -> np.ndarray:
        count = round(10.0 / h)
        step = ca.Function("step", [x, t], [runge_kutta(lambda t, x: plant.rate(t, x, told, ca.DM()), t, x, h)])
        return np.array(step.mapaccum(count)(START, ca.DM(np.arange(count) * h).T))[:, -1]

    truth = fly(plant, 10.0, lambda t: np.array(told).ravel())[-1]
    coarse, fine = (np.abs(end(h) - truth).max() for h in (0.05, 0.025))
    assert fine < 2e-6
    assert np.log2(coarse / fine) == pytest.approx(4, abs=0.25)


def test_axis_faults_are_after_the_wheels_and_wheel_faults_before_them():
    early, late = 4.0, 60.0
    fault = (ActuatorFault(1, 0.5, start=5.0), ActuatorFault(2, bias=0.2, start=5.0))
    told, x = np.array([1.0, -2.0, 3.0, 0.5]), START.copy()
    x[3:] = 0  # nothing turns: the torque is all there is
    sound = -C @ (JW * told)
    on_axes, on_wheels = craft(axis_faults=FaultSchedule(3, fault)), craft(wheel_faults=FaultSchedule(4, fault))
    for plant in (on_axes, on_wheels):
        slope = rate_of(plant)(early, x, told)
        assert np.allclose(J @ slope[3:6], sound)
        assert np.allclose(slope[6:], told)
    slope = rate_of(on_axes)(late, x, told)
    assert np.allclose(J @ slope[3:6], [0.5 * sound[0], sound[1] + 0.2, sound[2]])
    assert np.allclose(slope[6:], told)
    slope = rate_of(on_wheels)(late, x, told)
    made = np.array([0.5, -1.8, 3.0, 0.5])
    assert np.allclose(slope[6:], made)
    assert np.allclose(J @ slope[3:6], -C @ (JW * made))
    shown = on_axes.show(late, ca.DM(x), ca.DM(told))["true_torque"]
    assert np.allclose(np.array(shown).ravel(), [0.5 * sound[0], sound[1] + 0.2, sound[2]])


def test_a_wheel_at_its_limit_brakes_and_no_more():
    plant, x = craft(max_speed=100.0), START.copy()
    x[6:] = [100.0, -100.0, 99.0, 100.0]
    slope = rate_of(plant)(0.0, x, np.array([1.0, -1.0, 1.0, -1.0]))
    assert np.array_equal(slope[6:], [0.0, 0.0, 1.0, -1.0])


def test_sensors_err_by_a_factor_and_by_axis(rng):
    plant = craft(attitude_error=SensorError(2e-3, 5e-3), rate_error=SensorError(1e-3, 4e-3))
    assert plant.noise.size == 8
    n = rng.normal(size=8)
    seen = np.array(plant.measure(0.0, ca.DM(START), ca.DM(n))).ravel()
    assert np.allclose(seen[:3], START[:3] * (1 + 5e-3 * n[0]) + 2e-3 * n[1:4])
    assert np.allclose(seen[3:6], START[3:6] * (1 + 4e-3 * n[4]) + 1e-3 * n[5:])
    assert np.array_equal(seen[6:], START[6:])
    assert craft().noise.size == 0


def test_the_shadow_set_is_the_same_attitude():
    x = START.copy()
    x[:3] = [0.9, -0.8, 0.7]
    settled = np.array(craft().settle(ca.DM(x))).ravel()
    assert np.linalg.norm(settled[:3]) < 1
    assert np.allclose(to_space(settled), to_space(x), atol=1e-14)
    assert np.array_equal(settled[3:], x[3:])


PRINTED_R = [[0.63708, 0.63708, -0.43388], [-0.87855, 0.61925, 0.78026], [0.76577, -0.45897, 0.45048]]


def test_configuration_matrix_of_the_paper():
    """C_0 as printed, but for four entries of row 2 and 3 that lost their exponent and are ten times too large."""
    c0 = np.array(wheels.axes_as_points(PRINTED_R, MOUNTED, [2.0, 2.0, 2.0]))
    printed = [
        [-1.04348, -1.04348, -2.11444, -1.19542],
        [-1.92047, -0.422670, -0.261660, -0.741144],
        [-0.74879, -1.97353, -1.06408, -1.07734],
    ]
    assert np.allclose(c0, printed, atol=1.1e-5)
    assert np.linalg.svd(c0 * JW, compute_uv=False) == pytest.approx([1.356, 0.5045, 0.3365], rel=1e-3)


def test_corners_of_the_uncertainty_move_the_configuration():
    """-C Jw x at r_c + dr is the nominal torque plus R dr times Jw 1'x (eq. 8, its sign corrected)."""
    centre, half = np.array([2.0, 2.0, 2.0]), [0.3, 0.2, 0.1]
    shifts = wheels.corner_shifts(PRINTED_R, [-h for h in half], half)
    nominal, x = np.array(wheels.axes_as_points(PRINTED_R, MOUNTED, centre)), np.array([1.0, -2.0, 3.0, 0.5])
    assert shifts.shape == (8, 3, 1)
    signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1], indexing="ij")).reshape(3, 8).T
    for sign, shift in zip(signs, shifts, strict=True):
        moved = np.array(wheels.axes_as_points(PRINTED_R, MOUNTED, centre + sign * half))
        assert np.allclose(-moved @ x * JW, -nominal @ x * JW + shift[:, 0] * JW * x.sum())


def test_axes_taken_for_points_turn_the_loop_around():
    """True wheels C = R Cbar under pinv(C_0): the torque map has an eigenvalue of -0.240, the others are 1."""
    believed = np.array(wheels.axes_as_points(ROTATION, MOUNTED, [2.0, 2.0, 2.0]))
    eigenvalues = np.sort(np.linalg.eigvals(C @ np.linalg.pinv(believed)).real)
    assert np.allclose(eigenvalues, [-0.240, 1, 1], atol=1e-3)
