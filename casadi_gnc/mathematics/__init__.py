"""Arithmetic that gives the same words everywhere: bounds, exact constants, integrators, noise."""
