"""A thousand dispersed de-tumblings held against a requirement: how many meet it, how surely, and the worst one again.

Inertia and start differ from case to case. One build serves them all, and each has the words of a single flight, so
the worst is flown again bit for bit, with its whole record. In a file: docs/campaigns.md, docs/requirements.md.
"""

import dataclasses

import numpy as np
from matplotlib.figure import Figure

import casadi_gnc as gnc
from casadi_gnc.campaigns import DispersionTable, statistics

REQUIRED = gnc.Requirement(
    id="ACS-010", text="At rest within ten minutes", metric="settling_time", at_most=600.0, share=0.99, confidence=0.9
)
VARYING = [
    DispersionTable(key="truth.inertia_factor", uniform=[1.0, 1.2]),
    DispersionTable(key="initial.rate_rad_per_s.*", uniform=[0.05, 0.3]),
]

mission = gnc.load("huang2020/detumble").with_scheme("observer_pinv")
mission = dataclasses.replace(mission, requirements=(REQUIRED,))
found = gnc.campaign(mission, 1000, dispersions=VARYING, seed=1)
print(found)

times, margin = found.column("metric.settling_time"), found.column("requirement.ACS-010")
times = np.where(np.isnan(times), np.inf, times)  # never: the longest
verdict = statistics.judge(int(np.sum(margin >= 0)), len(found), REQUIRED.share, REQUIRED.confidence)
share = verdict.share
print(f"{REQUIRED.id}: {verdict.verdict.value}; {100 * share.value:.1f} % meet it, {100 * share.low:.1f} to "
      f"{100 * share.high:.1f} % with {100 * share.confidence:.0f} % confidence")  # fmt: skip

keys = [name for name in found.names if name.startswith(("truth.", "initial."))]
for key, one in zip(keys, statistics.rank_correlations(found.columns(keys), times), strict=True):
    print(f"settling time follows {key}: rank correlation {one.value:+.2f}, from {one.low:+.2f} to {one.high:+.2f}")

worst = found.worst("settling_time")
flight = worst.fly()
print(f"worst: case {worst.number}, flown again: {flight.metrics['settling_time']:.1f} s")
assert flight.metrics["settling_time"] == times.max()

figure = Figure(figsize=(7.2, 5.4), layout="constrained")
top, below = figure.subplots(2, 1)
top.hist(times[np.isfinite(times)], bins=40, color="#0072B2")
top.axvline(REQUIRED.at_most, color="#D55E00", label=REQUIRED.text)
top.set(xlabel="settling time [s]", ylabel="flights")
top.legend(frameon=False)
below.plot(flight.time, flight["rate"])
below.set(xlabel="time [s]", ylabel="rate [rad/s]", title=f"the worst, case {worst.number}")
figure.savefig("campaign.png", dpi=120)
print("wrote campaign.png")
