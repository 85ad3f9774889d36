"""Time functions as printed here against C as one writes it by hand: loops over arrays, and the C library's functions.

    python tests/bench/hand_written_speed.py

Five functions that flight software is made of. Both are compiled alike and timed by `function_speed`; their answers
are compared first. Processor time of a call in nanoseconds, then the geometric mean of the ratios (shift 10 ns).
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import casadi as ca
import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
from function_speed import LOOP, SHIFT, answers, casadis, nanoseconds, ours

RNG = np.random.default_rng(7)
Pair = tuple[ca.Function, str]


def constants(**arrays: np.ndarray) -> str:
    """Return arrays as constants in C."""

    def braces(values: np.ndarray) -> str:
        return repr(float(values)) if values.ndim == 0 else "{" + ", ".join(map(braces, values)) + "}"

    sizes = {name: "".join(f"[{n}]" for n in values.shape) for name, values in arrays.items()}
    lines = (f"static const double {name}{sizes[name]} = {braces(values)};" for name, values in arrays.items())
    return "\n".join(["#include <math.h>", *lines, ""])


def quaternion_feedback() -> Pair:
    """Return -k_q sign(q0) q_v - k_w w + w x J w."""
    J = np.array([[24.0, 1.0, 0.5], [1.0, 30.0, -1.0], [0.5, -1.0, 34.0]])
    q, w = ca.SX.sym("q", 4), ca.SX.sym("w", 3)
    torque = -0.8 * ca.if_else(q[0] < 0, -1.0, 1.0) * q[1:] - 6.0 * w + ca.cross(w, ca.mtimes(ca.DM(J), w))
    c = """
static void f(const double *q, const double *w, double *torque)
{
    const double k = q[0] < 0.0 ? -0.8 : 0.8;
    double h[3];
    for (int i = 0; i < 3; ++i) {
        h[i] = J[i][0] * w[0] + J[i][1] * w[1] + J[i][2] * w[2];
    }
    torque[0] = -k * q[1] - 6.0 * w[0] + (w[1] * h[2] - w[2] * h[1]);
    torque[1] = -k * q[2] - 6.0 * w[1] + (w[2] * h[0] - w[0] * h[2]);
    torque[2] = -k * q[3] - 6.0 * w[2] + (w[0] * h[1] - w[1] * h[0]);
}
"""
    return ca.Function("feedback", [q, w], [torque]), constants(J=J) + c + LOOP % "f(given[0], given[1], found[0]);"


def clipped_allocation() -> Pair:
    """Return the forces of twelve thrusters, clipped, of a wanted torque and force."""
    P = RNG.normal(size=(12, 6))
    u = ca.SX.sym("u", 6)
    c = """
static void f(const double *u, double *forces)
{
    for (int i = 0; i < 12; ++i) {
        double sum = 0.0;
        for (int j = 0; j < 6; ++j) {
            sum += P[i][j] * u[j];
        }
        forces[i] = sum < 0.0 ? 0.0 : sum > 1.0 ? 1.0 : sum;
    }
}
"""
    clipped = ca.fmin(ca.fmax(ca.mtimes(ca.DM(P), u), 0.0), 1.0)
    return ca.Function("allocation", [u], [clipped]), constants(P=P) + c + LOOP % "f(given[0], found[0]);"


def filter_step() -> Pair:
    """Return the step of a Kalman filter of a place and its rate, by a measured place."""
    x, P, z = ca.SX.sym("x", 2), ca.SX.sym("P", 4), ca.SX.sym("z")
    A, Q, r = ca.DM([[1.0, 0.1], [0.0, 1.0]]), ca.diag(ca.DM([1e-4, 1e-3])), 0.04
    ahead, spread = ca.mtimes(A, x), ca.mtimes([A, ca.reshape(P, 2, 2), A.T]) + Q
    gain = spread[:, 0] / (spread[0, 0] + r)
    later, left = ahead + gain * (z - ahead[0]), spread - ca.mtimes(gain, spread[0, :])
    c = """
static void f(const double *x, const double *P, const double *z, double *later, double *left)
{
    const double x0 = x[0] + 0.1 * x[1], x1 = x[1];
    const double a = P[0] + 0.1 * P[1], b = P[2] + 0.1 * P[3];
    const double s00 = a + 0.1 * b + 1e-4, s01 = b, s10 = P[1] + 0.1 * P[3], s11 = P[3] + 1e-3;
    const double k0 = s00 / (s00 + 0.04), k1 = s10 / (s00 + 0.04), miss = z[0] - x0;
    later[0] = x0 + k0 * miss;
    later[1] = x1 + k1 * miss;
    left[0] = s00 - k0 * s00;
    left[1] = s10 - k1 * s00;
    left[2] = s01 - k0 * s01;
    left[3] = s11 - k1 * s01;
}
"""
    call = LOOP % "f(given[0], given[1], given[2], found[0], found[1]);"
    return ca.Function("filter", [x, P, z], [later, ca.vec(left)]), constants() + c + call


def network() -> Pair:
    """Return a network of eight inputs, two layers of sixteen and three outputs."""
    W1, W2, W3 = (RNG.normal(size=size) / 4 for size in ((16, 8), (16, 16), (3, 16)))
    x = ca.SX.sym("x", 8)
    hidden = ca.tanh(ca.mtimes(ca.DM(W2), ca.tanh(ca.mtimes(ca.DM(W1), x))))
    c = """
static void layer(int rows, int columns, const double *W, const double *x, double *y)
{
    for (int i = 0; i < rows; ++i) {
        double sum = 0.0;
        for (int j = 0; j < columns; ++j) {
            sum += W[i * columns + j] * x[j];
        }
        y[i] = sum;
    }
}

static void f(const double *x, double *y)
{
    double a[16], b[16];
    layer(16, 8, &W1[0][0], x, a);
    for (int i = 0; i < 16; ++i) {
        a[i] = tanh(a[i]);
    }
    layer(16, 16, &W2[0][0], a, b);
    for (int i = 0; i < 16; ++i) {
        b[i] = tanh(b[i]);
    }
    layer(3, 16, &W3[0][0], b, y);
}
"""
    head = constants(W1=W1, W2=W2, W3=W3)
    return ca.Function("network", [x], [ca.mtimes(ca.DM(W3), hidden)]), head + c + LOOP % "f(given[0], found[0]);"


def gravity() -> Pair:
    """Return the acceleration of two bodies and J2, in radii of the Earth and units of mu."""
    r = ca.SX.sym("r", 3)
    square = ca.sumsqr(r)
    share, near = 5 * r[2] ** 2 / square, 1.5 * 1.08263e-3 / square
    pull = -1 / (square * ca.sqrt(square))
    c = """
static void f(const double *r, double *a)
{
    const double square = r[0] * r[0] + r[1] * r[1] + r[2] * r[2];
    const double share = 5.0 * r[2] * r[2] / square, near = 1.5 * 1.08263e-3 / square;
    const double pull = -1.0 / (square * sqrt(square));
    a[0] = pull * r[0] * (1.0 + near * (1.0 - share));
    a[1] = pull * r[1] * (1.0 + near * (1.0 - share));
    a[2] = pull * r[2] * (1.0 + near * (3.0 - share));
}
"""
    told = ca.vertcat(*(pull * r[i] * (1 + near * (k - share)) for i, k in enumerate((1, 1, 3))))
    return ca.Function("gravity", [r], [told]), constants() + c + LOOP % "f(given[0], found[0]);"


def pairs() -> Iterator[Pair]:
    """Yield the functions with their C."""
    for each in (quaternion_feedback, clipped_allocation, filter_step, network, gravity):
        yield each()


def main() -> None:
    """Print a line a function, and the means."""
    rows = []
    print(f"{'function':12}{'ours':>9}{'by hand':>9}{'CasADi':>9}  [ns]")
    for function, by_hand in pairs():
        printed = ours(function)
        for found, expected in zip(answers(printed, function), answers(by_hand, function), strict=True):
            np.testing.assert_allclose(found, expected, rtol=1e-13, atol=1e-14)
        texts = printed, by_hand, casadis(function, best=False)
        rows.append([nanoseconds(text, function) for text in texts])
        print(f"{function.name():12}" + "".join(f"{each:9.1f}" for each in rows[-1]), flush=True)
    times = np.array(rows) + SHIFT
    by_hand, casadi = (np.exp(np.log(times[:, i] / times[:, 0]).mean()) for i in (1, 2))
    print(f"C by hand takes {by_hand:.2f} times our time, CasADi's {casadi:.2f}")


if __name__ == "__main__":
    main()
