"""Time many dispersed slews on four wheels by Basilisk's Monte Carlo controller and by a campaign's engine, in one run.

Both fly 15,001 samples of the craft and the law of `satellite_speed.py`, with the first rate drawn anew for each
flight. Basilisk's controller makes each simulation, disperses it, runs it and keeps nothing, in one process; ours flies
the vector lanes of one build. Processor time of one core each, and Basilisk's time by the clock, in which it sleeps.
`python tests/bench/basilisk_campaign.py [flights in Basilisk] [flights here]`
"""

import sys
import tempfile
import time
from typing import Any

import numpy as np
import satellite_speed

import casadi_gnc
from casadi_gnc.campaigns.engines import CompiledBatch
from casadi_gnc.missions.parameters import vary

ASKED = [int(each) for each in sys.argv[1:]] if __name__ == "__main__" else []
THERE, HERE = (*ASKED, *(10, 512)[len(ASKED) :])
#: Largest first rate about an axis, [rad/s].
RATE = 0.001


def mission() -> casadi_gnc.Mission:
    """Return what is flown: 1500 s at 10 Hz."""
    return satellite_speed.mission().with_timing(duration=1500.0, sample_period=0.1)


def made() -> Any:
    """Return a simulation of Basilisk."""
    return satellite_speed.in_basilisk(mission(), recorded=False)


def run(simulation: Any) -> None:
    """Fly it."""
    simulation.ExecuteSimulation()
    final = simulation.craft.scStateOutMsg.read().sigma_BN
    assert np.abs(final).max() < 1e-3, final  # it has turned there


def there(flights: int) -> tuple[float, float]:
    """Return processor time and time by the clock of a flight in Basilisk, [s]."""
    from Basilisk.utilities.MonteCarlo import Controller, Dispersions

    monte_carlo = Controller.Controller()
    monte_carlo.setSimulationFunction(made)
    monte_carlo.setExecutionFunction(run)
    monte_carlo.setExecutionCount(flights)
    monte_carlo.setThreadCount(1)
    monte_carlo.setVerbose(False)
    monte_carlo.setShowProgressBar(False)
    disperse = Dispersions.UniformVectorCartDispersion
    monte_carlo.addDispersion(disperse("craft.hub.omega_BN_BInit", [-RATE, RATE]))
    with tempfile.TemporaryDirectory() as folder:
        monte_carlo.setArchiveDir(f"{folder}/runs")
        begun = time.process_time(), time.perf_counter()
        failed = monte_carlo.executeSimulations()
        spent = time.process_time() - begun[0], time.perf_counter() - begun[1]
    assert not failed, failed
    return spent[0] / flights, spent[1] / flights


def here(flights: int) -> tuple[float, str]:
    """Return the processor time of a flight in a campaign, [s], and its vectors."""
    varied = vary(mission(), ["initial.rate_rad_per_s"], "pd")
    values = np.random.default_rng(7).uniform(-RATE, RATE, (flights, 3))
    batch, seeds = CompiledBatch(varied), np.arange(flights, dtype=np.uint64)
    batch.fly(values[:8], seeds[:8])
    begun = time.process_time()
    batch.fly(values, seeds)
    return (time.process_time() - begun) / flights, batch.vectors


def main() -> None:
    """Print the times of a flight, and their ratio."""
    ours, vectors = here(HERE)
    theirs, clock = there(THERE)
    print(f"a flight of 15,001 samples: {ours * 1e3:.2f} ms here ({vectors}), {theirs * 1e3:.0f} ms in Basilisk")
    print(f"({clock * 1e3:.0f} ms by the clock); ratio {theirs / ours:.0f} of processor time of one core")


if __name__ == "__main__":
    main()
