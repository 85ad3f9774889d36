"""A law of your own in twenty lines, flown beside a shipped one, checked, and handed over as C.

The law is a proportional and derivative one with an integral, for the captured craft on twelve thrusters. From its text
come the flight, the checks of its sampled poles, and the package (docs/first_law.md goes on from here).
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure

import casadi_gnc as gnc


@dataclass(frozen=True, eq=False)
class Pid(gnc.Law):
    """Turn the MRPs to zero, and what pushes all the time too."""

    attitude_gain: Any = gnc.gain("N m", "torque per MRP", symbol="k_p", above=0.0)
    rate_gain: Any = gnc.gain("N m s/rad", "torque per rate", symbol="k_d", above=0.0)
    integral_gain: Any = gnc.gain("N m/s", "torque per integral of the MRPs", symbol="k_i", minimum=0.0)
    effort = gnc.TORQUE
    inputs = gnc.Layout((gnc.Signal("mrp", 3), gnc.Signal("rate", 3, "rad/s")))
    memory = gnc.Layout((gnc.Signal("sum", 3, "s"),))

    def command(self, t, y, m):
        now = self.inputs.split(y)
        return -self.attitude_gain * now.mrp - self.rate_gain * now.rate - self.integral_gain * m

    def rate(self, t, y, m, wanted, achieved):
        # Where the thrusters cannot follow, what is missing unloads the sum; with the other sign `check` fails, and so
        # does the flight.
        return self.inputs.split(y).mrp + (wanted - achieved) / self.attitude_gain


shipped = gnc.load("huang2020/slew")
mine = shipped.with_scheme("funnel_robust", law=Pid(attitude_gain=0.03, rate_gain=0.3, integral_gain=3e-4))
without = mine.with_scheme("funnel_robust", integral_gain=0.0)

failing = [check.name for check in gnc.check(mine, "funnel_robust") if check.verdict == "fail"]
print("checks that fail:", failing or "none")

missions = {"mine": mine, "mine, no integral": without, "the shipped funnel law": shipped}
flights = {name: gnc.fly(mission, "funnel_robust") for name, mission in missions.items()}
figure = Figure(figsize=(7.2, 3.6), layout="constrained")
axes = figure.subplots()
for name, flight in flights.items():
    size = np.linalg.norm(flight["mrp"], axis=1)
    print(f"{name}: at most {size[flight.time > 800].max():.1e} after 800 s")
    axes.semilogy(flight.time, size, label=name)
axes.set(xlabel="time [s]", ylabel="size of the MRPs [-]")
axes.legend(frameon=False)
figure.savefig("own_law.png", dpi=120)

gnc.generate(mine, "flight/pid", scheme="funnel_robust", steps=100)
print("wrote own_law.png and the package flight/pid; next: make -C flight/pid test")
