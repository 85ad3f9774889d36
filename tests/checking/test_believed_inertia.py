"""A believed inertia in other axes is told; one of a wrong size is not, for that is another fault."""

import casadi as ca
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from casadi_gnc.checking import check
from casadi_gnc.checking.geometry import turned_inertia
from casadi_gnc.problem_files.loading import load

RNG = np.random.default_rng(11)


def body() -> np.ndarray:
    """Return the inertia of some points of mass about their centre."""
    points = RNG.normal(size=(6, 3)) * [1.0, 0.6, 0.3]
    points -= points.mean(axis=0)
    return sum((p @ p) * np.eye(3) - np.outer(p, p) for p in points)


@pytest.mark.parametrize("angle", [0.02, 0.3, 1.2])
def test_a_turn_is_measured_and_a_factor_is_not(angle):
    for _ in range(5):
        inertia, axis = body(), RNG.normal(size=3)
        turn = Rotation.from_rotvec(angle * axis / np.linalg.norm(axis)).as_matrix()
        turned = turn @ inertia @ turn.T
        moved = np.linalg.norm(turned - inertia) / np.linalg.norm(inertia)
        assert turned_inertia(turned, [inertia]).value == pytest.approx(moved, rel=1e-6)
        assert turned_inertia(1.3 * inertia, [inertia]).value == pytest.approx(0.0, abs=1e-7)
        assert turned_inertia(inertia, [turned, inertia]).value == pytest.approx(0.0, abs=1e-7)


def test_an_inertia_in_the_frame_of_the_parts_is_told():
    mission = load("huang2020/detumble")
    assert verdict(mission) == "ok"
    law = mission.scheme("observer_pinv").law
    turn = np.array(ca.DM(mission.craft.matrix()))
    inertia = np.array(ca.DM(law.believed_inertia()))
    other = (turn.T @ inertia @ turn).tolist()
    assert verdict(load("huang2020/detumble", {"believed.inertia_kg_m2": other})) == "warn"
    near = (1.08 * inertia).tolist()
    assert verdict(load("huang2020/detumble", {"believed.inertia_kg_m2": near})) == "ok"


def verdict(mission) -> str:
    found = check(mission, "observer_pinv")
    return next(one.verdict for one in found if one.name == "geometry.believed_turn")
