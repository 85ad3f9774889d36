"""Bounds of the mass centre. Truth: the sampled map of rate damping by hand, and flights on both sides of a bound."""

from typing import Any

import numpy as np
import pytest

import casadi_gnc as gnc
from casadi_gnc.checking.mass_centre import mass_centre_bounds, reach

KEY = "truth.centre_of_mass_error_m"


def rate_map(mission, error):
    """Return w+ = (1 - h k J^-1 T(d)) w in the chaser's frame, with T = A(c + d) A(c)^+ from the table of thrusters."""
    craft, law = mission.craft, mission.scheme("damping_pinv").law
    thrusters, turn = craft.thrusters, np.array(craft.matrix())
    places, ways = np.array(thrusters.positions_m), np.array(thrusters.directions)

    def torques(centre):
        return np.cross(places - centre, ways).T

    known = np.array(craft.centre_of_mass_m)
    sharing = torques(known + error) @ np.linalg.pinv(torques(known))
    inertia = turn.T @ np.diag([0.49019, 1.2089, 1.2916]) @ turn * craft.truth.inertia_factor
    return np.eye(3) - 0.1 * law.rate_gain * np.linalg.solve(inertia, sharing)


@pytest.mark.slow
def test_rate_damping_by_hand():
    """Of the six ends each is the first error along its axis at which a pole of the map by hand leaves the circle."""
    mission = gnc.load("huang2020/detumble")
    found = mass_centre_bounds(mission, mission.scheme("damping_pinv"))

    def radius(error):
        return np.abs(np.linalg.eigvals(rate_map(mission, error))).max()

    for axis in range(3):
        for end in (found.low[axis], found.high[axis]):
            unit = np.sign(end) * np.eye(3)[axis]
            for share in np.linspace(0.0, 0.999, 300):
                assert radius(share * abs(end) * unit) < 1 + 1e-6
            assert radius(1.001 * abs(end) * unit) > 1 + 1e-6
    nearest, towards = found.nearest, np.array(found.towards)
    assert radius(0.999 * nearest * towards) < 1 + 1e-6 < radius(1.001 * nearest * towards)
    assert nearest <= min(np.abs([found.low, found.high]).min(), 0.2345)


@pytest.mark.slow
def test_flights_on_both_sides_of_a_bound():
    """Nothing else acting, small rates shrink within the bound and grow beyond.

    Beside each thruster is one that pushes the other way: of a pair that is told f/2 and -f/2 one makes f/2, so the
    flight is linear, at half the gain, which leaves the error at which the torques lose a direction what it is.
    """
    craft: Any = gnc.load("huang2020/detumble").craft
    printed = craft.thrusters
    both = [list(map(float, way)) for way in printed.directions]
    rest = {"spacecraft.orbit_engine.force_N": 0.0, "environment.constant_torque_N_m": [0.0] * 3,
            "environment.orbit_rate_rad_per_s": 0.0, "spacecraft.thrusters.positions_m": 2 * printed.positions_m,
            "spacecraft.thrusters.directions": both + [[-each for each in way] for way in both],
            "environment.harmonic.1.amplitude_N_m": [0.0] * 3, "environment.harmonic.2.amplitude_N_m": [0.0] * 3,
            "initial.rate_rad_per_s": [1e-5, 1e-5, 1e-5], "timing.duration_s": 400.0}  # fmt: skip
    mission = gnc.load("huang2020/detumble", rest)
    (found,) = (one.mass_centre for one in gnc.margins(mission, "damping_pinv"))
    assert found is not None
    for low in (found.low[0], found.low[1]):
        axis = found.low.index(low)
        build = gnc.vary(mission, [f"{KEY}.{axis + 1}"], "damping_pinv")
        for share, grows in ((0.8, False), (1.2, True)):
            rate = build.fly({f"{KEY}.{axis + 1}": share * low})["rate"]
            first, last = np.linalg.norm(rate[0]), np.linalg.norm(rate[-1])
            assert (last > 10 * first) if grows else (last < first / 10)


def test_a_loop_that_ends_at_a_plane():
    def unstable(errors):
        return errors @ np.array([0.6, 0.8, 0.0]) > 0.3

    assert reach(unstable, np.array([1.0, 0.0, 0.0])) == pytest.approx(0.5, rel=1e-6)
    assert reach(unstable, np.array([0.6, 0.8, 0.0])) == pytest.approx(0.3, rel=1e-6)
    assert reach(unstable, np.array([0.0, 0.0, 1.0])) == np.inf


@pytest.mark.parametrize(("name", "key"), [("shi2020/docking", ""), ("satellites/slew", KEY)])
def test_where_no_force_acts_beside_the_centre_there_is_no_bound(name, key):
    mission = gnc.load(name)
    found = mass_centre_bounds(mission, mission.schemes[0])
    assert found.why == "no force acts beside the centre of mass"
    assert found.key == key
    assert np.isinf(found.low + found.high).all()
