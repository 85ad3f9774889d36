"""A satellite around a free-falling test mass."""

from .craft import DragFreePairCraft
from .plant import DragFreePair

__all__ = ["DragFreePair", "DragFreePairCraft"]
