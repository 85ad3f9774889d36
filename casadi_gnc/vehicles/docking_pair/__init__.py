"""Two craft that dock by their magnetic coils."""

from .craft import DockingPairCraft
from .plant import DockingPair

__all__ = ["DockingPair", "DockingPairCraft"]
