"""Derivatives of whole flights: tangents and adjoints of metrics and requirements, in compiled C."""

from casadi_gnc.missions.sensitivities.sensitivities import Sensitivities, Sensitivity, sensitivities

__all__ = ["Sensitivities", "Sensitivity", "sensitivities"]
