"""Numbers of Huang and Duan (2019) that no flight answers, against equations written out by hand."""

from itertools import product

import numpy as np
import pytest
from scipy.optimize import linprog, minimize

from casadi_gnc.allocation import AllocationProblem, solve
from casadi_gnc.fidelity.computations import huang2019

R = np.array([[0.63708, 0.63708, -0.43388], [-0.87855, 0.61925, 0.78026], [0.76577, -0.45897, 0.45048]])
C_0 = R @ (np.hstack([np.eye(3), np.full((3, 1), 3**-0.5)]) - 2.0)
MAP = 0.338 * C_0
CORNERS = np.array(list(product((-1.0, 1.0), repeat=3)))


def test_entries():
    for row, column in product((1, 2, 3), (1, 2, 3, 4)):
        assert huang2019.configuration_entry(row, column) == pytest.approx(C_0[row - 1, column - 1], rel=1e-12)
    for row in (1, 2, 3):
        assert huang2019.uncertainty_entry(row, 0.3) == pytest.approx(0.3 * abs(R[row - 1].sum()), rel=1e-12)
    assert huang2019.effectiveness_rank() == 3


def test_cube_is_the_largest_whose_corners_are_attainable():
    """A linear program a corner: the largest t with t corner = C_0 J_w x, |x| <= 7."""
    reach = []
    for corner in CORNERS:
        found = linprog(
            [0, 0, 0, 0, -1],
            A_eq=np.hstack([MAP, -corner[:, None]]),
            b_eq=np.zeros(3),
            bounds=[(-7, 7)] * 4 + [(0, None)],
        )
        reach.append(-found.fun)
    assert huang2019.attainable_cube() == pytest.approx(min(reach), rel=1e-6)


def test_largest_acceleration_is_at_a_corner():
    balanced = np.linalg.inv(np.vstack([MAP, np.ones(4)]))[:, :3]
    for method, inverse in (("pinv", np.linalg.pinv(MAP)), ("balanced", balanced)):
        by_hand = np.abs(CORNERS @ inverse.T).max() * 0.5
        assert huang2019.largest_acceleration(method, 0.5) == pytest.approx(by_hand, rel=1e-9)
    assert np.allclose(balanced.sum(axis=0), 0, atol=1e-12)


def test_no_allocation_takes_more_than_the_bound(rng):
    """Robust allocation of any weight, for torques small enough that no bound is met."""
    shifts = np.array([0.3 * R @ corner for corner in CORNERS])[:, :, None]
    pinv = huang2019.mean_acceleration_bound("pinv", 1.0)
    balanced = huang2019.mean_acceleration_bound("balanced", 1.0)
    for weight in (1.0, 30.0, 1e4):
        problem = AllocationProblem(
            MAP,
            lower=-7.0,
            upper=7.0,
            coupling=np.full((1, 4), 0.338),
            errors=shifts,
            effort_weight=1.0,
            change_weight=0.0,
            accuracy_weight=weight,
        )
        for command in rng.uniform(-0.1, 0.1, (10, 3)):
            size = np.linalg.norm(command)
            assert np.linalg.norm(solve(problem, command).forces) <= balanced * size * (1 + 1e-6)
            assert np.linalg.norm(np.linalg.pinv(MAP) @ command) <= pinv * size * (1 + 1e-12)
    direction = np.linalg.svd(np.linalg.pinv(MAP))[2][0]
    assert np.linalg.norm(np.linalg.pinv(MAP) @ direction) == pytest.approx(pinv, rel=1e-12)  # it is attained


def test_torque_map_keeps_its_sign():
    poles = []
    for corner in CORNERS:
        true = R @ (np.hstack([np.eye(3), np.full((3, 1), 3**-0.5)]) - (2.0 + 0.65 * corner)[:, None])
        poles += list(np.linalg.eigvals(true @ np.linalg.pinv(C_0)).real)
    assert huang2019.torque_map_pole(0.65) == pytest.approx(min(poles), rel=1e-9)
    assert huang2019.torque_map_pole(2.5) < 0  # and would not, farther off


def test_sdp_has_the_optimum_of_a_third_method():
    """Sequential quadratic programming on the epigraph of the worst corner."""
    command, weight = np.array([0.3, -0.2, 0.4]), 1e4
    maps = [MAP - 0.3 * 0.338 * np.outer(R @ corner, np.ones(4)) for corner in CORNERS]
    scale = 1e-2
    rows = [
        {"type": "ineq", "fun": lambda z, m=m: z[4] - scale * weight * np.sum((command - m @ z[:4]) ** 2)} for m in maps
    ]
    start = np.append(np.linalg.pinv(MAP) @ command, 100.0)
    found = minimize(
        lambda z: scale * z[:4] @ z[:4] + z[4],
        start,
        constraints=rows,
        method="SLSQP",
        options={"ftol": 1e-12, "maxiter": 500},
    )
    shifts = np.array([0.3 * R @ corner for corner in CORNERS])[:, :, None]
    problem = AllocationProblem(
        MAP,
        lower=-7.0,
        upper=7.0,
        coupling=np.full((1, 4), 0.338),
        errors=shifts,
        effort_weight=1.0,
        change_weight=0.0,
        accuracy_weight=weight,
    )
    assert huang2019._sdp_cost(problem, command) == pytest.approx(found.fun / scale, rel=1e-5)
    assert huang2019.sdp_excess(0.3, weight, 2) < 1e-6


def test_statics_of_the_printed_fault():
    """0.2 N m of bias less the largest disturbance of that axis, at half strength; PD gain 14."""
    assert huang2019.static_torque("huang2019/nominal") == pytest.approx((0.2 - 0.005) / 0.5, rel=1e-12)
    assert huang2019.resting_mean("huang2019/nominal", 50.0, 100.0) == pytest.approx(0.195, rel=1e-12)
    assert huang2019.static_torque("huang2019/tough") == pytest.approx((0.2 - 0.05) / 0.5, rel=1e-12)
    assert huang2019.static_attitude("huang2019/nominal") == pytest.approx(0.195 / 7, rel=1e-12)


@pytest.mark.slow
def test_every_corner_is_counted():
    """Without faults each of the eight flights settles; none does below zero."""
    assert huang2019.corners_lost("huang2019/fault_free", "observers_pinv", 0.65, 0.3) == 0
    assert huang2019.corners_lost("huang2019/fault_free", "observers_pinv", 0.65, 0.0) == 8


def test_robust_allocation_takes_more():
    """Independently simulated: 2.7 times the acceleration of the pseudo-inverse."""
    assert huang2019.acceleration_ratio("huang2019/nominal") == pytest.approx(2.7, abs=0.2)
