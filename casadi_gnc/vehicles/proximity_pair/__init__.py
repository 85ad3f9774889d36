"""A chaser close to a tumbling target."""

from .craft import ProximityPairCraft
from .plant import ProximityPair

__all__ = ["ProximityPair", "ProximityPairCraft"]
