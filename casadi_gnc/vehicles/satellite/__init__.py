"""A satellite put together from parts: wheels, thrusters, magnetorquers, bending modes, liquids."""

from .craft import SatelliteCraft
from .plant import Satellite

__all__ = ["Satellite", "SatelliteCraft"]
