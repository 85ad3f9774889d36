"""Shares so small that counting would take too many flights, with bounds."""

from casadi_gnc.campaigns.rare.lines import line_sampling, towards_failure
from casadi_gnc.campaigns.rare.margin import Margins
from casadi_gnc.campaigns.rare.subset import RareShare, subset_simulation

__all__ = ["Margins", "RareShare", "line_sampling", "subset_simulation", "towards_failure"]
