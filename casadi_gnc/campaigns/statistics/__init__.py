"""What many flights say: estimates, and bounds that say how far they are to be trusted."""

from casadi_gnc.campaigns.statistics.convergence import Convergence, convergence
from casadi_gnc.campaigns.statistics.correlations import rank_correlations
from casadi_gnc.campaigns.statistics.estimate import Estimate
from casadi_gnc.campaigns.statistics.percentiles import Percentile, percentile
from casadi_gnc.campaigns.statistics.sensitivity import Indices, first_order, indices
from casadi_gnc.campaigns.statistics.shares import (
    Judgement,
    Verdict,
    bounds_at_all_times,
    flights_needed,
    judge,
    share_bounds,
)
from casadi_gnc.campaigns.statistics.tolerance import factor, flights_for_limits, limits, normal_limits
from casadi_gnc.campaigns.statistics.weighted import (
    effective_flights,
    weighted_mean,
    weighted_percentile,
    weighted_share,
)

__all__ = [
    "Convergence",
    "Estimate",
    "Indices",
    "Judgement",
    "Percentile",
    "Verdict",
    "bounds_at_all_times",
    "convergence",
    "effective_flights",
    "factor",
    "first_order",
    "flights_for_limits",
    "flights_needed",
    "indices",
    "judge",
    "limits",
    "normal_limits",
    "percentile",
    "rank_correlations",
    "share_bounds",
    "weighted_mean",
    "weighted_percentile",
    "weighted_share",
]
