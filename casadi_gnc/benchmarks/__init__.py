"""Compare solvers, engines and steps: accuracy checked by us, times that say what was timed.

A contest (`allocation`, `synthesis`, `step`, `flight`) names contestants and families of samples, and
judges every answer from the data. `running.run` measures, each contestant in a process of its own, and
keeps every measurement in a file; `summary`, `report` and `comparing` read that file.
"""

from casadi_gnc.benchmarks.contest import Contest, Family, Judgement, Runner, contest
from casadi_gnc.benchmarks.results import Results, read_results
from casadi_gnc.benchmarks.running import Settings, run

__all__ = ["Contest", "Family", "Judgement", "Results", "Runner", "Settings", "contest", "read_results", "run"]
