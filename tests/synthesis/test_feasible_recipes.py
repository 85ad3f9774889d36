"""Every recipe on plants that have gains by construction: no back end proves that there are none.

Truth: gains that SciPy's Riccati equation gives, whose norms are known by the Hamiltonian. Each plant has a mode that
no input reaches and that falls slowly, and states counted in units decades apart: what proofs within an assumed range
of the unknowns got wrong. What one margin certifies, no smaller one and no other back end may refute.
"""

import numpy as np
import pytest
from riccati_equations import riccati

from casadi_gnc.synthesis import (
    GainStatus,
    h_infinity_norm,
    input_ellipsoid,
    intermediate_observer,
    mixed_state_feedback,
    observer,
    output_feedback,
    polytope_state_feedback,
    saturation_margin,
    state_feedback,
)

MARGINS = (1e-9, 1e-7, 1e-5)
BACKENDS = ("clarabel", "barrier")
SEEDS = range(3)


class Slow:
    """Hold x' = A x + B u + E w, z = (x, u) with a slow mode, gains K, and a bound on the norm that they keep."""

    def __init__(self, seed):
        rng = np.random.default_rng(seed)
        n, self.rate = 3, 10 ** rng.uniform(-5, -1)
        A, B, E = rng.normal(size=(n, n)), rng.normal(size=(n, 1)), rng.normal(size=(n, 1))
        A[-1], B[-1], A[-1, -1] = 0, 0, -self.rate
        C, D = np.eye(n + 1)[:, :n], np.eye(n + 1)[:, n:]
        gamma = 2 / self.rate * (np.linalg.norm(E) + 1)
        while (P := riccati(A, B, E, np.eye(n), 1.0, gamma)) is None:
            gamma *= 2
        self.units = 10 ** rng.uniform(-3, 3, size=n)
        S, K = np.diag(self.units), B.T @ P
        self.A, self.B, self.E = S @ A / self.units, S @ B, S @ E
        self.C, self.D, self.K = C / self.units, D, K / self.units
        self.gamma = float(1.1 * h_infinity_norm(A - B @ K, E, C - D @ K).upper)
        self.wide = float(1.1 * gamma)


def state(p, **options):
    return state_feedback(p.A, p.B, p.E, p.C, p.D, gamma=p.gamma, **options)


def watched(p, **options):
    return observer(p.A.T, p.B.T, p.C.T, p.D.T, p.E.T, gamma=p.gamma, **options)


def mixed(p, **options):
    return mixed_state_feedback(p.A, p.B, p.E, p.C, p.D, p.C, p.D, gamma=p.gamma, **options)


def measured(p, **options):
    """All states are measured, so gains of a state feedback will do; the search for them is local and may find none."""
    return output_feedback(p.A, p.B, p.E, p.C, p.D, gamma=p.gamma, tries=1, **options)


def between(p, **options):
    """The plant, and the same with a tenth of K in it: P of the Riccati equation serves both, by its own terms."""
    pair = [p.A, p.A - 0.1 * p.B @ p.K]
    return polytope_state_feedback(pair, [p.B], p.E, p.C, p.D, gamma=p.wide, **options)


def enclosed(p, **options):
    return input_ellipsoid(p.A, p.B, np.diag(p.units), 1e6, p.rate / 2, **options)


def saturated(p, **options):
    return saturation_margin(p.A, p.B, p.K, **options)


def docking(p, **options):
    """One axis of a craft whose mass and length are counted in the plant's units: the shipped one is certified."""
    size = p.units[0]
    return intermediate_observer([[0, 1.0], [0, 0]], [[0], [0.05 * size]], 200.0 / size, **options)


RECIPES = (state, watched, mixed, measured, between, enclosed, saturated, docking)


@pytest.mark.slow
@pytest.mark.parametrize("recipe", RECIPES)
def test_what_has_gains_is_refuted_by_nobody(recipe):
    certified = 0
    for plant in map(Slow, SEEDS):
        for backend in BACKENDS:
            for margin in MARGINS[:2]:
                found = recipe(plant, margin=margin, backend=backend)
                told = (backend, margin, plant.rate, found.sentence())
                assert found.status not in (GainStatus.INFEASIBLE, GainStatus.UNBOUNDED), told
                certified += found.status is GainStatus.CERTIFIED
    assert certified or recipe is measured  # or nothing was tried


@pytest.mark.slow
@pytest.mark.parametrize("recipe", [state, watched, between, enclosed])
def test_what_one_margin_certifies_no_smaller_one_refutes(recipe):
    """Near and below the least gamma, where the last digits decide, and the back ends against each other too."""
    seen = set()
    for plant in map(Slow, range(10, 10 + len(SEEDS))):
        least = plant.gamma / 1.1
        for share in (0.5, 0.999, 1.001):
            plant.gamma = plant.wide = share * least
            found = {(m, b): recipe(plant, margin=m, backend=b).status for m in MARGINS for b in BACKENDS}
            seen |= set(found.values())
            certified = [margin for (margin, _), status in found.items() if status is GainStatus.CERTIFIED]
            refuted = [margin for (margin, _), status in found.items() if status is GainStatus.INFEASIBLE]
            assert max(certified, default=0.0) < min(refuted, default=1.0), (plant.rate, share, found)
    assert GainStatus.CERTIFIED in seen
