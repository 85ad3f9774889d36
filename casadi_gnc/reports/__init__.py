"""Pictures of flights, of checks and of campaigns."""

from casadi_gnc.reports.check_picture import draw
from casadi_gnc.reports.flight_pictures import plot_comparison, plot_flight

__all__ = ["draw", "plot_comparison", "plot_flight"]
