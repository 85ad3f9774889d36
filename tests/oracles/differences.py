"""Slopes by differences, extrapolated, and the short flights whose numbers they are taken of."""

import itertools

import casadi as ca
import numpy as np

import casadi_gnc
from casadi_gnc.missions.one_build import OneBuild
from casadi_gnc.missions.parameters import vary
from casadi_gnc.missions.sensitivities.engine import DerivativeEngine


def richardson(f, x, direction, step):
    """Return the slope of f by central differences of three steps, and an estimate of its error."""
    d = [(f(x + s * direction) - f(x - s * direction)) / (2 * s) for s in (step, step / 2, step / 4)]
    once = [(4 * b - a) / 3 for a, b in itertools.pairwise(d)]
    found = (16 * once[1] - once[0]) / 15
    return found, abs(found - once[1])


def flown(name, scheme, keys, samples=1000, away=0.0):
    """Return short flights, an engine that asks for all states and actuators, and weights for each of their numbers.

    They begin at numbers, (P,), that are the file's own, or drawn `away` from them, as a share of each.
    """
    mission = casadi_gnc.load(name.removesuffix(" continuous"), strict=False)
    mode = "continuous" if name.endswith("continuous") else mission.timing.mode
    short = mission.with_timing(duration=mission.timing.sample_period * samples, record_every=1, mode=mode)
    varied = vary(short, keys, scheme)
    layout = varied.tapes.row
    row = layout.symbol("row")
    efforts = varied.scheme.actuation.named("limited").names
    names = (*short.truth.state.names, *efforts, *short.truth.inputs.names)
    places = [i for name in names for i in range(*layout.place(name).indices(layout.size))]
    engine = DerivativeEngine(varied, ca.Function("quantities", [row], [row[places]]))
    own = varied.parameters.nominal
    drawn = np.random.default_rng(1).uniform(-1, 1, len(own))
    p = own + away * drawn * np.where(own == 0, np.abs(own).max() or 1.0, np.abs(own))
    record = OneBuild(varied).fly_row(p, mission.noise.seed, decimation=1).samples[:, places]
    sizes = np.abs(record).max(axis=0)
    weights = np.random.default_rng(0).standard_normal(record.shape) / np.where(sizes > 0, sizes, 1)
    return varied, engine, p, places, record, weights
