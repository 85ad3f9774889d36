"""Truth of the computations: vis viva, difference quotients of a flight, random draws, the paper's own formulas."""

import casadi as ca
import numpy as np
import pytest

import casadi_gnc
from casadi_gnc.errors import FlightError
from casadi_gnc.fidelity.computations import sun2018

MU = 3.986e14
#: Printed gains: K_1, K_2, K_3, Lambda, Gamma; extreme eigenvalues.
DAMPING, COMPENSATION, DECAY, SLOPES, POLE = 20.0, 1.0, 0.2, (0.02, 0.15), 0.3


def test_orbit_by_vis_viva():
    """Energy and momentum give e^2 = 1 + 2 E h^2/mu^2; the target differs from the chaser by 0.5 m/s in 4 km/s."""
    for exponent, scale in ((8, 7.078e8), (6, 7.078e6)):
        r, v = scale * np.ones(3), np.array([2e3, 3e3, -2e3])
        radius, speed = np.linalg.norm(r), np.linalg.norm(v)
        energy, momentum = speed**2 / 2 - MU / radius, np.linalg.norm(np.cross(r, v))
        e = np.sqrt(1 + 2 * energy * momentum**2 / MU**2)
        perigee = momentum**2 / MU / (1 + e)
        assert sun2018.perigee(exponent) == pytest.approx(perigee, rel=1e-9)
        assert e > sun2018.eccentricity_bound() - 1e-4
        if exponent == 8:
            assert sun2018.eccentricity() == pytest.approx(e, rel=1e-3)
            assert sun2018.escape_ratio() == pytest.approx(speed / np.sqrt(2 * MU / radius), rel=1e-3)
            assert sun2018.disturbance_phase(200.0) == pytest.approx(200 * np.sqrt(MU / radius**3), rel=1e-9)
    # The least eccentricity over all radii, found by looking, is the bound.
    radii = np.geomspace(1e5, 1e10, 20001)
    apart = np.array([1, 1, 1]) @ np.array([2, 3, -2]) / np.sqrt(3 * 17)
    least = np.sqrt((radii * 17e6 / MU - 1) ** 2 * (1 - apart**2) + apart**2).min()
    assert sun2018.eccentricity_bound() == pytest.approx(least, rel=1e-3)


def test_conditions_by_hand():
    """kappa_1^2 is 3.63 with the energy of rotation and 2.43 with |omega_t(0)|, computed independently."""
    a = min(min(SLOPES) / 8, DAMPING / 4, DECAY / 2 - COMPENSATION**2 / DAMPING, POLE / 2 - 1 / DAMPING)
    left = 2 * a * POLE / (1 + max(SLOPES)) ** 2
    assert sun2018.coupling_ratio() == pytest.approx(left / 3.63, rel=2e-3)  # three digits
    assert sun2018.coupling_ratio_bound() == pytest.approx(left / 2.43, rel=3e-3)  # three digits
    assert sun2018.coupling_ratio_of_energy(0.0) == pytest.approx(sun2018.coupling_ratio(), rel=1e-12)
    assert left / sun2018.coupling_ratio_of_energy(1000.0) > 1e19
    assert sun2018.condition("gains.theorem2.compensator") == pytest.approx(0.05)
    assert sun2018.condition("gains.theorem2.observer") == pytest.approx(0.10)
    assert sun2018.pole_ratio() == pytest.approx(2.0)
    # The tumble is 1.98 degrees per second.
    spin = sun2018.turn_ratio() * sun2018.disturbance_phase(1.0)
    assert 0.5 * np.deg2rad(1.98) < spin < np.deg2rad(1.981)


def test_theorem_bound_by_hand():
    """An independent simulation found |w'| = 7e-4 and a bound of 0.42 with all of a, where epsilon is 0.05."""
    whole, half = sun2018.ultimate_bound(1.0), sun2018.ultimate_bound(0.5)
    assert whole == pytest.approx(0.42, rel=0.05)
    assert half == pytest.approx(whole * np.sqrt(2), rel=1e-12)


def test_lumped_disturbance_by_difference_quotients():
    """M_0 (s(t + h) - s(t))/h = h_s + u + w, with u held; the mean over h differs from the value by h w'/2."""
    mission = casadi_gnc.load("sun2018/as_printed")
    flight, law, h = casadi_gnc.fly(mission, "tracking", decimation=1), mission.scheme("tracking").law, 0.01
    w, error = sun2018._lumped()
    signals = [flight.block(name) for name in law.inputs.names]
    y = ca.SX.sym("y", law.inputs.size)
    now = law.inputs.split(y)
    parts = ca.Function("parts", [y], [law.body.impulse(law.slide(now)), law.known(now)])
    momentum, known = (np.array(part).T for part in parts(np.hstack(signals).T))
    u = np.hstack([flight["achieved_force"], flight["achieved_torque"]])
    for first in (2000, 12000, 20000):
        k = np.arange(first, first + 50)
        quotient = (momentum[k + 1] - momentum[k]) / h - (known[k] + known[k + 1]) / 2 - u[k]
        assert np.allclose(quotient, (w[k] + w[k + 1]) / 2, rtol=0, atol=2e-3)
    # An independent simulation of z(0) = 0: 13.5 N and 15.9 N m, below 0.31 and 0.09 after 20 s.
    assert np.linalg.norm(error[0, :3]) == pytest.approx(13.5, abs=0.2)
    assert np.linalg.norm(error[0, 3:]) == pytest.approx(15.9, abs=0.2)
    assert np.linalg.norm(error[2000:, :3], axis=1).max() < 0.31
    assert np.linalg.norm(error[2000:, 3:], axis=1).max() < 0.09


def test_measured_error_is_error_and_noise():
    """With next to no sensor noise, the true error of an independent noisy simulation, 1 cm or less."""
    quiet = sun2018.measured_error(1e-9, 1e-9)
    assert 1e-3 < quiet < 0.012
    # Variances, an independent simulation: 0.128, the largest of 6000 draws.
    assert sun2018.measured_error(np.sqrt(1e-3), 1e-2) == pytest.approx(0.128, rel=0.1)


def test_noise_alone_passes_the_bound(rng):
    """10 % of draws stay below the level of 10 %; errors that do not foresee the noise only make it worse."""
    level = sun2018.measured_error_bound(1.0, 20, 0.1)
    for offset in (0.0, 0.5):
        draws = np.abs(np.clip(rng.normal(size=(20000, 20)), -3, 3) + offset).max(axis=1)
        assert np.mean(draws < level) < 0.1 + 0.01  # the deviation of 20000 draws is 0.002
    assert np.mean(np.abs(rng.normal(size=(20000, 20))).max(axis=1) < level) == pytest.approx(0.1, abs=0.01)
    assert sun2018.measured_error_bound(0.01, 6000, 0.01) == pytest.approx(0.03)  # cut there


@pytest.mark.parametrize(
    ("found", "expected"),
    [
        (lambda: sun2018.settling_ratio("tracking", "neither", "position_error", 1.0), 55.8 / 51.0),
        (lambda: sun2018.settling_ratio("tracking", "neither", "attitude_error", 0.01), 118.5 / 126.6),
        (lambda: sun2018.settling_ratio("tracking", "observer_only", "attitude_error", 0.01), 118.5 / 114.8),
        (lambda: sun2018.settling_ratio("tracking", "neither", "position_error", 0.1), 0.0),
        (lambda: sun2018.effort_ratio("tracking", "neither", "force", "impulse"), 680 / 725),
        (lambda: sun2018.effort_ratio("tracking", "neither", "torque", "impulse"), 236 / 253),
        (lambda: sun2018.effort_ratio("observer_only", "neither", "force", "impulse"), 748 / 725),
        (lambda: sun2018.effort_ratio("tracking", "neither", "torque", "peak"), 1.0),
    ],
)
def test_comparison_is_the_independent_one(found, expected):
    """Simulated independently, to three digits."""
    assert found() == pytest.approx(expected, rel=6e-3)


def test_what_remains():
    """An independent simulation: 0.0012 m against 0.448 m, 0.0003 against 0.0046; zeta of 34.7 gone after 43.5 s."""
    assert sun2018.steady_ratio("tracking", "neither", "position_error") == pytest.approx(0.0012 / 0.448, rel=0.05)
    assert sun2018.steady_ratio("tracking", "neither", "attitude_error") == pytest.approx(0.0003 / 0.0046, rel=0.2)
    assert sun2018.compensator_share("force") < 1e-9
    assert 0 < sun2018.estimate_error_share("force") < 0.0015 / 13.5 * 1.5


def test_a_scheme_that_never_settles_has_no_time():
    with pytest.raises(FlightError, match="does not settle below 0.1"):
        sun2018.settling_ratio("neither", "tracking", "position_error", 0.1)
