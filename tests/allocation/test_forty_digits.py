"""What the online allocator in C claims of its answers, against gap and cost of the same forces in forty digits."""

from collections import Counter

import mpmath
import numpy as np
import online_allocator as oa
import pytest
from online_allocator import COLD, INTERIOR_POINT, WARM, Allocator
from online_answers import PLAIN, is_as_claimed, with_added_weight

_mpf = np.frompyfunc(lambda x: mpmath.mpf(float(x)), 1, 1)


def exactly(problem, u, previous, box, force, lam) -> tuple[float, float, float]:
    """Return gap, objective and scale, to forty digits."""
    with mpmath.workdps(40):
        given = [_mpf(part) for part in problem], *map(_mpf, (u, previous, *box, force, lam))
        return tuple(float(x) for x in oa.certificate(*given, number=object))  # type: ignore[return-value]


def hold(family: str, problems: int, shapes) -> Counter:
    """Check claims of three ways through the solver from one family; return how many answers had each status."""
    rng, seen = np.random.default_rng(40 + sum(map(ord, family))), Counter()
    for N, R in shapes:
        allocator = Allocator(N, R, 3, 8)
        for _ in range(problems):
            problem, u, previous, lower, upper, step = oa.instance(rng, family, N, R)
            assert allocator.setup(*problem) == oa.OPTIMAL
            stated = with_added_weight(problem)
            for mode in (COLD, WARM, INTERIOR_POINT):
                _, results = allocator.sequence(u, previous, lower, upper, step, mode=mode)
                for k, r in enumerate(results):
                    box = oa.effective_box(lower, upper, previous[k], step)
                    gap, f, scale = exactly(stated, u[k], previous[k], box, r["force"], r["lam"])
                    assert gap >= 0
                    assert abs(r["gap"] - gap) <= 1e-9 * f + 1e-15 * scale
                    assert abs(r["objective"] - f) <= 1e-11 * f + 1e-15 * scale
                    assert is_as_claimed(r["status"], gap, f, scale, added=stated is not problem), (N, R, mode, k)
                    seen[int(r["status"])] += 1
    return seen


@pytest.mark.parametrize("family", ["plain", "all_zero"])
def test_claims_of_a_few_answers(family):
    assert sum(hold(family, 1, [(12, 3)]).values()) == 18


@pytest.mark.long
@pytest.mark.parametrize("family", oa.FAMILIES)
def test_claims_of_ten_thousand_answers(family):
    """Sixteen families of 630: every size, cold, warm and by the interior point alone."""
    seen = hold(family, 5, oa.SHAPES)
    assert sum(seen.values()) == 630
    assert seen[oa.OPTIMAL] + seen[oa.AT_ROUNDING] >= 600


def test_certificate_in_forty_digits(thrusters):
    """The extended-precision certificate of the other tests is itself right: mpmath, 40 digits, a few answers."""
    mpmath.mp.dps = 40
    rng = np.random.default_rng(4)
    u, previous = rng.normal(size=(5, 3)) * 6e-4, rng.uniform(0, oa.MAX_FORCE, (5, 12))
    lower, upper = np.zeros(12), np.full(12, oa.MAX_FORCE)
    _, results = thrusters.sequence(u, previous, lower, upper, mode=COLD)
    D = PLAIN[2]
    for k, r in enumerate(results):
        F, lam = [mpmath.mpf(float(x)) for x in r["force"]], [mpmath.mpf(float(x)) for x in r["lam"]]
        lam = [x / mpmath.fsum(lam) for x in lam]
        errors = []
        B = [
            [
                [
                    mpmath.mpf(float(oa.A0_2020[a, i]))
                    + mpmath.fsum(mpmath.mpf(float(D[v, a, j])) * mpmath.mpf(float(oa.E_2020[j, i])) for j in range(3))
                    for i in range(12)
                ]
                for a in range(3)
            ]
            for v in range(8)
        ]
        for v in range(8):
            errors.append([mpmath.fdot(B[v][a], F) - mpmath.mpf(float(u[k, a])) for a in range(3)])
        q = [10**6 * mpmath.fdot(e, e) for e in errors]
        gap = max(q) - mpmath.fdot(lam, q)
        for i in range(12):
            g = (
                2 * F[i]
                + 2 * (F[i] - mpmath.mpf(float(previous[k, i])))
                + 2 * 10**6 * mpmath.fsum(lam[v] * B[v][a][i] * errors[v][a] for v in range(8) for a in range(3))
            )
            d = min(max(-g / 4, -F[i]), mpmath.mpf(float(upper[i])) - F[i])
            gap -= g * d + 2 * d * d
        f = max(q) + mpmath.fsum(x * x + (x - mpmath.mpf(float(p))) ** 2 for x, p in zip(F, previous[k], strict=False))
        assert 0 <= gap <= 1e-8 * f
        ours = oa.certificate(
            (*PLAIN[:3], np.ones(12), np.ones(12), 1e6, np.zeros(12)),
            u[k],
            previous[k],
            lower,
            upper,
            r["force"],
            r["lam"],
        )[0]
        assert abs(ours - np.longdouble(str(gap))) <= 1e-12 * float(f)
