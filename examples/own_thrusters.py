"""Thrusters of your own: forces for a torque that turns about an axis, and proof that they are the best.

Eight thrusters sit in pairs on the corners of a box; each pushes one way, and the centre of mass is known to 4 mm only.
The same problem can stand in a file (docs/allocation.md) and be used by `casadi-gnc allocate` and `attainable`.
"""

import numpy as np
from matplotlib.figure import Figure

from casadi_gnc import allocation
from casadi_gnc.mechanics.thrusters import ThrusterGeometry

LARGEST = 1.0  # [N]
CORNERS = [[0.4, 0.3, 0.5], [-0.4, 0.3, 0.5], [-0.4, -0.3, 0.5], [0.4, -0.3, 0.5]]  # [m]
TILT = np.deg2rad(30)

positions, directions = [], []
for corner in CORNERS:
    for side in (0, 1):  # one tilted outwards along x, one along y
        push = np.array([0.0, 0.0, -np.cos(TILT)])
        push[side] = np.sign(corner[side]) * np.sin(TILT)
        positions.append(corner)
        directions.append(list(push))

problem = allocation.AllocationProblem.of_thrusters(
    ThrusterGeometry.from_rows(positions, directions),
    rotation=np.eye(3),
    centre_error=([-4e-3] * 3, [4e-3] * 3),
    lower=0.0,
    upper=LARGEST,
    effort_weight=1.0,
    change_weight=0.0,
    accuracy_weight=1e5,
)
rank = np.linalg.matrix_rank(problem.effectiveness)
print(f"{problem.count} thrusters, rank {rank}, {len(problem.errors)} vertices of the uncertainty")

allocator = allocation.Allocator(problem, backend="online")
turns = np.linspace(0, 2 * np.pi, 181)
wanted = 0.12 * np.stack([np.cos(turns), np.sin(turns), 0 * turns], axis=1)  # [N m], in the xy plane
answers = [allocator.solve(torque) for torque in wanted]
forces = np.array([answer.forces for answer in answers])
missing = np.array([np.linalg.norm(answer.unallocated) for answer in answers])
gaps = np.array([answer.duality_gap / answer.objective for answer in answers])
print(f"largest relative duality gap {gaps.max():.1e}; largest missing torque {missing.max():.1e} N m")
assert gaps.max() < 1e-6
assert np.all((forces >= 0) & (forces <= LARGEST))

figure = Figure(figsize=(7.2, 5), layout="constrained")
top, below = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
top.plot(np.rad2deg(turns), forces, label=[f"{i + 1}" for i in range(problem.count)])
top.set(ylabel="force [N]")
top.legend(ncols=8, frameon=False, loc="lower center", bbox_to_anchor=(0.5, 1.0), title="thruster")
below.plot(np.rad2deg(turns), 1e3 * missing)
below.set(xlabel="direction of a torque of 0.12 N m in the xy plane [deg]", ylabel="missing [mN m]")
figure.savefig("own_thrusters.png", dpi=120)
print("wrote own_thrusters.png")
