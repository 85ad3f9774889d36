"""Truth: the tables of Huang, Biggs, Duan (2020) with three corrections (docs/errata.md).

Printed to five decimals, so entries agree to 1e-5 (the paper rounds its intermediate results).
"""

import casadi as ca
import numpy as np
import pytest

import casadi_gnc
from casadi_gnc.mechanics.attitude import frame_rotation
from casadi_gnc.mechanics.rigid_body import inverse3
from casadi_gnc.mechanics.thrusters import ThrusterGeometry, corner_errors
from casadi_gnc.problem_files.document import read

R_SC = [[0.63708, 0.63708, -0.43388], [-0.08785, 0.61925, 0.78026], [0.76577, -0.45897, 0.45048]]
CORNERS = {  # Table 3: position of the three thrusters of each corner; z of the last corrected
    1: [-0.08540, -0.05827, 0.12966],
    4: [0.04201, 0.06558, 0.03786],
    7: [-0.21282, -0.04070, -0.02350],
    10: [0.00137, -0.07290, -0.20539],
}
DIRECTIONS = {
    1: [0.63708, 0.61925, -0.45897],
    2: [-0.63708, 0.08785, -0.76577],
    3: [-0.43388, 0.78026, 0.45048],
    9: [0.63708, -0.08785, 0.76577],
}
A_C = np.array(
    [  # a_9 z corrected to +0.04462
        [-0.05355, 0.04341, -0.01576],
        [0.03323, -0.14800, -0.04462],
        [-0.12742, -0.01778, -0.09192],
        [-0.05355, 0.00805, 0.04547],
        [0.05355, -0.04341, 0.01576],
        [0.0, 0.03536, -0.06124],
        [0.03323, -0.11265, -0.10586],
        [0.0, -0.10607, 0.18371],
        [-0.03323, 0.14800, 0.04462],
        [0.12742, 0.08850, -0.03056],
        [-0.16065, 0.13022, -0.04729],
        [-0.07387, -0.13190, 0.04632],
    ]
).T


@pytest.fixture(scope="module")
def rotation():
    return frame_rotation(np.pi / 4, np.pi / 7, np.pi / 3)


@pytest.fixture(scope="module")
def geometry(rotation):
    data = read("huang2020/detumble").data
    mounted = data["spacecraft"]["thrusters"]
    return ThrusterGeometry.from_rows(mounted["positions_m"], mounted["directions"]).seen_from(rotation, [0.05] * 3)


def test_rotation(rotation):
    assert np.allclose(np.array(rotation), R_SC, atol=1e-5)


def test_table_3(geometry):
    positions, directions = np.array(geometry.positions), np.array(geometry.directions)
    for corner, expected in CORNERS.items():
        for i in range(corner - 1, corner + 2):
            assert np.allclose(positions[:, i], expected, atol=1e-5)
    for i, expected in DIRECTIONS.items():
        assert np.allclose(directions[:, i - 1], expected, atol=1e-5)


def test_effectiveness(geometry):
    assert np.allclose(np.array(geometry.effectiveness), A_C, atol=1.1e-5)


def test_orbit_engine_torque():
    torque = casadi_gnc.load("huang2020/detumble").truth.body.constant_torque
    assert np.allclose(torque, [0, 1.77e-4, -3.06e-4], atol=5e-7)


def test_corner_errors_are_the_change_of_effectiveness(rotation, geometry):
    """dA F = D E F for a centre of mass that really is elsewhere."""
    data = read("huang2020/detumble").data
    mounted = ThrusterGeometry.from_rows(*(data["spacecraft"]["thrusters"][k] for k in ("positions_m", "directions")))
    errors = corner_errors(rotation, [-5e-3] * 3, [5e-3, 5e-3, 7e-3])
    shifts = [(x, y, z) for x in (-5e-3, 5e-3) for y in (-5e-3, 5e-3) for z in (-5e-3, 7e-3)]
    for error, shift in zip(errors, shifts, strict=True):
        moved = mounted.seen_from(rotation, [0.05 + s for s in shift])
        change = np.array(moved.effectiveness - geometry.effectiveness)
        assert np.allclose(error @ np.array(geometry.directions), change, atol=1e-16)


def test_inverse3(rng):
    for _ in range(50):
        matrix = rng.normal(size=(3, 3))
        assert np.allclose(np.array(inverse3(ca.DM(matrix))) @ matrix, np.eye(3), atol=1e-9)
