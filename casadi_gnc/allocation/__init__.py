"""Control allocation: which actuator does what, exactly and with a certificate.

>>> import numpy as np
>>> from casadi_gnc import allocation
>>> problem = allocation.AllocationProblem(np.array([[1.0, -1.0]]), lower=0.0, upper=2.0)
>>> answer = allocation.solve(problem, command=[1.0])
>>> answer.status.name, answer.forces.round(5).tolist()
('OPTIMAL', [1.0, 0.0])
"""

from casadi_gnc.allocation.allocator import Allocator, solve
from casadi_gnc.allocation.answer import ACCURACIES, AllocationStatus, Answer, Saturation, best_weights, certify
from casadi_gnc.allocation.derivatives import Jacobian, jacobian
from casadi_gnc.allocation.in_flight import (
    Allocate,
    Direct,
    OnlineInFlight,
    PseudoInverse,
    SolverInFlight,
    leaves_none_out,
    pseudo_inverse,
)
from casadi_gnc.allocation.lexicographic import LeastPropellant, Limit
from casadi_gnc.allocation.problem import AllocationProblem

__all__ = [
    "ACCURACIES",
    "Allocate",
    "AllocationProblem",
    "AllocationStatus",
    "Allocator",
    "Answer",
    "Direct",
    "Jacobian",
    "LeastPropellant",
    "Limit",
    "OnlineInFlight",
    "PseudoInverse",
    "Saturation",
    "SolverInFlight",
    "best_weights",
    "certify",
    "jacobian",
    "leaves_none_out",
    "pseudo_inverse",
    "solve",
]
