"""Campaigns: plans that say where to fly, dispersions that say what varies, and statistics of what was flown."""

from casadi_gnc.campaigns.correlated import Correlated
from casadi_gnc.campaigns.designs import Corners, Grid, OneAtATime
from casadi_gnc.campaigns.dispersions import DispersionTable
from casadi_gnc.campaigns.distributions import Choice, Distribution, LogUniform, Normal, Uniform
from casadi_gnc.campaigns.importance import Importance
from casadi_gnc.campaigns.orientations import Direction, Rotation
from casadi_gnc.campaigns.pick_freeze import PickFreeze
from casadi_gnc.campaigns.plan import Plan
from casadi_gnc.campaigns.plans import Independent, LatinHypercube, Sobol

__all__ = [
    "Choice",
    "Corners",
    "Correlated",
    "Direction",
    "DispersionTable",
    "Distribution",
    "Grid",
    "Importance",
    "Independent",
    "LatinHypercube",
    "LogUniform",
    "Normal",
    "OneAtATime",
    "PickFreeze",
    "Plan",
    "Rotation",
    "Sobol",
    "Uniform",
]
