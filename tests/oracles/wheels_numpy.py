"""The loop of Huang and Duan (2019), section IV, written again by hand in plain numpy.

Independent of the library on purpose, in the paper's own convention: u = C Jw x is the torque on the
wheels, the body feels -u. Runge-Kutta of order 4 at 0.1 s over plant and controller together.
"""

import numpy as np

R_PRINTED = np.array(
    [[0.63708, 0.63708, -0.43388], [-0.87855, 0.61925, 0.78026], [0.76577, -0.45897, 0.45048]]
)  # entry (2, 1) is a misprint, and the printed C_0 was computed with it
C_BAR = np.array([[1, 0, 0, 3**-0.5], [0, 1, 0, 3**-0.5], [0, 0, 1, 3**-0.5]])
JW, W0, H, UMAX, XMAX = 0.338, 7.292115e-5, 0.1, 1.0, 7.0
J, J0 = np.diag([12.0, 14.0, 22.0]), np.diag([10.0, 15.0, 20.0])
K1, K2, K3, K4, GAM, LAM, TAU = 0.5, 0.4, 0.05, 20.0, 10.0, 4.0, 1.0
SIGMA0, OMEGA0 = np.array([0.323, -0.194, 0.388]), np.array([-0.01, 0.02, -0.03])


def cross(a, b):
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def g_matrix(s):
    sx = np.array([[0, -s[2], s[1]], [s[2], 0, -s[0]], [-s[1], s[0], 0]])
    return 0.25 * ((1 - s @ s) * np.eye(3) + 2 * sx + 2 * np.outer(s, s))


def vertical(s):
    q = 1 - s @ s
    up = 4 * (s[2] ** 2 - s[1] ** 2 - s[0] ** 2) + q * q
    return np.array([8 * s[0] * s[2] - 4 * s[1] * q, 8 * s[1] * s[2] + 4 * s[0] * q, up]) / (1 + s @ s) ** 2


def gravity(s, inertia):
    c = vertical(s)
    return 3 * W0**2 * cross(c, inertia @ c)


def disturbance(t):
    return np.array([0.005 * np.cos(0.02 * t), -0.005 * np.cos(0.025 * t), 0.006 * np.sin(0.04 * t)])


def axis_faults(t, middle):
    """Factor and bias of each torque axis, the printed set: (e1, bias 2) at 5 s, e2 at 10 s, 3 from 5 to 15 s.

    `middle` of the step says on which side of them its stages are.
    """
    early, late = (1 - np.exp(-(t - start)) if middle > start else 0.0 for start in (5.0, 10.0))
    third = early if middle < 15.0 else 0.0
    return np.array([1 - 0.5 * early, 1 - 0.5 * late, 1 - third]), np.array([0.0, 0.2 * early, -0.2 * third])


def no_faults(t, middle):
    return np.ones(3), np.zeros(3)


def fly(samples, *, centre_error=(0, 0, 0), j0=J0, umax=UMAX, scale=1.0, faults=axis_faults, noise=None, allocate=None):
    """Return mrp, rate, wheel speed, u_c and wheel acceleration of every sample.

    `noise` is (samples, 8) standard normal numbers times their deviation: scale and additive part of
    the attitude, then of the rate. `allocate(u)` returns x; the clipped pseudo-inverse by default.
    """
    c0, c = R_PRINTED @ (C_BAR - 2.0), R_PRINTED @ (C_BAR - 2.0 - np.asarray(centre_error, float)[:, None])
    pinv, j0_inverse, j_inverse = np.linalg.pinv(c0 * JW), np.linalg.inv(j0), np.linalg.inv(J)
    allocate = allocate or (lambda u: np.clip(pinv @ u, -XMAX, XMAX))
    noise = np.zeros((samples, 8)) if noise is None else noise

    def law(x, m, n):
        sh = x[:3] * (1 + n[0]) + n[1:4]
        wh = x[3:6] * (1 + n[4]) + n[5:8]
        s, x2d, zeta, eta = m[:3], m[3:6], m[6:9], m[9:12]
        g, d1 = g_matrix(sh), s + GAM * sh
        y2 = x2d + np.linalg.solve(g, K1 * sh + d1)
        s2 = wh - x2d
        d2 = eta + LAM * s2
        f = j0_inverse @ (-cross(wh, j0 @ wh + c0 @ x[6:] * JW) + gravity(sh, j0))
        u0 = j0 @ (g.T @ sh + f + K2 * s2 + d2 + y2 / TAU) + K3 * zeta  # (36) prints -K3 zeta
        uc = np.clip(u0, -umax, umax)
        s_rate = -GAM * s - GAM * (g @ wh + GAM * sh)
        eta_rate = -LAM * eta - LAM * (f - j0_inverse @ uc + y2 / TAU + LAM * s2)
        return uc, np.concatenate([s_rate, -y2 / TAU, -K4 * zeta + uc - u0, eta_rate])

    def rate(t, middle, x, m, n):
        uc, m_rate = law(x, m, n)
        accel = allocate(uc)
        e, bias = faults(t, middle)
        u = e * (c @ accel * JW) + bias
        w = x[3:6]
        torque = -cross(w, J @ w + c @ x[6:] * JW) - u + gravity(x[:3], J) + scale * disturbance(t)
        return uc, accel, np.concatenate([g_matrix(x[:3]) @ w, j_inverse @ torque, accel]), m_rate

    x = np.concatenate([SIGMA0, OMEGA0, np.zeros(4)])
    sh, wh = x[:3] * (1 + noise[0, 0]) + noise[0, 1:4], x[3:6] * (1 + noise[0, 4]) + noise[0, 5:8]
    x2d = -np.linalg.solve(g_matrix(sh), K1 * sh)
    m = np.concatenate([-GAM * sh, x2d, np.zeros(3), -LAM * (wh - x2d)])
    rows = []
    for k in range(samples):
        t, n = k * H, noise[k]
        uc, accel, *k1 = rate(t, t + H / 2, x, m, n)
        rows.append(np.concatenate([x, uc, accel]))
        slopes = [np.concatenate(k1)]
        for length in (H / 2, H / 2, H):
            xm = np.concatenate([x, m]) + length * slopes[-1]
            slopes.append(np.concatenate(rate(t + length, t + H / 2, xm[:10], xm[10:], n)[2:]))
        moved = np.concatenate([x, m]) + H / 6 * (slopes[0] + 2 * slopes[1] + 2 * slopes[2] + slopes[3])
        x, m = moved[:10], moved[10:]
    rows = np.array(rows)
    return {"mrp": rows[:, :3], "rate": rows[:, 3:6], "speed": rows[:, 6:10], "uc": rows[:, 10:13], "x": rows[:, 13:]}
