"""Numbers of Huang, Biggs, Duan (2020), doi:10.1016/j.ast.2019.105572, that no flight answers."""

from __future__ import annotations

import math
from typing import Any

import casadi as ca
import numpy as np

import casadi_gnc
from casadi_gnc.allocation import AllocationProblem, solve
from casadi_gnc.allocation.attainable import attainable
from casadi_gnc.errors import ProblemError
from casadi_gnc.fidelity.computations.conditions import condition_of
from casadi_gnc.mechanics import attitude
from casadi_gnc.mechanics.thrusters import ThrusterGeometry
from casadi_gnc.missions.mission import Mission
from casadi_gnc.vehicles.combined_spacecraft.plant import BodyPart, compose_inertia

Rows = list[list[float]]


def _angles() -> np.ndarray:
    """Return R_sc by the angles that its correct digits come from, Rx(pi/3) Ry(pi/7) Rz(pi/4)."""
    return np.array(attitude.frame_rotation(math.pi / 4, math.pi / 7, math.pi / 3))


def _place(number: int) -> int:
    """Return the place of an axis, row or column given from 1 to 3."""
    if number not in (1, 2, 3):
        raise ProblemError(f"an axis, row or column is {number!r}, expected 1, 2 or 3")
    return number - 1


def rotation_defect(matrix: Rows) -> float:
    """Return the largest entry of R R' - I."""
    r = np.array(matrix)
    return float(np.abs(r @ r.T - np.eye(3)).max())


def rotation_entry(row: int, column: int) -> float:
    """Return an entry of the rotation by its angles; rows and columns from 1."""
    return float(_angles()[_place(row), _place(column)])


def _seen(positions_m: Rows, directions: Rows) -> ThrusterGeometry:
    return ThrusterGeometry.from_rows(positions_m, directions).seen_from(ca.DM(_angles()), [0.05, 0.05, 0.05])


def thruster_moment(position_m: list[float], direction: list[float], axis: int) -> float:
    """Return an element of a_i = d_i x e_i, (13), [m], of a thruster given in the chaser's frame."""
    return float(np.array(_seen([position_m], [direction]).effectiveness)[_place(axis), 0])


def thruster_position(position_m: list[float], axis: int) -> float:
    """Return an element of d_i = R (d_si - r_c), (8), [m]."""
    return float((_angles() @ (np.array(position_m) - 0.05))[_place(axis)])


def inertia_entry(row: int, column: int, with_links: bool) -> float:
    """Return an entry of the composed inertia (70), [kg m^2], of Table 1, all parts turned by R_sc."""
    return float(_composed(with_links)[_place(row), _place(column)])


def inertia_trace() -> float:
    """Return the trace of the composed inertia (70), [kg m^2]; no choice of rotations changes it."""
    return float(np.trace(_composed(True)))


def _composed(with_links: bool) -> np.ndarray:
    cube, link = ca.diag([0.2666, 0.26, 0.1666]), ca.diag([5e-5, 4.5e-4, 4.5e-4])
    turned = ca.DM(_angles())
    parts = [BodyPart(10.0, cube, p, turned) for p in ([-0.2, 0, 0], [0.2, 0, 0])]
    links = ([-0.05, -0.02, 0.05], [-0.01, -0.05, 0.03], [0.03, 0, 0.01])
    parts += [BodyPart(0.17, link, p, turned) for p in links] if with_links else []
    return np.array(compose_inertia(parts))


def input_norm_squared() -> float:
    """Return k5^2 = |B|^2, B = J0^-1, [1/(kg m^2)^2]."""
    body: Any = casadi_gnc.load("huang2020/slew").schemes[0].law
    return float(np.linalg.norm(np.array(body.body.inverse_inertia), 2) ** 2)


def condition_ratio(problem: str, scheme: str, name: str, changes: dict[str, Any] | None = None) -> float:
    """Return left over right side of a theorem's condition; at least 1 where it holds.

    Parameters
    ----------
    name : of the law's check, e.g. "gains.theorem1.filter".
    """
    mission = casadi_gnc.load(problem, changes or {})
    found = condition_of(mission.scheme(scheme).law, name)
    return found.value / found.limit


def _problem(mission: Mission, **changes: Any) -> AllocationProblem:
    actuation = mission.schemes[0].actuation
    matrix = np.array(actuation.matrix(None))
    return AllocationProblem(matrix, lower=actuation.lower, upper=actuation.upper, **changes)


def attainable_cube() -> float:
    """Return the half width of the largest cube of torques that the thrusters make, [N m]."""
    return float(attainable(_problem(casadi_gnc.load("huang2020/slew")), np.ones(3)).nominal.box[0])


def interior_excess(samples: int) -> float:
    """Return by how much an error inside the box can be worse than the worst corner, relative; Theorem 3 says 0.

    For `samples` random commands the robust forces are taken and the squared torque error at random
    errors inside the box compared with that at its corners.
    """
    mission = casadi_gnc.load("huang2020/slew")
    problem: AllocationProblem = mission.scheme("funnel_robust").actuation.allocator.problem
    rng = np.random.default_rng(1)
    corners = np.array(problem.errors)  # (V, R, K): D_v
    excess = -np.inf
    for _ in range(samples):
        command = rng.uniform(-5e-4, 5e-4, 3)
        forces = solve(problem, command).forces
        nominal = command - problem.effectiveness @ forces
        leverage = problem.coupling @ forces
        worst = max(float(np.sum((nominal - d @ leverage) ** 2)) for d in corners)
        for _ in range(20):
            weights = rng.dirichlet(np.ones(len(corners)))
            inside = np.tensordot(weights, corners, axes=1)
            excess = max(excess, float(np.sum((nominal - inside @ leverage) ** 2)) / worst - 1)
    return excess
