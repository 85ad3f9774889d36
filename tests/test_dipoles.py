"""Truth: the gradient of the interaction energy, conservation of angular momentum, numpy's least squares."""

import casadi as ca
import numpy as np
import pytest

from casadi_gnc.mechanics import dipoles

MU0 = 4e-7 * np.pi


def energy(separation, chaser, target):
    """Return -mu_C . B of the target's dipole, [J], from the vector potential's curl written out (Jackson 5.56)."""
    r = ca.sqrt(ca.sumsqr(separation))
    flux = MU0 / (4 * np.pi) * (3 * separation * ca.dot(separation, target) / r**5 - target / r**3)
    return -ca.dot(chaser, flux)


def some(rng, size=1.0):
    return ca.DM(rng.normal(size=3) * size)


@pytest.fixture
def case(rng):
    return [(some(rng, 3.0), some(rng, 5e4), some(rng, 8e5)) for _ in range(20)]


def values(expression) -> np.ndarray:
    return np.array(ca.DM(expression))


def test_force_is_minus_the_gradient_of_the_energy(case):
    """Rounding only: every term is of the size of the result or a few times that."""
    eta, c, m = (ca.SX.sym(name, 3) for name in ("eta", "c", "m"))
    pull = ca.Function("pull", [eta, c, m], [-ca.gradient(energy(eta, c, m), eta)])
    for at in case:
        expected = values(pull(*at))
        assert np.allclose(values(dipoles.force(*at)), expected, rtol=0, atol=1e-13 * np.abs(expected).max())


def test_map_is_the_printed_one(case):
    """Eq. (8), written with powers of eta as printed."""
    for eta, _, m in case:
        e, t = values(eta).ravel(), values(m).ravel()
        r = np.linalg.norm(e)
        xi = (np.outer(e, t) + (t @ e) * np.eye(3) + np.outer(t, e)) / r**5 - 5 / r**7 * np.outer(e, e) * (t @ e)
        expected = 3 * MU0 / (4 * np.pi) * xi
        assert np.allclose(values(dipoles.force_map(eta, m)), expected, rtol=0, atol=1e-13 * np.abs(expected).max())


def test_angular_momentum_is_conserved(case):
    """The two torques and the couple of the two forces add up to nothing."""
    for eta, c, m in case:
        on_chaser, on_target = dipoles.torques(eta, c, m)
        couple = ca.cross(eta, dipoles.force(eta, c, m))
        largest = np.abs(values(couple)).max()
        assert np.allclose(values(on_chaser + on_target + couple), 0, atol=1e-12 * largest)


def test_torque_is_minus_the_gradient_of_the_energy_by_rotation(case):
    """Turning the chaser's moment by a small angle a changes the energy by -torque.a."""
    angle, eta, c, m = (ca.SX.sym(name, 3) for name in ("angle", "eta", "c", "m"))
    turned = c + ca.cross(angle, c)
    slope = ca.Function("slope", [angle, eta, c, m], [-ca.gradient(energy(eta, turned, m), angle)])
    for at in case:
        expected = values(slope(0, *at))
        assert np.allclose(values(dipoles.torques(*at)[0]), expected, atol=1e-12 * np.abs(expected).max())


def test_exact_inverse(case, rng):
    for eta, _, m in case:
        wanted = some(rng, 10.0)
        made = dipoles.force(eta, dipoles.moment_for(wanted, eta, m), m)
        # 1/|c| is at most some 100 in these cases and multiplies rounding.
        assert np.allclose(values(made), values(wanted), rtol=0, atol=1e-12)


@pytest.mark.parametrize("damping", [0.0, 0.05, 0.5])
def test_moment_minimises_the_stated_cost(case, rng, damping):
    for eta, _, m in case:
        wanted = values(some(rng, 10.0)).ravel()
        e, t = values(eta).ravel(), values(m).ravel()
        r, size = np.linalg.norm(e), np.linalg.norm(t)
        strength = 3e-7 * size / r**4
        across = np.cross(e / r, t / size)
        rows = np.vstack([values(dipoles.force_map(eta, m)) / strength, damping * across])
        q = np.linalg.lstsq(rows, np.append(wanted, 0.0), rcond=None)[0]
        found = values(dipoles.moment_for(ca.DM(wanted), eta, m, damping)).ravel() * strength
        assert np.allclose(found, q, rtol=0, atol=1e-11 * np.abs(q).max())


def test_target_across_the_line_of_sight():
    """The map loses one direction at any distance; damped, everything else is still made exactly."""
    for distance in (0.2, 20.0):
        eta, m = ca.DM([distance, 0, 0]), ca.DM([0, 4e5, 0])
        assert np.linalg.matrix_rank(values(dipoles.force_map(eta, m)) * distance**4, tol=1e-9) == 2
        assert float(dipoles.alignment(eta, m)) == 0
        moment = dipoles.moment_for(ca.DM([1.0, -2.0, 3.0]), eta, m, 0.05)
        assert np.allclose(values(dipoles.force(eta, moment, m)).ravel(), [1, -2, 0], atol=1e-12)


def test_damping_bounds_the_moment(rng):
    """|c|/(c^2 + d^2 s^2) is largest at c^2 = d^2/(1 - d^2), where it is 1/(2 d sqrt(1 - d^2))."""
    d, eta = 0.05, ca.DM([1.0, 0, 0])
    strength = 3e-7 * 1e5
    sizes = []
    for c in np.linspace(-0.5, 0.5, 2001):
        m = ca.DM([1e5 * c, 1e5 * np.sqrt(1 - c * c), 0])
        sizes.append(abs(float(dipoles.moment_for(ca.DM([0, 0, 1.0]), eta, m, d)[2])) * strength)
    bound = 1 / (2 * d * np.sqrt(1 - d * d))
    assert max(sizes) <= bound * (1 + 1e-12)
    assert max(sizes) > 0.999 * bound


def test_steered_target_is_aligned_and_its_inverse_well_conditioned(case):
    for eta, _, _ in case:
        m = dipoles.TargetDipole(8e5, steered=True).at(eta)
        assert float(dipoles.alignment(eta, m)) == pytest.approx(1, abs=1e-15)
        assert np.linalg.cond(values(dipoles.force_map(eta, m))) == pytest.approx(2, rel=1e-12)


def test_everything_stays_finite_where_the_craft_meet():
    zero, wanted, m = ca.DM.zeros(3), ca.DM([1.0, 2.0, 3.0]), ca.DM([1e5, 2e5, 0])
    moment = dipoles.moment_for(wanted, zero, m, 0.05)
    for value in (moment, dipoles.force(zero, moment, m), *dipoles.torques(zero, moment, m)):
        assert np.all(np.isfinite(values(value)))
