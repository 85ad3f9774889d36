"""Requirements: bounds on metrics and formulas over time, the same in a check, a flight, a campaign and on board."""

from casadi_gnc.missions.requirements.folding import Judge, Watch, watches
from casadi_gnc.missions.requirements.monitor import Monitor, MonitorTape, Seen, monitor_tape
from casadi_gnc.missions.requirements.requirement import Requirement, Verdict

__all__ = ["Judge", "Monitor", "MonitorTape", "Requirement", "Seen", "Verdict", "Watch", "monitor_tape", "watches"]
