"""Chaser and captured target, locked together by an arm, on the chaser's thrusters."""

from .craft import CombinedSpacecraftCraft
from .plant import CombinedSpacecraft

__all__ = ["CombinedSpacecraft", "CombinedSpacecraftCraft"]
