"""Load a shipped mission, fly one scheme, change a gain, fly again, and compare numbers."""

import numpy as np

import casadi_gnc

mission = casadi_gnc.load("huang2020/detumble")
flight = casadi_gnc.fly(mission, "observer_pinv")
print(f"{flight.title}: settled at {flight.metrics['settling_time']:.1f} s")
print(f"rates at the end: {flight['rate'][-1]} {flight.unit('rate')}")
for status, (samples, first) in flight.statuses.items():
    print(f"{samples} samples, first at {first:g} s: {status.sentences[0]}")

slower = casadi_gnc.fly(mission.with_scheme("observer_pinv", observer_gain=0.5))
steady = [np.abs(f["rate"][f.time > 1400]).max() for f in (flight, slower)]
print(f"steady rate with the observer's pole at 27 and 0.5 rad/s: {steady[0]:.1e}, {steady[1]:.1e} rad/s")
assert steady[1] > 10 * steady[0]
