"""Arithmetic that gives the same words everywhere: bounds, exact constants, integrators, jumps in time, noise."""

from casadi_gnc.mathematics import bounds, exact, integrators, jumps, noise

__all__ = ["bounds", "exact", "integrators", "jumps", "noise"]
