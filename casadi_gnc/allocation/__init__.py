"""Control allocation: which actuator does what, exactly and with a certificate."""

from casadi_gnc.allocation.clarabel_ import ConeAllocator
from casadi_gnc.allocation.pinv_ import PseudoInverse, pseudo_inverse
from casadi_gnc.allocation.problem import AllocationProblem

__all__ = ["AllocationProblem", "ConeAllocator", "PseudoInverse", "pseudo_inverse"]
