"""Draw the moving picture of the front page: the slew of `huang2020/slew` beside its funnel, from a flight made now.

python docs/moving_picture.py docs/images/slew.gif
"""

from __future__ import annotations

import sys
from itertools import product

import matplotlib as mpl
import numpy as np
from matplotlib import animation
from matplotlib import pyplot as plt
from mpl_toolkits.mplot3d.art3d import Line3DCollection

import casadi_gnc as gnc
from casadi_gnc.mechanics import attitude

FRAMES, LAST_S = 48, 200.0
COLOURS = ("#0072b2", "#d55e00", "#009e73")  # colour-blind-safe, as in the other pictures
FIRE, LIMIT = "#e69f00", "0.45"


def edges(half: float) -> np.ndarray:
    """Return the twelve edges of a cube, (12, 2, 3), [m]."""
    corners = np.array(list(product((-half, half), repeat=3)))
    return np.array([(a, b) for i, a in enumerate(corners) for b in corners[i + 1 :] if np.sum(a != b) == 1])


def main(path: str) -> None:
    """Fly, and write the picture."""
    mpl.use("Agg")
    mission = gnc.load("huang2020/slew")
    flight = gnc.fly(mission, "funnel_robust")
    craft = mission.craft
    to_combined = attitude.frame_rotation(*craft.rotation_321_rad).full()
    places = np.array(craft.thrusters.positions_m)
    pushes = np.array(craft.thrusters.directions)
    shown = np.searchsorted(flight.time, np.linspace(0, LAST_S, FRAMES))

    figure = plt.figure(figsize=(8.4, 3.6), dpi=84)
    grid = figure.add_gridspec(1, 2, width_ratios=(1, 1.25), left=0.0, right=0.985, bottom=0.14, top=0.97, wspace=0.16)
    scene = figure.add_subplot(grid[0], projection="3d")
    plot = figure.add_subplot(grid[1])

    past = flight.time <= LAST_S
    for axis, colour in enumerate(COLOURS):
        for wall in ("funnel_lower", "funnel_upper"):
            plot.plot(flight.time[past], flight[wall][past, axis], "--", color=colour, lw=0.8, alpha=0.6)
    lines = [plot.plot([], [], color=colour, lw=2, label=name)[0] for colour, name in zip(COLOURS, "xyz", strict=True)]
    plot.set(xlim=(0, LAST_S), ylim=(-0.44, 0.2), xlabel="time [s]", ylabel="attitude MRP [-]")
    plot.legend(loc="lower right", ncols=3, frameon=False, title="inside its funnel (dashed)")
    plot.spines[["top", "right"]].set_visible(False)

    scene.set(xlim=(-0.17, 0.17), ylim=(-0.17, 0.17), zlim=(-0.17, 0.17))
    scene.set_box_aspect((1, 1, 1), zoom=1.35)
    scene.set_axis_off()
    target = Line3DCollection(edges(0.1), colors=LIMIT, linewidths=0.7, linestyles="dotted")
    body = Line3DCollection(edges(0.1), colors="black", linewidths=1.4)
    flames = Line3DCollection([], colors=FIRE, linewidths=3.5)
    for part in (target, body, flames):
        scene.add_collection3d(part, autolim=False)
    told = scene.text2D(0.5, 0.02, "", transform=scene.transAxes, ha="center")

    def draw(frame: int) -> None:
        at = shown[frame]
        # From the chaser's axes to those of the target attitude: first to the combined frame, then back by the error.
        turn = attitude.dcm(flight["mrp"][at]).full()
        body.set_segments((edges(0.1) @ to_combined.T @ turn).tolist())
        size = 0.11 * flight["force"][at] / craft.thrusters.max_force_N
        jets = np.stack([places, places - size[:, None] * pushes], axis=1) @ to_combined.T @ turn
        flames.set_segments([jet for jet, length in zip(jets.tolist(), size, strict=True) if length > 1e-3])
        for axis, line in enumerate(lines):
            line.set_data(flight.time[: at + 1], flight["mrp"][: at + 1, axis])
        told.set_text(f"{flight.time[at]:3.0f} s")

    target.set_segments((edges(0.1) @ to_combined.T).tolist())
    animation.FuncAnimation(figure, draw, FRAMES).save(path, writer=animation.PillowWriter(fps=10))
    plt.close(figure)


if __name__ == "__main__":
    main(*sys.argv[1:])
