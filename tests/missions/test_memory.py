"""A flight of a million steps keeps only what is asked for."""

import subprocess
import sys

SCRIPT = """
import casadi_gnc
mission = casadi_gnc.load("huang2020/detumble").with_timing(duration=1e5)
flight = casadi_gnc.fly(mission, "observer_pinv", decimation=100)
assert mission.timing.samples == 1_000_001 and flight.samples.shape[0] == 10_001
# Not ru_maxrss: it also remembers how large the process was that started this one.
print(next(line.split()[1] for line in open("/proc/self/status") if line.startswith("VmHWM")))
"""


def test_million_steps_stay_under_300_megabytes():
    done = subprocess.run([sys.executable, "-c", SCRIPT], capture_output=True, text=True, check=True, timeout=300)
    assert float(done.stdout) / 1024 < 300
