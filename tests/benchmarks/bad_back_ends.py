"""Back ends that the protocol must catch; named by this file's path, so that other processes find them."""

import os
import time

import numpy as np

from casadi_gnc.allocation import backends
from casadi_gnc.allocation.backends import BackEnd, Capability, Found

KIND = Capability.ROBUST | Capability.EXACT


def made(find):
    """Return a back end that answers by Clarabel's answer and a function of it."""

    class Solver:
        def __init__(self, problem):
            self.honest, self.calls = backends.module("clarabel").set_up(problem), 0

        def find(self, *sample):
            self.calls += 1
            return find(self, *sample)

    return BackEnd(KIND, (), (1e-6, 1e-10), Solver)


def _liar(solver, command, previous, lower, upper):
    found = solver.honest.find(command, previous, lower, upper)
    forces = np.clip(found.forces, lower, upper)
    forces[0] = upper[0] + 1e-6 * max(upper[0], 1e-3)
    return Found(forces, found.weights, claimed=True)


def _over(solver, command, previous, lower, upper):
    """Be optimal but for an actuator that is already at its bound, and moved beyond it by 1e-6 of its reach."""
    found = solver.honest.find(command, previous, lower, upper)
    forces = np.clip(found.forces, lower, upper)
    k = int(np.argmin(forces - lower))
    forces[k] = lower[k] - 1e-6 * upper[k]
    return Found(forces, found.weights, claimed=True)


def _modest(solver, *sample):
    found = solver.honest.find(*sample)
    return Found(found.forces, found.weights, claimed=False)


def _hangs(solver, *sample):
    if solver.calls == 3:
        time.sleep(60)
    return solver.honest.find(*sample)


def _dies(solver, command, *sample):
    if command[0] == CURSED[0]:
        os.abort()
    return solver.honest.find(command, *sample)


def _leaves(solver, *sample):
    os._exit(3)


def _raises(solver, command, *sample):
    if command[0] == CURSED[0]:
        raise ZeroDivisionError("it broke")
    return solver.honest.find(command, *sample)


def _slow(solver, *sample):
    time.sleep(0.15)
    return solver.honest.find(*sample)


def _nothing(solver, command, previous, lower, upper):
    return Found(np.full(len(lower), np.nan), claimed=True)


def _refuses(problem):
    raise ValueError("not today")


class _Leaks:
    """Grow by 30 MB a call."""

    kept: list = []

    def __init__(self, problem):
        self.honest = backends.module("clarabel").set_up(problem)

    def find(self, *sample):
        self.kept.append(np.ones(30_000_000 // 8))
        return self.honest.find(*sample)


#: The second command of the tests' family.
CURSED = np.array([0.2])
LIAR, OVER, MODEST, HANGS, DIES = made(_liar), made(_over), made(_modest), made(_hangs), made(_dies)
LEAVES, RAISES, SLOW, NOTHING = made(_leaves), made(_raises), made(_slow), made(_nothing)
REFUSES = BackEnd(KIND, (), (1e-6, 1e-10), _refuses)
LEAKS = BackEnd(KIND, (), (1e-6, 1e-10), _Leaks)
