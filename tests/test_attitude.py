"""Truth: scipy's Rotation, central differences, and the algebra of rotations."""

import casadi as ca
import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation

from casadi_gnc.mechanics import attitude

component = st.floats(-2, 2, allow_nan=False)
mrps = arrays(float, 3, elements=component)
vectors = arrays(float, 3, elements=st.floats(-10, 10, allow_nan=False))


def dense(value) -> np.ndarray:
    return np.array(ca.DM(value)).squeeze()


def scipy_dcm(s: np.ndarray) -> np.ndarray:
    """scipy's matrix turns vectors within a frame; ours changes the frame, hence the transpose."""
    return Rotation.from_mrp(s).as_matrix().T


@given(mrps)
def test_dcm_is_scipys(s):
    assert np.allclose(dense(attitude.dcm(ca.DM(s))), scipy_dcm(s), atol=1e-13)


@given(mrps)
def test_reference_z_is_the_third_column(s):
    assert np.allclose(dense(attitude.reference_z(ca.DM(s))), scipy_dcm(s)[:, 2], atol=1e-13)


@given(mrps, mrps)
def test_composition_multiplies_matrices(a, b):
    composed = dense(attitude.compose(ca.DM(a), ca.DM(b)))
    denominator = 1 + (a @ a) * (b @ b) - 2 * a @ b
    if denominator > 1e-6:  # else the product is a full turn, where MRPs are infinite
        assert np.allclose(scipy_dcm(composed), scipy_dcm(a) @ scipy_dcm(b), atol=1e-8)
    relative = dense(attitude.relative(ca.DM(a), ca.DM(a)))
    assert np.allclose(relative, 0, atol=1e-12)


@given(mrps.filter(lambda s: s @ s > 1e-12))
def test_shadow_is_the_same_attitude(s):
    shadow = dense(attitude.shadow(ca.DM(s)))
    assert np.allclose(scipy_dcm(shadow), scipy_dcm(s), atol=1e-9)
    assert np.isclose(np.linalg.norm(shadow) * np.linalg.norm(s), 1)


@given(mrps)
def test_short_way_is_short_and_the_same(s):
    short = dense(attitude.short_way(ca.DM(s)))
    assert short @ short <= 1 + 1e-12
    assert np.allclose(scipy_dcm(short), scipy_dcm(s), atol=1e-12)


@given(mrps, vectors)
def test_kinematics_and_inverse(s, w):
    rate = dense(attitude.mrp_rate(ca.DM(s), ca.DM(w)))
    assert np.allclose(rate, dense(attitude.kinematic_matrix(ca.DM(s))) @ w, atol=1e-12)
    assert np.allclose(dense(attitude.body_rate(ca.DM(s), ca.DM(rate))), w, rtol=1e-10, atol=1e-10)


def test_kinematics_turn_the_matrix(rng):
    """C' = -[w]x C along s' = G w; the difference quotient is central, so its error is O(h^2)."""
    h = 1e-5
    for _ in range(20):
        s, w = rng.uniform(-1, 1, 3), rng.uniform(-1, 1, 3)
        rate = dense(attitude.mrp_rate(ca.DM(s), ca.DM(w)))
        quotient = (scipy_dcm(s + h * rate) - scipy_dcm(s - h * rate)) / (2 * h)
        assert np.allclose(quotient, np.cross(np.eye(3), w).T @ scipy_dcm(s), atol=1e-8)


def test_frame_rotation_is_scipys(rng):
    for yaw, pitch, roll in rng.uniform(-3, 3, (20, 3)):
        expected = Rotation.from_euler("ZYX", [yaw, pitch, roll]).as_matrix().T
        assert np.allclose(dense(attitude.frame_rotation(yaw, pitch, roll)), expected, atol=1e-15)
