"""What answers of the online allocator must be: what is solved, what a status claims, and flights to ask for them."""

from functools import cache

import numpy as np
import online_allocator as oa

PLAIN = (oa.A0_2020, oa.E_2020, oa.centre_of_mass_vertices([5e-3] * 3), 1, 1, 1e6)
FLIGHTS = {
    "slew": ("slew", 3000, {}),
    "noisy slew": ("slew", 3000, {"noise": 2e-6}),
    "slew with rate box": ("slew", 3000, {"rate": 1e-2}),
    "slew, 5 cm": ("slew", 3000, {"box": 5e-2}),
    "de-tumble": ("detumble", 8000, {}),
}


@cache
def recorded(name):
    """Return what a flight asks of the allocator, flown once."""
    kind, samples, options = FLIGHTS[name]
    return oa.fly(kind, samples, **options)


def with_added_weight(problem):
    """Return the problem that is solved: without any weight on the forces the set-up adds one of 1e-9 h |A0|^2."""
    A0, E, D, m1, m2, h, preferred = problem
    if (np.asarray(m1) + m2).any():
        return problem
    return A0, E, D, np.full(len(m1), 1e-9 * h * (A0**2).sum()), m2, h, preferred


def is_as_claimed(status, gap, f, scale, added):
    """Tell whether a true gap and cost are what `gnc_allocate.h` says of a status, in double precision.

    1.0001: the solver's own evaluation of the gap is in double. `added` is whether a weight was added at set-up.
    """
    if status == oa.OPTIMAL:
        return gap <= 1.0001e-8 * f or (f == 0 and gap == 0)
    if status == oa.AT_ROUNDING:
        return gap <= 1.0001 * (1e-5 if added else 1e-6) * f or gap <= 1.0001 * 2e-16 * scale
    return status == oa.NOT_CERTIFIED


def check(problem, u, previous, lower, upper, step, results, limit=1e-8):
    """Every answer: its own gap is right, and small. 1e-8 of the objective, or 1e-14 of the scale of the problem;
    if M1 = M2 = 0 the condition is 1e9 and 1e-5 of the objective is allowed."""
    stated = with_added_weight(problem)
    added = stated is not problem
    for k, r in enumerate(results):
        box = oa.effective_box(lower, upper, previous[k], step)
        gap, f, scale = oa.certificate(stated, u[k], previous[k], *box, r["force"], r["lam"])
        assert r["status"] in (oa.OPTIMAL, oa.AT_ROUNDING), (k, r["status"], float(gap / f))
        assert is_as_claimed(r["status"], gap, f, scale, added), (k, r["status"], float(gap / f))
        # 1.0001: their double and our extended evaluation of the same gap
        assert gap <= 1.0001 * limit * f or gap <= 1e-14 * scale or (added and gap <= 1e-5 * f), (k, float(gap / f))
        assert abs(r["gap"] - gap) <= 1e-9 * f + 1e-15 * scale
        assert abs(r["objective"] - f) <= 1e-11 * f + 1e-15 * scale
        assert abs(np.sum(r["lam"]) - 1) < 1e-12
        assert r["interior_point_iterations"] <= 34
