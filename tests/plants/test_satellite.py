"""Truth of a satellite from parts: conservation laws of any sum of parts, and formulas of others for each part."""

from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from casadi_gnc.mathematics.integrators import runge_kutta
from casadi_gnc.mathematics.linear import solve_symmetric
from casadi_gnc.mechanics import attitude
from casadi_gnc.mechanics.appendages import FlexibleModes, SloshMasses
from casadi_gnc.mechanics.hinged_panels import HingedPanels
from casadi_gnc.mechanics.multibody import Assembly
from casadi_gnc.mechanics.satellite_parts import Thrusters, Wheels
from casadi_gnc.vehicles.satellite import SatelliteCraft
from casadi_gnc.vehicles.satellite.momentum import MomentumSharing

INERTIA = [[24.0, 1.0, 0.5], [1.0, 30.0, -1.0], [0.5, -1.0, 34.0]]


def units(generator: np.random.Generator, count: int) -> ca.DM:
    columns = generator.normal(size=(3, count))
    return ca.DM(columns / np.linalg.norm(columns, axis=0))


def random_panels(generator: np.random.Generator, count: int) -> HingedPanels:
    """Panels of some 10 kg whose hinges are no principal axes, at angles of up to a radian."""
    inertias = []
    for _ in range(count):
        turn = np.linalg.qr(generator.normal(size=(3, 3)))[0]
        inertias.append(ca.DM(turn @ np.diag([3.0, 2.0, 4.0]) @ turn.T))
    hinges, arms = (ca.DM(generator.uniform(-0.8, 0.8, (3, count))) for _ in range(2))
    given = [list(generator.uniform(low, high, count)) for low, high in ((5, 15), (2, 8), (-1, 1), (-0.3, 0.3))]
    masses, stiffness, angle, rate = given
    return HingedPanels(masses, inertias, hinges, units(generator, count), arms, stiffness, [0.0] * count, angle, rate)


def random_parts(seed: int, wheels: int, modes: int, liquids: int, panels: int = 0) -> Assembly:
    """A craft of some 100 kg and 30 kg m^2 whose parts are frictionless and swing slowly."""
    generator, parts = np.random.default_rng(seed), []
    if wheels:
        none, speeds = [0.0] * wheels, list(generator.uniform(-300, 300, wheels))
        parts.append(
            Wheels(units(generator, wheels), [0.02] * wheels, [np.inf] * wheels, none, none, [1.0] * wheels, speeds)
        )
    if modes:
        rotation, translation = (ca.DM(generator.uniform(-1, 1, (3, modes))) for _ in range(2))
        frequencies = list(generator.uniform(0.3, 2.0, modes))
        parts.append(
            FlexibleModes(frequencies, [0.0] * modes, rotation, translation, list(generator.uniform(-0.3, 0.3, modes)))
        )
    if liquids:
        masses, places = list(generator.uniform(2, 12, liquids)), ca.DM(generator.uniform(-0.8, 0.8, (3, liquids)))
        offsets = list(generator.uniform(-0.2, 0.2, liquids))
        parts.append(SloshMasses(masses, places, units(generator, liquids), [6.0] * liquids, [0.0] * liquids, offsets))
    centre = generator.uniform(-0.2, 0.2, 3).tolist()
    if panels:
        parts.append(random_panels(generator, panels))
    return Assembly(100.0, centre, ca.DM(INERTIA), tuple(parts))


def coasting(body: Assembly, h: float) -> tuple[ca.Function, ca.Function, np.ndarray]:
    """Return a step of the torque-free motion, (momentum inertial, energy), and a start."""
    layout = body.state
    x = ca.SX.sym("x", 6 + layout.size)
    told = body.inputs.split(ca.DM.zeros(body.inputs.size))

    def rate(_, x):
        w, own, _ = body.moved(0.0, x[3:6], layout.split(x[6:]), told, ca.DM.zeros(3), None)
        return ca.vertcat(attitude.mrp_rate(x[:3], x[3:6]), w, own)

    own = layout.split(x[6:])
    kept = [ca.mtimes(attitude.dcm(x[:3]).T, body.momentum(x[3:6], own)), body.energy(x[3:6], own)]
    first = [v for part in body.components for values in part.start().values() for v in values]
    return (
        ca.Function("s", [x], [runge_kutta(rate, 0, x, h)]),
        ca.Function("k", [x], kept),
        np.r_[0.1, -0.2, 0.1, 0.05, 0.08, -0.06, first],
    )


def drifts(body: Assembly, h: float) -> tuple[float, float, np.ndarray]:
    """Return what twenty seconds change of the momentum and the energy, relative, and of the state.

    The momentum's measure is all that adds up to it: wheels against each other may leave next to nothing of it.
    """
    step, kept, start = coasting(body, h)
    end = np.array(step.fold(round(20 / h))(start)).ravel()
    (before, energy), (after, left) = (tuple(np.array(v).ravel() for v in kept(x)) for x in (start, end))
    stored = sum(
        np.abs(np.multiply(part.speed, part.spin_inertia)).sum() for part in body.components if isinstance(part, Wheels)
    )
    lost = np.linalg.norm(after - before) / (np.linalg.norm(before) + stored)
    return lost, abs(left - energy)[0] / energy[0], end - start


@settings(max_examples=6, deadline=None)
@given(st.integers(0, 10**6), st.integers(0, 8), st.integers(0, 3), st.integers(0, 2), st.integers(0, 2))
def test_momentum_and_energy_are_conserved(seed, wheels, modes, liquids, panels):
    """To 1e-11 at 4 ms, or where RK4 leaves more of a fast swing, at 2 ms: it leaves a 16th of that, rounding apart."""
    body = random_parts(seed, wheels, modes, liquids, panels)
    momentum, energy, moved = drifts(body, 0.004)
    if max(momentum, energy) > 1e-11:
        assert max(momentum, energy) < 1e-9
        momentum, energy, _ = drifts(body, 0.002)
    assert max(momentum, energy) < 1e-11
    if modes or liquids or panels:
        assert np.abs(moved[6 + wheels :]).max() > 1e-3  # something swung


def test_liquid_moves_as_two_masses_on_a_spring():
    """A mass on a spring along x of a body that is free to move: frequency sqrt(k (1/m + 1/M)), and no turn."""
    one = lambda value: ca.DM([value])  # noqa: E731
    body = Assembly(
        30.0, [0.0] * 3, ca.DM(INERTIA), (SloshMasses([6.0], ca.DM.zeros(3, 1), ca.DM([1, 0, 0]), [4.5], [0.0], [0.1]),)
    )
    own = SimpleNamespace(slosh=one(0.1), slosh_rate=one(0.0))
    turned, moved, _ = body.moved(0.0, ca.DM.zeros(3), own, None, ca.DM.zeros(3), None)
    assert np.allclose(np.array(ca.DM(turned)), 0, atol=1e-15)
    assert np.allclose(np.array(ca.DM(moved)).ravel(), [0.0, -4.5 * (1 / 6 + 1 / 30) * 0.1], rtol=1e-14)


def test_a_panel_swings_against_a_body_that_is_free():
    """In a plane, the hinge through the body's centre: k (1/J + 1/(I + m M d^2/(m + M))) of a small angle."""
    panel = HingedPanels(
        [6.0], [ca.diag(ca.DM([1.0, 2.0, 2.5]))], ca.DM.zeros(3, 1), ca.DM([0, 0, 1]), ca.DM([0.8, 0, 0]), [4.5], [0.3],
        [1e-7], [0.0],
    )  # fmt: skip
    body, own = Assembly(30.0, [0.0] * 3, ca.DM([[24, 1, 0], [1, 30, 0], [0, 0, 34]]), (panel,)), SimpleNamespace()
    own.panel_angle, own.panel_rate = ca.DM([1e-7]), ca.DM([0.0])
    turned, moved, _ = body.moved(0.0, ca.DM.zeros(3), own, None, ca.DM.zeros(3), None)
    swung = 2.5 + 6 * 30 / 36 * 0.8**2
    assert np.allclose(np.array(ca.DM(moved)).ravel() / 1e-7, [0.0, -4.5 * (1 / 34 + 1 / swung)], rtol=1e-9)
    assert np.allclose(np.array(ca.DM(turned)).ravel() / 1e-7, [0, 0, 4.5 / 34], rtol=1e-9, atol=1e-9)


def test_a_body_with_liquid_is_two_points_and_a_body():
    """Newton for the parts one by one: forces between the mass and the body at arm's length, momentum of each."""
    generator = np.random.default_rng(4)
    body = random_parts(5, 0, 0, 1)
    liquid, w = body.components[0], generator.uniform(-0.5, 0.5, 3)
    q, s = 0.07, -0.3
    own = SimpleNamespace(slosh=ca.DM([q]), slosh_rate=ca.DM([s]))
    turned, moved, _ = body.moved(0.0, ca.DM(w), own, None, ca.DM.zeros(3), None)
    a, acceleration = np.array(ca.DM(turned)).ravel(), float(ca.DM(moved)[1])
    m, M, axis = float(liquid.masses[0]), 100.0, np.array(liquid.axes).ravel()
    r = np.array(liquid.positions).ravel() + q * axis - np.array(body.body_centre)  # of the mass from the body's centre
    relative = acceleration * axis + np.cross(a, r) + 2 * s * np.cross(w, axis) + np.cross(w, np.cross(w, r))
    pull = m * M / (m + M) * relative  # on the mass; the body feels the opposite at the mass's place
    J = np.array(INERTIA)
    assert np.allclose(J @ a + np.cross(w, J @ w), -np.cross(r, pull), rtol=1e-12, atol=1e-13)
    assert np.isclose(axis @ pull, -float(liquid.stiffness[0]) * q, rtol=1e-12)


def test_wheels_turn_by_their_motors():
    """J_s (Omega' + g.w') = u - friction, and the body with the wheels keeps H' + w x H = 0."""
    generator = np.random.default_rng(6)
    axes, spin, speed, u = (
        units(generator, 3),
        np.array([0.02, 0.03, 0.01]),
        np.array([100.0, -50.0, 1.0]),
        [0.1, -0.2, 0.05],
    )
    wheels = Wheels(axes, list(spin), [np.inf] * 3, [1e-4] * 3, [2e-3] * 3, [0.5] * 3, list(speed))
    body, w = Assembly(100.0, [0.0] * 3, ca.DM(INERTIA), (wheels,)), generator.uniform(-0.1, 0.1, 3)
    own, told = SimpleNamespace(wheel_speed=ca.DM(speed)), SimpleNamespace(wheel_torque=ca.DM(u))
    turned, moved, _ = body.moved(0.0, ca.DM(w), own, told, ca.DM.zeros(3), None)
    a, faster = np.array(ca.DM(turned)).ravel(), np.array(ca.DM(moved)).ravel()
    friction = 1e-4 * speed + 2e-3 * np.tanh(speed / 0.5)
    assert np.allclose(spin * (faster + np.array(axes).T @ a), np.array(u) - friction, rtol=1e-13)
    momentum = np.array(INERTIA) @ w + np.array(axes) @ (spin * speed)
    change = np.array(INERTIA) @ a + np.array(axes) @ (spin * faster)
    assert np.allclose(change + np.cross(w, momentum), 0, atol=1e-14)


def test_thrusters_turn_about_the_centre_of_mass_and_shake_modes():
    """Torque (r - c) x F; a mode that is all translation feels -p.F/m."""
    places, directions = ca.DM([[1.0], [0.2], [0.0]]), ca.DM([[0.0], [1.0], [0.0]])
    along = ca.DM([[0.0], [3.0], [0.0]])
    mode = FlexibleModes([1.0], [0.01], ca.DM.zeros(3, 1), along, [0.0])
    body = Assembly(50.0, [0.3, 0.0, 0.0], ca.DM(INERTIA), (Thrusters(places, directions), mode))
    own = SimpleNamespace(deflection=ca.DM([0.0]), deflection_rate=ca.DM([0.0]))
    turned, moved, force = body.moved(
        0.0, ca.DM.zeros(3), own, SimpleNamespace(force=ca.DM([2.0])), ca.DM.zeros(3), None
    )
    assert np.allclose(np.array(ca.DM(force)).ravel(), [0, 2, 0])
    # M_c = 1 - p.p/m couples the mode's swing to itself; its angular momentum about C is -c x p.
    p, c = np.array([0.0, 3.0, 0.0]), np.array([0.3, 0.0, 0.0])
    whole = np.block(
        [[np.array(INERTIA), -np.cross(c, p)[:, None]], [-np.cross(c, p)[None, :], np.array([[1 - p @ p / 50]])]]
    )
    expected = np.linalg.solve(whole, [0, 0, 0.7 * 2.0, -p @ [0, 2, 0] / 50])
    found = np.r_[np.array(ca.DM(turned)).ravel(), float(ca.DM(moved)[1])]
    assert np.allclose(found, expected, rtol=1e-13, atol=1e-16)


def test_symmetric_systems_are_solved_and_zeros_left_out(rng):
    for n in (1, 2, 5, 9):
        root = rng.normal(size=(n, n))
        matrix, right = root @ root.T + n * np.eye(n), rng.normal(size=n)
        assert np.allclose(
            np.array(ca.DM(solve_symmetric(matrix, right))).ravel(), np.linalg.solve(matrix, right), rtol=1e-11
        )
    diagonal, b = ca.SX.sym("d", 4), ca.SX.sym("b", 4)
    assert ca.Function("f", [diagonal, b], [solve_symmetric(ca.diag(diagonal), b)]).n_instructions() == 4 * 4
    assert solve_symmetric(ca.SX(0, 0), ca.SX(0, 1)).shape == (0, 1)


def satellite(**changes) -> SatelliteCraft:
    keys = {
        "mass_kg": 300.0,
        "inertia_kg_m2": INERTIA,
        "wheel": [{"axis": list(axis), "inertia_kg_m2": 0.02, "max_torque_N_m": 0.2} for axis in np.eye(3)],
    }
    return SatelliteCraft(**{**keys, **changes})


def test_gravity_turns_a_satellite_as_the_classical_formula_says():
    """3 mu/r^5 r x J r, in the body; and a circular orbit closes after its period."""
    craft = satellite(orbit={"altitude_m": 500e3, "inclination_deg": 51.0}, initial={"mrp": [0.1, 0.2, -0.3]})
    plant = craft.plant()
    x = ca.vertcat(*(ca.DM(craft.start()[name]) for name in plant.state.names))
    rate = plant.state.split(ca.DM(plant.rate(0.0, x, ca.DM.zeros(3), ca.DM(0, 1))))
    now, J = plant.state.split(x), np.array(INERTIA)
    r = np.array(attitude.dcm(now.mrp)) @ np.array(now.position).ravel()
    torque = 3 * 3.986004418e14 / np.linalg.norm(r) ** 5 * np.cross(r, J @ r)
    free = J - 0.02 * np.eye(3)
    assert np.allclose(free @ np.array(rate.rate).ravel(), torque, rtol=1e-12)


@pytest.mark.parametrize(
    "same",
    [
        {"quaternion_scalar_first": [0.5, 0.5, -0.5, 0.5]},
        {"quaternion_scalar_first": [-0.5, -0.5, 0.5, -0.5]},
        {"quaternion_scalar_last": [0.5, -0.5, 0.5, 0.5]},
        {"axis": [0.5773502691896258, -0.5773502691896258, 0.5773502691896258], "angle_deg": 120.0},
        {"axis": [-0.5773502691896258, 0.5773502691896258, -0.5773502691896258], "angle_rad": 4 * np.pi / 3},
        {"mrp": [1 / 3, -1 / 3, 1 / 3]},
        {"mrp": [-1.0, 1.0, -1.0]},
    ],
    ids=lambda each: "-".join(each),
)
def test_an_attitude_is_the_same_however_it_is_told(same):
    """A turn by 120 degrees about (1, -1, 1): e tan(30 deg) = (1, -1, 1)/3."""
    assert np.allclose(satellite(initial=same).start()["mrp"], [1 / 3, -1 / 3, 1 / 3], atol=1e-14)


def test_three_angles_turn_frames_by_yaw_then_pitch_then_roll():
    cy, sy, cp, sp, cr, sr = (f(np.radians(a)) for a in (30, -40, 50) for f in (np.cos, np.sin))
    roll = np.array([[1, 0, 0], [0, cr, sr], [0, -sr, cr]])
    pitch = np.array([[cp, 0, -sp], [0, 1, 0], [sp, 0, cp]])
    yaw = np.array([[cy, sy, 0], [-sy, cy, 0], [0, 0, 1]])
    mrp = satellite(initial={"euler_321_deg": [30.0, -40.0, 50.0]}).start()["mrp"]
    assert np.allclose(np.array(attitude.dcm(ca.DM(mrp))), roll @ pitch @ yaw, atol=1e-14)


def test_momentum_is_taken_away_across_the_field_and_nothing_turns(rng):
    """Whatever is wanted comes out; what coils add takes k of the momentum across B; the rest spins to its speeds."""
    axes, spin, k = units(rng, 4), ca.DM([0.02, 0.03, 0.02, 0.01]), 1e-3
    speeds, rest = ca.DM(rng.uniform(-200, 200, 4)), ca.DM(rng.uniform(-100, 100, 4))
    field, torque = rng.normal(size=3) * 3e-5, rng.normal(size=3) * 0.02
    seen = SimpleNamespace(wheel_speed=speeds, magnetic_field=ca.DM(field))
    for coils in (ca.DM.eye(3), units(rng, 5)):
        count = coils.shape[1]
        sharing = MomentumSharing(axes, spin, coils, ca.DM.ones(count) * 1e6, k, 0.01, rest, 2, 1)
        told = np.array(ca.DM(sharing(seen, ca.DM(torque)))).ravel()
        wheels, dipole = told[:4], np.array(coils) @ told[6 : 6 + count]
        stored = np.array(axes) @ np.array(spin * speeds).ravel()
        outside = np.cross(dipole, field)
        across = stored - field * (field @ stored) / (field @ field)
        assert np.allclose(outside, -k * across, rtol=1e-10)
        assert np.allclose(-np.array(axes) @ wheels + outside, torque, rtol=1e-12, atol=1e-14)
        assert not told[4:6].any()
        assert told[-1] == 0
        idle = np.linalg.svd(np.array(axes))[2][-1]
        assert np.isclose(idle @ wheels, -0.01 * idle @ np.array(spin * (speeds - rest)).ravel(), rtol=1e-9)
    one = MomentumSharing(axes, spin, ca.DM([0, 0, 1]), ca.DM([2.0]), 1.0, 0.0, rest)
    told = np.array(ca.DM(one(seen, ca.DM(torque)))).ravel()
    assert abs(told[4]) == 2.0  # within its limit, and the wheels know
    assert np.allclose(-np.array(axes) @ told[:4] + np.cross([0, 0, told[4]], field), torque, rtol=1e-12, atol=1e-14)
