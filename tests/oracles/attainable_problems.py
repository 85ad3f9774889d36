"""Problems whose attainable sets are known or can be enumerated, and their enumeration."""

from itertools import combinations, product

import numpy as np
from scipy.optimize import linprog
from scipy.spatial import ConvexHull

from casadi_gnc.allocation.problem import AllocationProblem
from casadi_gnc.mechanics.attitude import frame_rotation
from casadi_gnc.mechanics.thrusters import ThrusterGeometry
from casadi_gnc.problem_files.document import read


def huang(error: float = 5e-3) -> AllocationProblem:
    data = read("huang2020/detumble").data
    mounted = data["spacecraft"]["thrusters"]
    rotation = frame_rotation(np.pi / 4, np.pi / 7, np.pi / 3)
    geometry = ThrusterGeometry.from_rows(mounted["positions_m"], mounted["directions"]).seen_from(rotation, [0.05] * 3)
    corner = [error] * 3
    return AllocationProblem.of_thrusters(
        geometry, rotation, ([-e for e in corner], corner), lower=0.0, upper=mounted["max_force_N"]
    )


def random_problem(rng, rows, count, lifted=1, vertices=4, lowest=-1.0, size=0.3) -> AllocationProblem:
    """Bounds hold zero for lowest = -1, hold it for some actuators below 0, for none above."""
    lower = lowest + rng.uniform(0, 1, count)
    return AllocationProblem(
        rng.normal(size=(rows, count)),
        lower,
        np.maximum(lower, 0) + rng.uniform(0.1, 1, count),
        coupling=rng.normal(size=(lifted, count)),
        errors=size * rng.normal(size=(vertices, rows, lifted)),
    )


def hexadecachoron() -> AllocationProblem:
    """Four unit forces that must cancel: the cut of the 4-cube by its diagonal plane is an octahedron."""
    effectiveness = np.array([[1, 1, -1, -1], [1, -1, 1, -1], [1, -1, -1, 1]]) / 2
    return AllocationProblem(
        effectiveness,
        -1.0,
        1.0,
        coupling=np.ones((1, 4)),
        errors=[[[0.1], [0.0], [0.0]], [[-0.1], [0], [0]]],
    )


def sliced_vertices(matrix, lower, upper, tie) -> np.ndarray:
    """Every vertex of the forces' polytope, by trying every choice of free forces, through the matrix."""
    count, rank = matrix.shape[1], len(tie)
    found = []
    for free in combinations(range(count), rank):
        fixed = [i for i in range(count) if i not in free]
        for ends in product(*((lower[i], upper[i]) for i in fixed)):
            forces = np.zeros(count)
            forces[fixed] = ends
            forces[list(free)] = np.linalg.solve(tie[:, free], -tie[:, fixed] @ ends) if rank else []
            if np.all(forces >= lower - 1e-9) and np.all(forces <= upper + 1e-9):
                found.append(matrix @ forces)
    return np.array(found)


def faces_of(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    if points.shape[1] == 1:
        return np.array([[1.0], [-1.0]]), np.array([points.max(), -points.min()])
    hull = ConvexHull(points)
    return hull.equations[:, :-1], -hull.equations[:, -1]


def cube_distance(points: np.ndarray) -> float:
    """Half-width at which a cube about the origin touches a convex hull, over the weights of its points."""
    count, rows = points.shape
    below = np.column_stack([np.vstack([points.T, -points.T]), -np.ones(2 * rows)])
    one = np.append(np.ones(count), 0.0)[None]
    found = linprog(np.append(np.zeros(count), 1.0), below, np.zeros(2 * rows), one, [1.0])
    return float(found.fun)
