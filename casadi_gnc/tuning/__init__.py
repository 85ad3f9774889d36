"""Search among flights: what makes a mission fail, in standard units of what its file disperses."""

from casadi_gnc.tuning.falsified import Falsified
from casadi_gnc.tuning.falsifying import falsify
from casadi_gnc.tuning.objective import Objective
from casadi_gnc.tuning.space import Space

__all__ = ["Falsified", "Objective", "Space", "falsify"]
