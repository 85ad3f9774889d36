"""Regions of poles: what lies in them by their definition, and gains by formulas of plants of one state."""

import numpy as np
import pytest

from casadi_gnc.errors import SynthesisError
from casadi_gnc.synthesis import GainStatus, box_vertices, input_ellipsoid, observer, state_feedback
from casadi_gnc.synthesis.gains import certify_gains
from casadi_gnc.synthesis.regions import disc, fastest, half_plane, regions, sector

A, B = np.array([[0, 1.0], [0, 0]]), np.array([[0], [0.05]])
C, D = np.vstack([np.eye(2), np.zeros((1, 2))]), np.array([[0], [0], [1.0]])
ONE = ([[0.0]], [[1.0]], [[1.0]], [[1.0], [0.0]], [[0.0], [1.0]])  # x' = u + w, z = (x, u)

INSIDE = [
    (half_plane(0.5), lambda pole: pole.real < -0.5),
    (disc(-2.0, 1.0), lambda pole: abs(pole + 2) < 1),
    (fastest(1.5), lambda pole: abs(pole) < 1.5),
    (sector(0.7), lambda pole: -pole.real > 0.7 * abs(pole)),
]


@pytest.mark.parametrize(("region", "inside"), INSIDE)
def test_depth_is_positive_inside_alone(region, inside):
    rng = np.random.default_rng(1)
    points = rng.uniform(-4, 1, 300) + 1j * rng.uniform(-3, 3, 300)
    told = [inside(point) for point in points]
    assert [region.depth(point) > 0 for point in points] == told
    assert 10 < sum(told) < 290


@pytest.mark.parametrize(
    ("asked", "largest"),
    [
        ({"fastest_rad_s": 2.0}, 2.0),
        ({"disc_rad_s": [-2.0, 1.0]}, 3.0),
        ({"fastest_rad_s": 5.0, "decay_1_s": 1.0}, 5.0),
    ],
)
def test_the_smallest_norm_is_that_of_the_fastest_pole_allowed(asked, largest):
    """The norm of 1/(s + K) to (x, K x) is root(1 + K^2)/K, which falls with K = -pole."""
    found = state_feedback(*ONE, **asked)
    assert found.status is GainStatus.CERTIFIED, found.sentence()
    assert found.smallest[1] == pytest.approx(np.sqrt(1 + largest**2) / largest, rel=1e-4)  # the margins
    assert all(depth > 0 for depth in found.depths.values())
    assert len(found.depths) == len(asked)
    assert found.gains["K"][0, 0] <= largest


def test_all_regions_are_kept_together_and_by_every_recipe():
    asked = {"fastest_rad_s": 3.0, "damping": 0.8, "decay_1_s": 0.3}
    plain = state_feedback(A, B, B, C, D)
    assert plain.poles[0].real > -0.1  # so the region costs something
    for found in (
        state_feedback(A, B, B, C, D, **asked),
        observer(A.T, B.T, C.T, D.T, B.T, **asked),
        input_ellipsoid(A, B, box_vertices([-4, -0.1], [4, 0.1]), 40.0, **asked),
    ):
        assert found.status is GainStatus.CERTIFIED, found.sentence()
        assert set(found.depths) == {"fastest pole", "damping", "decay"}
        for pole in found.poles:
            assert abs(pole) < 3
            assert -pole.real > 0.8 * abs(pole)
            assert pole.real < -0.3


def test_a_mode_outside_that_no_input_reaches_is_refuted():
    """Its pole is at -0.2, whatever the gains."""
    plant = np.diag([0.0, -0.2]), [[1.0], [0.0]], np.eye(2), np.eye(3)[:, :2], np.eye(3)[:, 2:]
    found = state_feedback(*plant, gamma=50.0, decay_1_s=0.5)
    assert found.status is GainStatus.INFEASIBLE, found.sentence()
    assert found.lmis.conflict == ("Lyapunov matrix", "decay")


def test_gains_whose_poles_leave_a_region_are_no_success():
    good = state_feedback(A, B, B, C, D)
    loop = A - B @ good.gains["K"]
    left = certify_gains(good.gains, good.lmis, loop, 1.0, regions=regions(decay_1_s=0.5, damping=0.5))
    assert left.status is GainStatus.POLES_OUTSIDE
    by = 2 * (0.5 + good.poles[0].real)
    assert left.sentence().endswith(f"It leaves 'decay' by {by:.2g} rad/s.")
    with pytest.raises(SynthesisError, match="outside a region"):
        left.gains  # noqa: B018


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ({"decay_1_s": -1.0}, "decay_1_s is -1, expected a number of at least 0"),
        ({"damping": 1.0}, "damping is 1, expected a number above 0 and below 1"),
        ({"damping": True}, "damping is True, expected a finite number"),
        ({"fastest_rad_s": np.nan}, "fastest_rad_s is nan, expected a finite number"),
        ({"disc_rad_s": [-2.0]}, "disc_rad_s has 1 numbers, expected two"),
        ({"disc_rad_s": [-2.0, 0.0]}, "the radius of a disc is 0, expected a number above 0"),
        ({"disc_rad_s": [3.0, 1.0]}, "disc_rad_s lies in the right half plane"),
        ({"decay_1_s": 2.0, "fastest_rad_s": 1.0}, "no pole meets both fastest_rad_s and decay_1_s"),
        ({"decay_1_s": 4.0, "disc_rad_s": [-2.0, 1.0]}, "no pole meets both disc_rad_s and decay_1_s"),
        ({"fastest_rad_s": 1.0, "disc_rad_s": [-4.0, 1.0]}, "no pole meets both fastest_rad_s and disc_rad_s"),
    ],
)
def test_regions_that_cannot_be_are_refused(asked, words):
    with pytest.raises(SynthesisError, match=words):
        state_feedback(*ONE, **asked)
