"""Allocation problems of crafts that nobody built, from seeds.

Actuators sit anywhere in a cube of 0.6 m and point anywhere; thrusters push with up to 1 N, wheels or
magnetic coils would push and pull. Commands are efforts of random forces, so that most of them can be
made; forces before are those of another command.
"""

from __future__ import annotations

import casadi as ca
import numpy as np

from casadi_gnc.allocation import AllocationProblem
from casadi_gnc.benchmarks.sets import Random
from casadi_gnc.mechanics.thrusters import corner_errors


def random_family(given: Random) -> tuple[AllocationProblem, np.ndarray, np.ndarray]:
    """Return a problem, commands (K, R) and previous forces (K, N); the same for the same seed."""
    rng = np.random.default_rng(given.seed)
    position = rng.uniform(-0.3, 0.3, (given.actuators, 3))
    direction = rng.normal(size=(given.actuators, 3))
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    effectiveness = np.cross(position, direction).T
    if given.rows == 6:
        effectiveness = np.vstack([effectiveness, 0.3 * direction.T])  # forces over a lever of 0.3 m
    lower = -1.0 if given.both_ways else 0.0
    uncertainty = {}
    if given.centre_error_m:
        half = [given.centre_error_m] * 3
        errors = np.array(corner_errors(ca.DM.eye(3), [-value for value in half], half))
        if given.rows == 6:
            errors = np.concatenate([errors, np.zeros_like(errors)], axis=1)
        uncertainty = {"coupling": direction.T, "errors": errors}
    problem = AllocationProblem(effectiveness, lower, 1.0, accuracy_weight=1e3, **uncertainty)
    forces = rng.uniform(lower, 1.0, (given.samples + 1, given.actuators)) * rng.uniform(size=(given.samples + 1, 1))
    commands = 2 * given.reach * forces[1:] @ effectiveness.T
    return problem, commands, forces[:-1]
