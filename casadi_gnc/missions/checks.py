"""The families of checks by name: shipped ones in the order in which they are told, then those of others."""

from __future__ import annotations

from casadi_gnc.registry import Registry

_FAMILIES = (
    "geometry",
    "authority",
    "funnels",
    "settling",
    "gains",
    "sampling",
    "noise",
    "allocation",
    "numbers",
    "requirements",
    "dispersions",
)

REGISTRY = Registry(
    "check",
    "casadi_gnc.checks",
    {name: f"casadi_gnc.checking.{name}:checks" for name in _FAMILIES},
    is_one=callable,
    expected="a function (mission, scheme) that yields casadi_gnc.Check",
)
