"""A matrix of your own, from a table of commands to C: certified forces here, and the same words from a package.

Five jets make three torques. The file is what `casadi-gnc allocate` and `attainable` take too (docs/allocation.md).
"""

import subprocess
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import casadi_gnc as gnc
from casadi_gnc import allocation
from casadi_gnc.problem_files import load_allocation

FILE = """
format = 1
kind = "allocation"
title = "Five jets"
sample_period_s = 0.1

[matrices]
effectiveness = [
  [0.30, -0.30, 0.00, 0.00, 0.10],
  [0.00, 0.00, 0.30, -0.30, 0.10],
  [0.20, 0.20, -0.20, -0.20, 0.05],
]
units = ["N m", "N m", "N m"]
lower = 0.0
upper = 2.0

[weights]
accuracy = 1e5
"""
Path("jets.toml").write_text(FILE)
turns = np.linspace(0, 2 * np.pi, 200)
wanted = np.stack([0.3 * np.cos(turns), 0.2 * np.sin(turns), 0.1 * np.sin(2 * turns)], axis=1)  # [N m]
np.savetxt("torques.csv", wanted, delimiter=",", header="u1,u2,u3", comments="")

allocator = allocation.Allocator(load_allocation("jets.toml").problem, backend="online")
answers = [allocator.solve(torque) for torque in wanted]
gaps = [answer.duality_gap / answer.objective for answer in answers]
print(f"{len(answers)} commands, largest relative duality gap {max(gaps):.1e}")

gnc.generate("jets.toml", "flight/jets", commands="torques.csv")
replayed = subprocess.run(["make", "-s", "-C", "flight/jets", "test"], check=True, capture_output=True, text=True)
print(replayed.stdout.strip().splitlines()[-1])

figure = Figure(figsize=(7.2, 3.6), layout="constrained")
axes = figure.subplots()
axes.plot(
    0.1 * np.arange(len(answers)), [answer.forces for answer in answers], label=[f"jet {i + 1}" for i in range(5)]
)
axes.set(xlabel="time [s]", ylabel="force [N]")
axes.legend(frameon=False, ncols=5, loc="lower center", bbox_to_anchor=(0.5, 1.0))
figure.savefig("own_allocation.png", dpi=120)
print("wrote own_allocation.png and the package flight/jets")
