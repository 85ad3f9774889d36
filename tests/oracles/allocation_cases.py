"""The problems that every back end must solve: the paper's geometry, random ones and edge cases."""

from itertools import product
from typing import NamedTuple

import numpy as np

from casadi_gnc.allocation import AllocationProblem
from casadi_gnc.mechanics.attitude import frame_rotation
from casadi_gnc.mechanics.thrusters import ThrusterGeometry, corner_errors
from casadi_gnc.problem_files.document import read

MAX_FORCE = 3.75e-3  # N, Table 2
COMMAND = np.array([4e-4, -3e-4, 2e-4])  # N m, about what the thrusters can make
ROTATION = frame_rotation(np.pi / 4, np.pi / 7, np.pi / 3)
_mounted = read("huang2020/detumble").data["spacecraft"]["thrusters"]
GEOMETRY = ThrusterGeometry.from_rows(_mounted["positions_m"], _mounted["directions"]).seen_from(ROTATION, [0.05] * 3)


class Case(NamedTuple):
    """A problem and one sample of it."""

    problem: AllocationProblem
    command: np.ndarray
    previous: np.ndarray

    @property
    def is_degenerate(self) -> bool:
        """Whether the cost has no curvature of its own, M1 = M2 = 0."""
        return not np.any(self.problem.effort_weight + self.problem.change_weight)


def huang2020(half=5e-3, corners=None, **other) -> AllocationProblem:
    """The twelve thrusters, their centre of mass known within +-half [m] or between two corners."""
    box = ([-half] * 3, [half] * 3) if corners is None else corners
    given = {"lower": 0.0, "upper": MAX_FORCE} | other
    return AllocationProblem.of_thrusters(GEOMETRY, ROTATION, box, **given)


def wheels() -> AllocationProblem:
    """Four wheels (accelerations, rad/s^2); E has rank 1 and the bounds are negative below."""
    inertia = 3e-5
    effectiveness = np.array([[1, -1, -1, 1], [1, 1, -1, -1], [1, 1, 1, 1]]) / np.sqrt(3) * inertia
    coupling = np.vstack([np.full(4, inertia / 2), np.zeros((2, 4))])
    errors = np.zeros((8, 3, 3))
    errors[:, :, 0] = list(product((-0.1, 0.1), repeat=3))
    return AllocationProblem(
        effectiveness, -5.0, 5.0, coupling=coupling, errors=errors, effort_weight=1e-9, change_weight=1e-9
    )


def torque_and_force() -> AllocationProblem:
    """Six rows: the torque, and the net force over a lever of 0.1 m."""
    errors = [np.vstack([corner, np.zeros((3, 3))]) for corner in corner_errors(ROTATION, [-5e-3] * 3, [5e-3] * 3)]
    directions = np.array(GEOMETRY.directions)
    return AllocationProblem(
        np.vstack([np.array(GEOMETRY.effectiveness), 0.1 * directions]),
        0.0,
        MAX_FORCE,
        coupling=directions,
        errors=np.array(errors),
    )


def cases() -> dict[str, Case]:
    """Return all cases by name."""
    rng = np.random.default_rng(2020)
    zero, found = np.zeros(12), {}
    for i in range(3):
        command, previous = rng.normal(size=3) * 4e-4, rng.uniform(0, MAX_FORCE, 12)
        found[f"5 mm, random {i}"] = Case(huang2020(5e-3), command, previous)
        found[f"5 cm, random {i}"] = Case(huang2020(5e-2), command, previous)
    stuck = np.zeros(12), np.full(12, MAX_FORCE)
    stuck[1][2], stuck[0][5] = 0.0, MAX_FORCE  # one dead, one stuck fully on, one stuck half open
    stuck[0][7] = stuck[1][7] = 0.4 * MAX_FORCE
    found |= {
        "all-zero command": Case(huang2020(), 0 * COMMAND, zero),
        "zero command, forces before": Case(huang2020(), 0 * COMMAND, zero + 1e-3),
        "small command": Case(huang2020(), 1e-3 * COMMAND, zero),
        "no error": Case(huang2020(0.0), COMMAND, zero),
        "flat box": Case(huang2020(corners=([-5e-3, -5e-3, 0.0], [5e-3, 5e-3, 0.0])), COMMAND, zero),
        "asymmetric box": Case(huang2020(corners=([-1e-3, -8e-3, 2e-3], [6e-3, 5e-3, 9e-3])), COMMAND, zero),
        "ten times unreachable": Case(huang2020(), 10 * COMMAND, zero),
        "ten times unreachable, 5 cm": Case(huang2020(5e-2), 10 * COMMAND, zero),
        "dead and stuck": Case(huang2020(lower=stuck[0], upper=stuck[1]), COMMAND, zero),
        "all dead": Case(huang2020(upper=0.0), COMMAND, zero),
        "rate": Case(huang2020(max_step=2e-4), COMMAND, zero + 1e-3),
        "rate box outside amplitude": Case(huang2020(max_step=2e-4), COMMAND, zero + 1.5 * MAX_FORCE),
        "M1 = 0": Case(huang2020(effort_weight=0.0), COMMAND, zero),
        "M1 = M2 = 0": Case(huang2020(effort_weight=0.0, change_weight=0.0), COMMAND, zero),
        "some weights 0": Case(huang2020(effort_weight=np.arange(12) % 2, change_weight=0.0), COMMAND, zero),
        "preferred forces": Case(huang2020(preferred=1e-3), COMMAND, zero),
        "h = 1e2": Case(huang2020(accuracy_weight=1e2), COMMAND, zero),
        "h = 1e9": Case(huang2020(accuracy_weight=1e9), COMMAND, zero),
        "wheels": Case(wheels(), COMMAND / 8, np.zeros(4)),
        "wheels, unreachable": Case(wheels(), COMMAND, np.ones(4)),
        "torque and force": Case(torque_and_force(), np.append(COMMAND, [1e-4, 0.0, -1e-4]), zero),
        "rank-deficient": Case(
            AllocationProblem(np.array([[1.0] * 4, [-1.0] * 4, [1.0] * 4]), 0.0, 1.0),
            np.array([1.0, -1.0, 1.0]),
            np.zeros(4),
        ),
    }
    for rows, count in ((3, 4), (4, 9), (6, 24)):
        for weight in (1.0, 0.0):
            effectiveness = rng.normal(size=(rows, count))
            problem = AllocationProblem(
                effectiveness,
                -rng.uniform(0, 1, count),
                rng.uniform(0, 1, count),
                effort_weight=weight,
                change_weight=weight,
                accuracy_weight=1e3,
            )
            name = f"random {rows} x {count}" + ("" if weight else ", M1 = M2 = 0")
            command = effectiveness @ rng.uniform(-0.3, 0.6, count)
            found[name] = Case(problem, command, rng.uniform(-0.2, 0.2, count))
    return found
