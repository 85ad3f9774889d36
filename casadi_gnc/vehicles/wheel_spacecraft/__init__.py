"""A spacecraft on reaction wheels."""

from .craft import WheelSpacecraftCraft
from .plant import WheelSpacecraft

__all__ = ["WheelSpacecraft", "WheelSpacecraftCraft"]
