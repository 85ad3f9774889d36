"""Hand a controller on: flight packages, their vectors and verification, mock-up units."""

from casadi_gnc.delivery.fmu import generate_fmu
from casadi_gnc.delivery.generating import generate
from casadi_gnc.delivery.verifying import verify

__all__ = ["generate", "generate_fmu", "verify"]
