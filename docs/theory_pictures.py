"""Draw the pictures of the theory pages, each from the code that the page is about.

python docs/theory_pictures.py docs/images
"""

from __future__ import annotations

import sys
from pathlib import Path

import casadi as ca
import numpy as np
from matplotlib.figure import Figure

from casadi_gnc import allocation
from casadi_gnc.laws.disturbance_observer import DisturbanceObserver
from casadi_gnc.laws.performance_funnel import PerformanceFunnel
from casadi_gnc.mechanics import attitude
from casadi_gnc.system.pictures import COLOURS, FONT, plain, save


def panels(count: int, height: float = 3.4) -> tuple[Figure, list]:
    """Return a figure of the pages' width and some inches height, and its panels from left to right."""
    figure = Figure(figsize=(8.4, height), dpi=120, layout="constrained")
    row = list(figure.subplots(1, count, squeeze=False)[0])
    for panel in row:
        plain(panel)
    return figure, row


def shadows() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return turns about one axis, [deg], the MRP of each and its shadow, [-]."""
    angle = np.linspace(1.0, 359.0, 717)
    mrp = np.tan(np.radians(angle) / 4)
    other = np.array([float(attitude.shadow(ca.DM([s, 0, 0]))[0]) for s in mrp])
    return angle, mrp, other


def draw_shadows() -> Figure:
    """Draw both MRPs of a turn about one axis, the shorter one thick."""
    angle, mrp, other = shadows()
    figure, (panel,) = panels(1)
    for values, name, colour in ((mrp, "$\\sigma$", COLOURS[0]), (other, "its shadow", COLOURS[1])):
        panel.plot(angle, values, color=colour, lw=1.0)
        panel.plot(angle, np.where(np.abs(values) <= 1, values, np.nan), color=colour, lw=3.0, label=name)
    panel.axhline(1, color="0.5", ls=":")
    panel.axhline(-1, color="0.5", ls=":")
    panel.set(xlim=(0, 360), ylim=(-3, 3), xticks=range(0, 361, 60))
    panel.set(xlabel="turn about the first axis [deg]", ylabel="first element [-]")
    panel.legend(fontsize=FONT, frameon=False, loc="upper left")
    return figure


def transformed() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return places in a funnel, [-], the transformed error and its slope de/dlambda there, [-]."""
    funnel = PerformanceFunnel(start=1.0, floor=1.0, decay=1.0, below=0.6, above=1.0)
    place = np.linspace(-0.599, 0.998, 800)
    error = np.array([float(funnel.error(0.0, s)) for s in place])
    return place, error, np.array([1 / float(funnel.spread(0.0, s)) for s in place])


def draw_transformed() -> Figure:
    """Draw what a law of prescribed performance sees, and how steep it is."""
    place, error, slope = transformed()
    figure, row = panels(2)
    for panel, values in zip(row, (error, slope), strict=True):
        panel.plot(place, values, color=COLOURS[0], lw=2)
        for wall in (-0.6, 1.0):
            panel.axvline(wall, color=COLOURS[1], ls="--")
        panel.set(xlabel=r"place in the funnel $\lambda$ [-]", xlim=(-0.7, 1.1))
    row[0].set(ylabel="transformed error $e$ [-]")
    row[1].set(ylabel=r"slope $de/d\lambda$ [-]", yscale="log")
    return figure


def estimates(gain: float, hold: float, corrected: bool, count: int = 60) -> np.ndarray:
    """Return the estimate of a disturbance of one that begins at once, at each of some samples, (count,)."""
    observer = DisturbanceObserver(gain, hold if corrected else 0.0)
    measured, memory, found = 0.0, 0.0, []
    for _ in range(count):
        found.append(observer.estimate(memory, measured))
        memory += hold * _held(gain, hold) * observer.rate(memory, measured, 0.0)
        measured += hold
    return np.array([float(value) for value in found])


def _held(gain: float, hold: float) -> float:
    """Return phi1(-gain hold): the memory moves exactly while the measurement is held."""
    return -np.expm1(-gain * hold) / (gain * hold)


def draw_estimates() -> Figure:
    """Draw the estimate of a constant disturbance by both feed-throughs, for a slow and a fast observer."""
    figure, row = panels(2)
    hold = 0.1
    for panel, gain, count in zip(row, (1.0, 27.0), (60, 12), strict=True):
        time = hold * np.arange(count)
        for corrected, name, colour in ((False, r"$L=\beta$", COLOURS[1]), (True, "sampled $L$", COLOURS[0])):
            values = estimates(gain, hold, corrected, count)
            panel.step(time, values, where="post", color=colour, lw=2, label=name)
        panel.axhline(1.0, color="0.4", ls=":")
        panel.set(xlabel="time [s]", ylim=(0, 3.1))
        panel.set_title(rf"$\beta h$ = {gain * hold:.1f}", fontsize=FONT)
    row[0].set(ylabel="estimate of a disturbance of 1")
    row[0].legend(fontsize=FONT, frameon=False, loc="upper left")
    return figure


def gaps() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return steps from the optimum to a bad guess, the cost above the best, and the bound, for the page's problem."""
    problem = allocation.AllocationProblem(
        np.array([[1.0, -1.0, 0.5]]), lower=0.0, upper=1.0, effort_weight=1e-2, change_weight=0.0, accuracy_weight=1.0
    )
    wanted, none_before = np.array([0.9]), np.zeros(3)
    best = allocation.solve(problem, wanted, backend="daqp").forces
    steps = np.logspace(-4, 0, 60)
    tried = [best + step * (np.array([0.5, 0.5, 0.5]) - best) for step in steps]
    least = problem.objective(best, wanted, none_before)
    true = np.array([problem.objective(forces, wanted, none_before) - least for forces in tried])
    box = problem.box(none_before)
    bound = np.array([problem.gap(forces, np.ones(1), wanted, none_before, *box) for forces in tried])
    return steps, true, bound


def draw_gaps() -> Figure:
    """Draw the true gap below its bound."""
    steps, true, bound = gaps()
    figure, (panel,) = panels(1)
    panel.loglog(steps, bound, color=COLOURS[1], lw=2, label="bound, from the data alone")
    panel.loglog(steps, true, color=COLOURS[0], lw=2, label="cost above the best")
    panel.set(xlabel="distance from the optimum, as a share of the way to the bad guess [-]", ylabel="cost [-]")
    panel.legend(fontsize=FONT, frameon=False, loc="upper left")
    return figure


def lyapunov(plant: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the largest eigenvalue of AX + XA' for X = [[1 + a, b], [b, 1 - a]], of the shape of `a`."""
    X = np.stack([np.stack([1 + a, b], -1), np.stack([b, 1 - a], -1)], -2)
    return np.linalg.eigvalsh(plant @ X + X @ plant.T)[..., -1]


#: A damped oscillator, and one that is pushed away from its rest.
STABLE, UNSTABLE = np.array([[0.0, 1.0], [-1.0, -1.0]]), np.array([[0.2, 0.9], [0.1, -0.8]])


def draw_cones() -> Figure:
    """Draw both cones of Lyapunov's inequality, cut at trace X = 2, where they meet and where they do not."""
    a, b = np.meshgrid(np.linspace(-1.9, 1.9, 401), np.linspace(-1.5, 1.5, 401))
    figure, row = panels(2, 3.6)
    turn = np.linspace(0, 2 * np.pi, 200)
    for panel, plant, name in zip(row, (STABLE, UNSTABLE), ("stable", "not stable"), strict=True):
        panel.fill(np.cos(turn), np.sin(turn), color=COLOURS[0], alpha=0.35, lw=0)
        panel.contourf(a, b, lyapunov(plant, a, b), levels=[-100, 0], colors=[COLOURS[1]], alpha=0.45)
        panel.set(xlabel="$(X_{11}-X_{22})/2$", xlim=(-1.9, 1.9), ylim=(-1.5, 1.5), aspect="equal")
        panel.set_title(name, fontsize=FONT)
    values, left = np.linalg.eig(UNSTABLE.T)
    v = left[:, np.argmax(values)]
    # v'Xv = 0: every X >= 0 lies on one side of this line, every X with AX + XA' < 0 on the other.
    normal, offset = np.array([v[0] ** 2 - v[1] ** 2, 2 * v[0] * v[1]]), v @ v
    foot, along = -offset * normal / (normal @ normal), np.array([-normal[1], normal[0]])
    ends = np.array([foot - 4 * along, foot + 4 * along])
    row[1].plot(*ends.T, color=COLOURS[6], lw=2)
    row[0].set(ylabel="$X_{12}$")
    row[0].text(-0.3, 0.5, "$X > 0$", fontsize=FONT)
    row[0].annotate("$AX+XA' < 0$", (0.1, -0.5), (0.7, -1.3), fontsize=FONT, arrowprops={"arrowstyle": "-"})
    row[1].text(*(foot - 0.9 * along / np.hypot(*along)), "$v'Xv = 0$", fontsize=FONT, va="bottom")
    return figure


PICTURES = {
    "mrp_shadow": draw_shadows,
    "funnel_error": draw_transformed,
    "observer_sampled": draw_estimates,
    "certificate": draw_gaps,
    "lyapunov_cones": draw_cones,
}


def main(folder: str) -> None:
    """Write all pictures into a folder."""
    for name, draw in PICTURES.items():
        save(draw(), Path(folder) / f"{name}.png")


if __name__ == "__main__":
    main(sys.argv[1])
