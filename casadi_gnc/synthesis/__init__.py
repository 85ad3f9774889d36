"""Gain synthesis by linear matrix inequalities, with a certificate of our own.

>>> import casadi as ca
>>> from casadi_gnc import synthesis
>>> lmis = synthesis.Lmis()
>>> P = lmis.symmetric("P", 2)
>>> A = ca.DM([[0, 1], [-1, -1]])
>>> lmis.psd(P, margin=1, name="positive")
>>> lmis.nsd(A.T @ P + P @ A, margin=1e-3, name="decay")
>>> lmis.minimize(ca.trace(P))
>>> lmis.solve().status.name
'CERTIFIED'
"""

from casadi_gnc.synthesis.analysis import Norm, h_infinity_norm, poles, stable_ratios
from casadi_gnc.synthesis.answer import LmiAnswer, LmiStatus
from casadi_gnc.synthesis.certificate import Check
from casadi_gnc.synthesis.energy import Energy, h_two_norm
from casadi_gnc.synthesis.gains import GainStatus, Synthesis
from casadi_gnc.synthesis.lmis import Lmis
from casadi_gnc.synthesis.peak import Peak, box_vertices, peak_command
from casadi_gnc.synthesis.proofs import Infeasibility
from casadi_gnc.synthesis.rays import Ray
from casadi_gnc.synthesis.recipes.input_ellipsoid import input_ellipsoid
from casadi_gnc.synthesis.recipes.intermediate_observer import intermediate_observer, sample_s
from casadi_gnc.synthesis.recipes.mixed_state_feedback import mixed_state_feedback
from casadi_gnc.synthesis.recipes.observer import observer
from casadi_gnc.synthesis.recipes.output_feedback import output_feedback
from casadi_gnc.synthesis.recipes.polytope_state_feedback import polytope_state_feedback
from casadi_gnc.synthesis.recipes.saturation_margin import saturation_margin
from casadi_gnc.synthesis.recipes.state_feedback import state_feedback
from casadi_gnc.synthesis.structured import MuBounds, Uncertainty, mu_bounds, mu_of_loop
from casadi_gnc.synthesis.unknowns import block_matrix

__all__ = [
    "Check",
    "Energy",
    "GainStatus",
    "Infeasibility",
    "LmiAnswer",
    "LmiStatus",
    "Lmis",
    "MuBounds",
    "Norm",
    "Peak",
    "Ray",
    "Synthesis",
    "Uncertainty",
    "block_matrix",
    "box_vertices",
    "h_infinity_norm",
    "h_two_norm",
    "input_ellipsoid",
    "intermediate_observer",
    "mixed_state_feedback",
    "mu_bounds",
    "mu_of_loop",
    "observer",
    "output_feedback",
    "peak_command",
    "poles",
    "polytope_state_feedback",
    "sample_s",
    "saturation_margin",
    "stable_ratios",
    "state_feedback",
]
