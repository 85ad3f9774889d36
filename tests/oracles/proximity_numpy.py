"""The proximity loop of Sun and Zheng (2018), written again by hand in plain numpy.

Independent of the library on purpose: an oracle for it, and the peer of the speed benchmark, which
is what an analyst without code generation would write. Sampled: measure, hold, advance. The low
circular orbit on a quarter of the limits, without noise; z(0) estimates nothing, the turn is the long one.
"""

import numpy as np

MU, POINT, MASS = 3.986e14, np.array([0.0, 5.0, 0.0]), 58.2
J = np.array([[598.3, -22.5, -51.5], [-22.5, 424.4, -27.0], [-51.5, -27.0, 263.6]])
J_TARGET = np.array([[3336.0, -135.4, -154.2], [-135.4, 3185.0, -148.5], [-154.2, -148.5, 2424.0]])
J_INVERSE, J_TARGET_INVERSE = np.linalg.inv(J), np.linalg.inv(J_TARGET)
M0, J0 = 0.8 * MASS, 0.8 * J
CONSTANT = np.array([0.3, 0.3, 0.2, 0.06, 0.07, 0.04])
SINE = np.array([-0.2, -0.3, 0.4, -0.04, 0.05, -0.03])
COSINE = np.array([-0.4, 0.2, 0.2, 0.05, -0.04, 0.03])
H, LIMIT = 0.01, np.array([5.0, 5.0, 5.0, 2.5, 2.5, 2.5])
SLOPE, K1 = np.repeat([0.02, 0.15], 3), np.repeat([20.0, 200.0], 3)
K2, K3, GAMMA = 1.0, 0.2, 0.3
#: r_e, sigma_e, v_e, omega_e, r, v, omega
START = np.concatenate(
    [
        [50 / np.sqrt(2), 0.0, -50 / np.sqrt(2), 0.5, -0.6, 0.7, 0.5, -0.5, 0.5, 0.02, -0.02, 0.02],
        np.full(3, 7.078e6 / np.sqrt(3)),
        np.sqrt(MU / 7.078e6) * np.array([1.0, 2.0, -3.0]) / np.sqrt(14),
        np.zeros(3),
    ]
)


def rotation(s: np.ndarray) -> np.ndarray:
    n, across = s @ s, np.array([[0, -s[2], s[1]], [s[2], 0, -s[0]], [-s[1], s[0], 0]])
    return np.eye(3) - 4 * (1 - n) / (1 + n) ** 2 * across + 8 / (1 + n) ** 2 * across @ across


def mrp_rate(s: np.ndarray, w: np.ndarray) -> np.ndarray:
    return 0.25 * ((1 - s @ s) * w + 2 * np.cross(s, w) + 2 * s * (s @ w))


def gravity(r: np.ndarray, re: np.ndarray, arm: np.ndarray) -> np.ndarray:
    mu, mu_t = MU / np.linalg.norm(r) ** 3, MU / np.linalg.norm(r - re - arm) ** 3
    return (mu - mu_t) * r + mu_t * (arm + re)


def plant(t: float, x: np.ndarray, effort: np.ndarray) -> np.ndarray:
    re, se, ve, we, r, v, w = x.reshape(7, 3)
    mu = MU / np.linalg.norm(r) ** 3
    phase = np.sqrt(mu) * t
    push = effort + CONSTANT + SINE * np.sin(phase) + COSINE * np.cos(phase)
    turn, a = rotation(se), w - we
    arm, wt = turn @ POINT, turn.T @ a
    wt_rate = -J_TARGET_INVERSE @ np.cross(wt, J_TARGET @ wt)
    ve_rate = -np.cross(w, ve) - np.cross(a, np.cross(a, arm)) - gravity(r, re, arm)
    w_rate = J_INVERSE @ (push[3:] - np.cross(w, J @ w))
    return np.concatenate(
        [
            ve - np.cross(w, re),
            mrp_rate(se, we),
            ve_rate + push[:3] / MASS + turn @ np.cross(POINT, wt_rate),
            w_rate - np.cross(w, we) - turn @ wt_rate,
            v - np.cross(w, r),
            push[:3] / MASS - np.cross(w, v) - mu * r,
            w_rate,
        ]
    )


def known_effort(x: np.ndarray) -> np.ndarray:
    """Return h_s of eq. (16)."""
    re, se, ve, we, r, _, w = x.reshape(7, 3)
    arm, a = rotation(se) @ POINT, w - we
    g = np.cross(w, ve) + np.cross(a, np.cross(a, arm)) + gravity(r, re, arm)
    force = M0 * (-g + SLOPE[:3] * (ve - np.cross(w, re)))
    return np.concatenate([force, -np.cross(w, J0 @ w) - J0 @ np.cross(w, we) + J0 @ (SLOPE[3:] * mrp_rate(se, we))])


def fly(samples: int) -> dict[str, np.ndarray]:
    """Return position error, attitude error, effort and the estimate of every sample."""
    x, zeta = START.copy(), np.zeros(6)
    through = (1 - np.exp(-GAMMA * H)) / H
    rows = {name: np.zeros((samples, n)) for name, n in (("position_error", 3), ("attitude_error", 3), ("effort", 6))}
    rows["estimate"] = np.zeros((samples, 6))
    z = None
    for k in range(samples):
        t, se = k * H, x[3:6]
        s = x[6:12] + SLOPE * x[:6]
        momentum = np.concatenate([M0 * s[:3], J0 @ s[3:]])
        z = -through * momentum if z is None else z
        estimate, known = z + through * momentum, known_effort(x)
        pull = np.concatenate([x[:3], 0.25 * (1 + se @ se) * se])
        wanted = -pull - K1 * s + K2 * zeta - known - estimate
        effort = np.clip(wanted, -LIMIT, LIMIT)
        for name, value in zip(rows, (x[:3], se, effort, estimate), strict=True):
            rows[name][k] = value
        z = z - (1 - np.exp(-GAMMA * H)) * (estimate + known + effort)
        zeta = np.exp(-K3 * H) * zeta + (1 - np.exp(-K3 * H)) / K3 * (effort - wanted)
        k1 = plant(t, x, effort)
        k2 = plant(t + H / 2, x + H / 2 * k1, effort)
        k3 = plant(t + H / 2, x + H / 2 * k2, effort)
        k4 = plant(t + H, x + H * k3, effort)
        x = x + H / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return rows
