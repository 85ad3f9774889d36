"""Truth: scipy's Rotation, the matrices of MRPs, central differences."""

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation

from casadi_gnc.mechanics import attitude, quaternions

unit = arrays(float, 4, elements=st.floats(-1, 1, allow_nan=False)).filter(lambda q: q @ q > 1e-2)
turns = unit.map(lambda q: q / np.sqrt(q @ q))
vectors = arrays(float, 3, elements=st.floats(-3, 3, allow_nan=False))


def dense(value) -> np.ndarray:
    return np.array(ca.DM(value)).squeeze()


def matrix(q: np.ndarray) -> np.ndarray:
    """scipy's matrix turns vectors within a frame; ours changes the frame, hence the transpose."""
    return Rotation.from_quat(q, scalar_first=True).as_matrix().T


@given(turns, turns, vectors)
def test_matrices_and_products_are_scipys(a, b, vector):
    assert np.allclose(dense(quaternions.dcm(ca.DM(a))), matrix(a), atol=1e-14)
    assert np.allclose(dense(quaternions.turned(ca.DM(a), ca.DM(vector))), matrix(a) @ vector, atol=1e-13)
    assert np.allclose(matrix(dense(quaternions.compose(ca.DM(a), ca.DM(b)))), matrix(a) @ matrix(b), atol=1e-14)
    assert np.allclose(matrix(dense(quaternions.relative(ca.DM(a), ca.DM(b)))), matrix(a) @ matrix(b).T, atol=1e-14)


@given(turns, vectors)
def test_rate_is_the_mrps_rate(q, w):
    """s = v/(1 + c) moves as its quaternion says."""
    if q[0] < -0.9:
        return  # MRPs grow without bound towards a full turn
    symbol = ca.SX.sym("q", 4)
    slope = ca.Function("slope", [symbol], [ca.jacobian(symbol[1:] / (1 + symbol[0]), symbol)])
    moved = dense(slope(q)) @ dense(quaternions.rate(ca.DM(q), ca.DM(w)))
    s = q[1:] / (1 + q[0])
    assert np.allclose(moved, dense(attitude.mrp_rate(ca.DM(s), ca.DM(w))), atol=1e-10)


@given(turns)
def test_every_representation_comes_back(q):
    there = matrix(q)
    for back in (
        quaternions.from_mrp(quaternions.to_mrp(ca.DM(q))),
        quaternions.from_dcm(ca.DM(there)),
        quaternions.from_rotation_vector(quaternions.to_rotation_vector(ca.DM(q))),
        quaternions.normalised(3.7 * ca.DM(q)),
        quaternions.conjugate(quaternions.conjugate(ca.DM(q))),
    ):
        assert np.allclose(matrix(dense(back)), there, atol=2e-14)
    yaw, pitch, roll = dense(quaternions.to_321(ca.DM(q)))
    if abs(pitch) < 1.57:  # beyond, yaw and roll are one turn
        assert np.allclose(matrix(dense(quaternions.from_321(yaw, pitch, roll))), there, atol=1e-9)
    assert dense(quaternions.from_dcm(ca.DM(there)))[0] >= 0
    assert np.linalg.norm(dense(quaternions.to_mrp(ca.DM(q)))) <= 1 + 1e-15


@given(st.floats(-np.pi, np.pi), st.floats(-np.pi / 2, np.pi / 2), st.floats(-np.pi, np.pi))
def test_angles_turn_as_frames_do(yaw, pitch, roll):
    found = matrix(dense(quaternions.from_321(yaw, pitch, roll)))
    assert np.allclose(found, dense(attitude.frame_rotation(yaw, pitch, roll)), atol=1e-14)
    assert np.allclose(found.T, Rotation.from_euler("ZYX", [yaw, pitch, roll]).as_matrix(), atol=1e-14)


@pytest.mark.parametrize("size", [0.0, 1e-300, 1e-9, 1e-4, 1.9999e-2, 2.0001e-2, 1.0, 3.1415])
def test_rotation_vectors_of_every_size_with_their_slope(size):
    """The series and the functions meet, and so do their derivatives: to rounding at any size."""
    axis = np.array([2.0, -1.0, 2.0]) / 3
    turn = ca.SX.sym("turn", 3)
    q = quaternions.from_rotation_vector(turn)
    value, slope = ca.Function("f", [turn], [q, ca.jacobian(q, turn)])(size * axis)
    expected = np.r_[np.cos(size / 2), np.sin(size / 2) * axis]
    assert np.allclose(dense(value), expected, atol=1e-15)
    along = np.r_[-np.sin(size / 2), np.cos(size / 2) * axis] / 2
    assert np.allclose(dense(slope) @ axis, along, atol=2e-15)
    back = dense(quaternions.to_rotation_vector(ca.DM(expected)))
    assert np.allclose(back, size * axis, atol=1e-14 if size < 3 else 1e-11)
