"""What the online allocator in C reports, along flights and of single answers."""

import numpy as np
import online_allocator as oa
import pytest
from online_allocator import Allocator
from online_answers import PLAIN, recorded


@pytest.mark.parametrize("name", ["slew", "noisy slew", "slew with rate box", "slew, 5 cm", "de-tumble"])
def test_the_fast_path_carries_the_flight(name):
    flight, allocator = recorded(name), Allocator(12, 3, 3, 8)
    allocator.setup(*PLAIN[:2], oa.centre_of_mass_vertices([5e-2 if "5 cm" in name else 5e-3] * 3), *PLAIN[3:])
    _, results = allocator.sequence(*[flight[k] for k in ("u", "previous", "lower", "upper")])
    assert (results["status"] == oa.OPTIMAL).all()
    assert results["relative_gap"].max() <= 1e-8
    assert (results["path"] == 2).mean() < 0.01
    assert results["active_set_iterations"].mean() < 5


def test_new_data_with_an_old_workspace(thrusters):
    """A change of mass properties in flight: the workspace is only a start, every answer is certified anew."""
    rng, allocator = np.random.default_rng(0), Allocator(12, 3, 3, 8)
    for _k in range(40):
        problem = (
            oa.A0_2020 * (1 + 0.1 * rng.normal(size=(3, 12))),
            oa.E_2020,
            oa.centre_of_mass_vertices([0.01] * 3),
            np.ones(12),
            np.ones(12),
            1e6,
            np.zeros(12),
        )
        allocator.setup(*problem)
        u, previous = rng.normal(size=3) * 3e-4, rng.uniform(0, oa.MAX_FORCE, 12)
        r = allocator.solve(u, previous, 0, oa.MAX_FORCE)
        gap, f, _ = oa.certificate(problem, u, previous, np.zeros(12), np.full(12, oa.MAX_FORCE), r.force, r.lam)
        assert r.status == oa.OPTIMAL
        assert gap <= 1.0001e-8 * f


def test_report(thrusters):
    lower, upper = np.zeros(12), np.full(12, oa.MAX_FORCE)
    lower[1] = upper[1] = 1e-3
    step = np.full(12, 1e-3)
    previous = np.full(12, 2e-3)
    previous[[3, 5]] = 3.2e-3, 0.4e-3
    u = np.array([4e-3, -2e-3, 1e-3])
    thrusters.reset()
    r = thrusters.solve(u, previous, lower, upper, step)
    F, code = np.array(r.force), np.array(r.saturation)
    lo, hi = oa.effective_box(lower, upper, previous, step)
    assert code[1] == 5
    assert F[1] == 1e-3
    for i in range(12):
        if code[i] in (1, 3):
            assert F[i] == lo[i]
            assert (code[i] == 3) == (lo[i] > lower[i])
        if code[i] in (2, 4):
            assert F[i] == hi[i]
            assert (code[i] == 4) == (hi[i] < upper[i])
        if code[i] == 0:
            assert lo[i] < F[i] < hi[i]
    assert {3, 4} <= set(code)
    assert np.allclose(r.unallocated, u - oa.A0_2020 @ F, atol=1e-15)
    errors = [np.linalg.norm(u - (oa.A0_2020 + D @ oa.E_2020) @ F) for D in PLAIN[2]]
    assert np.isclose(r.worst_error, max(errors), rtol=1e-12)
    assert errors[r.worst_vertex] >= max(errors) * (1 - 1e-12)


def test_preferred_forces_are_kept_when_they_make_the_torque():
    allocator, preferred = Allocator(12, 3, 3, 8), np.linspace(1e-3, 3e-3, 12)
    D = np.zeros((8, 3, 3))
    allocator.setup(oa.A0_2020, oa.E_2020, D, 1, 0, 1e6, preferred=preferred)
    r = allocator.solve(oa.A0_2020 @ preferred, np.zeros(12), 0, oa.MAX_FORCE)
    assert np.allclose(r.force, preferred, atol=1e-12)
    assert abs(sum(r.lam) - 1) < 1e-15


def test_at_rest_nothing_moves(thrusters):
    thrusters.reset()
    for interior_point in (False, True):
        r = thrusters.solve(np.zeros(3), np.zeros(12), 0, oa.MAX_FORCE, interior_point=interior_point)
        assert r.status == oa.OPTIMAL
        assert not np.any(r.force)
        assert r.objective == 0
        assert r.gap == 0


def test_every_status_has_a_sentence(thrusters):
    texts = [thrusters.call("status_text")(s).decode() for s in range(-1, 6)]
    assert len(set(texts[1:6])) == 5
    assert all(t.endswith(".") for t in texts)
    assert texts[0] == texts[6]
