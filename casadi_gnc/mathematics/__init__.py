"""Arithmetic that gives the same words everywhere: bounds, exact constants, integrators, noise."""

from casadi_gnc.mathematics import bounds, exact, integrators, noise

__all__ = ["bounds", "exact", "integrators", "noise"]
