"""Truth: two bodies in inertial coordinates, 34 digits, Newton's gravity; and mpmath for single precision."""

import ctypes
import math
from decimal import Decimal as D
from decimal import localcontext

import casadi as ca
import mpmath
import numpy as np
import pytest

from casadi_gnc.embedded.printer import print_function
from casadi_gnc.mathematics.integrators import runge_kutta
from casadi_gnc.mechanics import attitude
from casadi_gnc.mechanics.circular_orbit import EARTH_MU, EARTH_RADIUS, CircularOrbit
from casadi_gnc.mechanics.disturbances import OrbitalDisturbance
from casadi_gnc.mechanics.rigid_body import RigidBody
from casadi_gnc.system import assets, compilers
from casadi_gnc.vehicles.drag_free_pair.plant import DragFreePair

ORBIT = CircularOrbit(EARTH_RADIUS + 260e3)
MASS, INERTIA = 20.0, np.array([[20, 0.1, 0.2], [0.1, 18, 0.3], [0.2, 0.3, 25]])
# Much larger disturbances and efforts than the paper's, so that a wrong frame shows within 20 s.
DISTURBANCE = OrbitalDisturbance(
    (0.1, 0.8, -1.0, 0.1, 0.08, 0.1), (7.0, -5.0, 5.0, -0.8, -0.6, 0.5), (-0.3, 0.2, -0.1, 0.03, -0.02, 0.01)
)
TOLD = np.array([0.5, -0.3, 0.2, 0.05, -0.1, 0.08])
START = np.array([-0.3, 0.4, 0.3, 0.01, -0.02, 0.01, 0.03, -0.05, 0.03, 0.15, -0.5, 0.1])
PAIR = DragFreePair(MASS, RigidBody(ca.DM(INERTIA)), ORBIT, DISTURBANCE)


def fly_pair(duration: float, h: float) -> np.ndarray:
    t, x = ca.SX.sym("t"), PAIR.state.symbol("x")
    stepped = runge_kutta(lambda t, x: PAIR.rate(t, x, ca.DM(TOLD), ca.DM(0, 1)), t, x, h)
    count = round(duration / h)
    step = ca.Function("step", [x, t], [stepped])
    return np.array(step.mapaccum(count)(START, ca.DM(np.arange(count) * h).T))[:, -1]


# ---- Inertial truth: lists of decimals -----------------------------------------------------------------------


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def times(matrix, v):
    return [sum(row[j] * v[j] for j in range(3)) for row in matrix]


def transposed(matrix):
    return [list(column) for column in zip(*matrix, strict=True)]


def decimals(array):
    return [decimals(part) for part in array] if np.ndim(array) else D(float(array))


def minus(a, b):
    return [p - q for p, q in zip(a, b, strict=True)]


def disturbed(t):
    s, c = math.sin(ORBIT.rate * float(t)), math.cos(ORBIT.rate * float(t))
    rows = zip(DISTURBANCE.constant, DISTURBANCE.sine, DISTURBANCE.cosine, strict=True)
    return [D(k + a * s + b * c) for k, a, b in rows]


def dcm(s):
    """Schaub and Junkins: C = I + (8 S S - 4 (1 - n) S)/(1 + n)^2, inertial -> body."""
    n = s[0] ** 2 + s[1] ** 2 + s[2] ** 2
    z = D(0)
    skew = [[z, -s[2], s[1]], [s[2], z, -s[0]], [-s[1], s[0], z]]
    square = [times(transposed(skew), row) for row in skew]
    return [[D(i == j) + (8 * square[i][j] - 4 * (1 - n) * skew[i][j]) / (1 + n) ** 2 for j in range(3)]
            for i in range(3)]  # fmt: skip


def gravity(p):
    square = p[0] ** 2 + p[1] ** 2 + p[2] ** 2
    return [-D(EARTH_MU) * c / (square * square.sqrt()) for c in p]


def inertial_rate(t, state, inertia, inverse):
    """State: craft's position and velocity, test mass's, the craft's rate and direction cosines inertial -> F_s."""
    position, velocity, mass_position, mass_velocity, spin, rotation = state
    given = [a + b for a, b in zip(decimals(TOLD), disturbed(t), strict=True)]
    force = times(transposed(rotation), given[:3])
    pushed = [a + f / D(MASS) for a, f in zip(gravity(position), force, strict=True)]
    turned = times(inverse, minus(given[3:], cross(spin, times(inertia, spin))))
    columns = [[-c for c in cross(spin, column)] for column in transposed(rotation)]
    return [velocity, pushed, mass_velocity, gravity(mass_position), turned, transposed(columns)]


def moved(state, rate, h):
    if isinstance(state, list):
        return [moved(s, r, h) for s, r in zip(state, rate, strict=True)]
    return state + h * rate


def inertial_flight(duration: float, h: float):
    """Return r, v, omega (F_s) and R(sigma) at the end; RK4, whose error at h = 20 ms is below 1e-12."""
    inertia = decimals(INERTIA)
    inverse = decimals(np.array(mpmath_inverse(INERTIA)))
    rate = D(ORBIT.rate)
    radius, r, v = D(ORBIT.radius), decimals(START[6:9]), decimals(START[9:])
    zero = D(0)
    rotation = dcm(decimals(START[:3]))
    orbital = [rotation[i][2] * rate for i in range(3)]
    mass_position, mass_velocity = [radius, zero, zero], [zero, radius * rate, zero]
    back = transposed(rotation)
    state = [
        [a + b for a, b in zip(mass_position, times(back, r), strict=True)],
        [a + b for a, b in zip(mass_velocity, times(back, v), strict=True)],
        mass_position,
        mass_velocity,
        [a + b for a, b in zip(decimals(START[3:6]), orbital, strict=True)],
        rotation,
    ]
    step = D(str(h))
    for k in range(round(duration / h)):
        t = k * step
        k1 = inertial_rate(t, state, inertia, inverse)
        k2 = inertial_rate(t + step / 2, moved(state, k1, step / 2), inertia, inverse)
        k3 = inertial_rate(t + step / 2, moved(state, k2, step / 2), inertia, inverse)
        k4 = inertial_rate(t + step, moved(state, k3, step), inertia, inverse)
        for slope, weight in ((k1, 1), (k2, 2), (k3, 2), (k4, 1)):
            state = moved(state, slope, step * weight / 6)
    position, velocity, mass_position, mass_velocity, spin, rotation = state
    # The orbiting frame, rebuilt from the test mass's own flight.
    radial = [c / sum(p * p for p in mass_position).sqrt() for c in mass_position]
    normal = cross(mass_position, mass_velocity)
    normal = [c / sum(p * p for p in normal).sqrt() for c in normal]
    frame = [radial, cross(normal, radial), normal]
    relative = transposed([times(rotation, axis) for axis in frame])
    omega = minus(spin, [relative[i][2] * rate for i in range(3)])
    to_craft = [times(rotation, minus(position, mass_position)), times(rotation, minus(velocity, mass_velocity))]
    return [np.array(part, dtype=float) for part in (*to_craft, omega, relative)]


def mpmath_inverse(matrix):
    with mpmath.workdps(40):
        return (mpmath.matrix(matrix.tolist()) ** -1).tolist()


def test_pair_is_two_bodies_in_inertial_space():
    """Rounding in the pair's own 2000 steps is some 1e-14; r grows to metres."""
    with localcontext() as context:
        context.prec = 34
        r, v, omega, rotation = inertial_flight(20.0, 0.02)
    end = PAIR.state.split(fly_pair(20.0, 0.01))
    assert np.linalg.norm(r) > 1
    assert np.abs(end.position - r).max() < 1e-9
    assert np.abs(end.velocity - v).max() < 1e-10
    assert np.abs(end.rate - omega).max() < 1e-12
    assert np.abs(np.array(attitude.dcm(ca.DM(end.mrp))) - rotation).max() < 1e-11


def test_test_mass_flies_at_260_km():
    assert ORBIT.rate == pytest.approx(1.167346e-3, rel=1e-6)
    with mpmath.workdps(30):
        assert ORBIT.rate == pytest.approx(float(mpmath.sqrt(mpmath.mpf(EARTH_MU) / ORBIT.radius**3)), rel=1e-15)


def gravity_truth(mrp, position):
    """The plain difference, 60 digits."""
    with mpmath.workdps(60):
        s, r = mpmath.matrix(mrp.tolist()), mpmath.matrix(position.tolist())
        n = (s.T * s)[0]
        skew = mpmath.matrix([[0, -s[2], s[1]], [s[2], 0, -s[0]], [-s[1], s[0], 0]])
        turn = mpmath.eye(3) + (8 * skew * skew - 4 * (1 - n) * skew) / (1 + n) ** 2
        mass = turn * mpmath.matrix([ORBIT.radius, 0, 0])
        pull = lambda p: -mpmath.mpf(EARTH_MU) / mpmath.norm(p) ** 3 * p  # noqa: E731
        return np.array((pull(mass + r) - pull(mass)).T.tolist()[0], dtype=float)


def printed(function: ca.Function, real: str):
    """Return the C of a function of one column, with `gnc_math`, as a Python callable."""
    text = f'typedef {real} gnc_real;\n#include "gnc_math.h"\n#include "gnc_mathf.h"\n'
    text += print_function(function, real=real)
    text += f"\nvoid call(const gnc_real *x, gnc_real *y) {{ {function.name()}(x, y); }}\n"
    library = compilers.compiled(text, include=assets.folder("codegen") / "runtime", flags=("-O2",))
    call, dtype = ctypes.CDLL(str(library)).call, np.float32 if real == "float" else np.float64

    def evaluate(x):
        x, y = np.array(x, dtype=dtype), np.zeros(3, dtype=dtype)
        call(ctypes.c_void_p(x.ctypes.data), ctypes.c_void_p(y.ctypes.data))
        return y

    return evaluate


@pytest.mark.parametrize(("real", "digits"), [("float", 3e-6), ("double", 3e-15)])
def test_gravity_difference_keeps_its_digits(rng, real, digits):
    """Some 20 roundings of the size of the direction cosines' own; the plain difference has none left in float."""
    x = ca.SX.sym("x", 6)
    plain = EARTH_MU * (ORBIT.radial(x[:3]) / ORBIT.radius**2)
    far = x[3:] + ORBIT.radius * ORBIT.radial(x[:3])
    plain -= EARTH_MU * far / (ca.sumsqr(far) * ca.norm_2(far))
    safe = printed(ca.Function("safe", [x], [ORBIT.gravity_difference(x[:3], x[3:])], ["x"], ["y"]), real)
    naive = printed(ca.Function("naive", [x], [plain], ["x"], ["y"]), real)
    lost = []
    for size in (1e-6, 1e-3, 0.05, 1.0, 100.0):
        for _ in range(10):
            at = np.concatenate([rng.uniform(-0.6, 0.6, 3), size * rng.uniform(-1, 1, 3)]).astype(np.float32)
            truth = gravity_truth(at[:3].astype(float), at[3:].astype(float))
            assert np.linalg.norm(safe(at) - truth) < digits * np.linalg.norm(truth)
            lost.append(np.linalg.norm(naive(at) - truth) / np.linalg.norm(truth))
    assert np.median(lost) > 1e6 * digits
