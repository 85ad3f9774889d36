"""Truth: conservation laws, convergence order, another formula for the gravity gradient."""

import casadi as ca
import numpy as np

from casadi_gnc.mathematics.integrators import runge_kutta
from casadi_gnc.mechanics import attitude
from casadi_gnc.mechanics.disturbances import Harmonics
from casadi_gnc.mechanics.rigid_body import RigidBody
from casadi_gnc.vehicles.combined_spacecraft.plant import BodyPart, CombinedSpacecraft, compose_inertia

INERTIA = np.array([[0.54, 0.06, 0.04], [0.06, 1.33, -0.07], [0.04, -0.07, 1.42]])
START = np.array([0.1, -0.2, 0.05, 0.45, 0.52, 0.55])


def free_body(**changes) -> CombinedSpacecraft:
    return CombinedSpacecraft(RigidBody(ca.DM(INERTIA), **changes), ca.DM.zeros(3, 12))


def fly(plant: CombinedSpacecraft, h: float, duration: float) -> np.ndarray:
    t, x = ca.SX.sym("t"), plant.state.symbol("x")
    stepped = plant.settle(runge_kutta(lambda t, x: plant.rate(t, x, ca.DM.zeros(12), ca.DM(0, 1)), t, x, h))
    step = ca.Function("step", [x, t], [stepped])
    count = round(duration / h)
    return np.array(step.mapaccum(count)(START, ca.DM(np.arange(count) * h).T))[:, -1]


def inertial_momentum(x: np.ndarray) -> np.ndarray:
    return np.array(attitude.dcm(ca.DM(x[:3]))).T @ INERTIA @ x[3:]


def test_torque_free_momentum_is_conserved():
    """Inertial angular momentum and energy; RK4 at 2.5 ms leaves some 4e-13 after 100 s."""
    end = fly(free_body(), 0.0025, 100.0)
    before, after = inertial_momentum(START), inertial_momentum(end)
    assert np.linalg.norm(after - before) < 1e-12 * np.linalg.norm(before)
    energy = [x[3:] @ INERTIA @ x[3:] for x in (START, end)]
    assert abs(energy[1] - energy[0]) < 1e-12 * energy[0]


def test_runge_kutta_converges_at_order_4():
    plant = CombinedSpacecraft(
        RigidBody(ca.DM(INERTIA), (0.0, 1e-2, -2e-2), 1e-3),
        ca.DM.zeros(3, 12),
        Harmonics((1e-2, 0, 0), (0.3,), ((0.0, 0.02, 0.01),)),
    )
    truth = fly(plant, 0.0125, 20.0)
    errors = [np.abs(fly(plant, h, 20.0) - truth).max() for h in (0.4, 0.2, 0.1)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(np.abs(orders - 4) < 0.25), orders


def test_gravity_gradient_is_the_classical_formula(rng):
    """3 w0^2 c x J c with c a column of scipy-checked C(s), and no torque about a principal vertical."""
    body = RigidBody(ca.DM(INERTIA), orbit_rate=1.1e-3)
    for _ in range(10):
        s = ca.DM(rng.uniform(-1, 1, 3))
        c = np.array(attitude.dcm(s))[:, 2]
        expected = 3 * 1.1e-3**2 * np.cross(c, INERTIA @ c)
        assert np.allclose(np.array(body.gravity_gradient(s)).ravel(), expected, rtol=1e-12, atol=1e-20)
    diagonal = RigidBody(ca.DM(np.diag([0.5, 1.2, 1.3])), orbit_rate=1.1e-3)
    assert np.all(np.array(diagonal.gravity_gradient(ca.DM.zeros(3))) == 0)


def test_disturbance_is_the_papers(detumble):
    t = np.array([0.0, 10.0, 62.5, 777.0])
    a, b = np.sin(np.pi * t / 125), np.sin(np.pi * t / 200)
    expected = 1e-4 * np.array([1 + a + 1.5 * b, 2 + 1.5 * a - 2 * b, -1 + 2 * a - 1.5 * b])
    found = np.hstack([np.array(detumble.truth.disturbance.at(time)) for time in t])
    assert np.allclose(found, expected, atol=1e-18)


def test_composed_inertia():
    """Eq. (70) with R_tc = R_li = R_sc; an independent evaluation, to its five digits."""
    rotation = attitude.frame_rotation(np.pi / 4, np.pi / 7, np.pi / 3)
    cube, link = np.diag([0.2666, 0.26, 0.1666]), np.diag([5e-5, 4.5e-4, 4.5e-4])
    places = [[-0.05, -0.02, 0.05], [-0.01, -0.05, 0.03], [0.03, 0.0, 0.01]]
    parts = [BodyPart(10.0, cube, [sign * 0.2, 0, 0], rotation) for sign in (-1, 1)]
    parts += [BodyPart(0.17, link, place, rotation) for place in places]
    inertia = np.array(compose_inertia(parts))
    assert np.allclose(np.diag(inertia), [0.49214, 1.20891, 1.29157], atol=5e-6)
    assert np.allclose([inertia[0, 1], inertia[0, 2], inertia[1, 2]], [0.0623, 0.0428, -0.0660], atol=5e-5)
    assert np.isclose(np.trace(inertia), 2.9926, atol=5e-5)
