"""The de-tumble loop of Huang, Biggs, Duan (2020), written again by hand in plain numpy.

Independent of the library on purpose: an oracle for it, and the peer of the speed benchmark, which
is what an analyst without code generation would write. Sampled: measure, hold, advance.
"""

import numpy as np

R = np.array(  # R_sc with the corrected entry (2,1), from its angles pi/3, pi/7, pi/4
    [
        [np.cos(np.pi / 7) * np.cos(np.pi / 4), np.cos(np.pi / 7) * np.sin(np.pi / 4), -np.sin(np.pi / 7)],
        [0.0, 0.0, 0.0],
        [0.0, 0.0, 0.0],
    ]
)
_c, _s = np.cos(np.pi / 3), np.sin(np.pi / 3)
_y = np.array([-np.sin(np.pi / 4), np.cos(np.pi / 4), 0.0])
_z = np.array([np.sin(np.pi / 7) * np.cos(np.pi / 4), np.sin(np.pi / 7) * np.sin(np.pi / 4), np.cos(np.pi / 7)])
R[1], R[2] = _c * _y + _s * _z, -_s * _y + _c * _z

J0 = np.diag([0.49019, 1.2089, 1.2916])
J = 1.1 * J0
B, J_INVERSE = np.linalg.inv(J0), np.linalg.inv(J)
_corners = np.array([[0.1, -0.1, 0.1], [0.1, 0.1, 0.1], [-0.1, -0.1, 0.1], [-0.1, 0.1, -0.1]])
_d = np.repeat(_corners, 3, axis=0)
_e = np.array(
    [[0, 1, 0], [-1, 0, 0], [0, 0, 1], [-1, 0, 0], [0, -1, 0], [0, 0, -1],
     [0, 1, 0], [0, 0, -1], [1, 0, 0], [0, 0, 1], [0, -1, 0], [1, 0, 0]]
)  # fmt: skip
A = np.cross((_d - 0.05) @ R.T, _e @ R.T).T
PINV = np.linalg.pinv(A)
U_T = 5e-3 * np.cross(R @ np.array([-0.05, -0.05, -0.15]), R @ np.array([0.0, 0.0, 1.0]))
W0, H = 1.1e-3, 0.1
K2, K3, K4, BETA = 0.4, 0.01, 0.5, 27.0


def disturbance(t: float) -> np.ndarray:
    a, b = np.sin(np.pi * t / 125), np.sin(np.pi * t / 200)
    return 1e-4 * np.array([1 + a + 1.5 * b, 2 + 1.5 * a - 2 * b, -1 + 2 * a - 1.5 * b])


def plant(t: float, x: np.ndarray, force: np.ndarray) -> np.ndarray:
    s, w = x[:3], x[3:]
    n = s @ s
    s_rate = 0.25 * ((1 - n) * w + 2 * np.cross(s, w) + 2 * s * (s @ w))
    q = 1 - n
    c = np.array(
        [
            8 * s[0] * s[2] - 4 * s[1] * q,
            8 * s[1] * s[2] + 4 * s[0] * q,
            4 * (s[2] ** 2 - s[1] ** 2 - s[0] ** 2) + q * q,
        ]
    )
    c /= (1 + n) ** 2
    torque = A @ force + U_T + 3 * W0**2 * np.cross(c, J @ c) + disturbance(t)
    return np.concatenate([s_rate, J_INVERSE @ (torque - np.cross(w, J @ w))])


def fly(samples: int, *, feedback: str = "wanted") -> dict[str, np.ndarray]:
    """Return rate, force and achieved torque of every sample."""
    x = np.array([0.0, 0.0, 0.0, 0.45, 0.52, 0.55])
    through = (1 - np.exp(-BETA * H)) / H
    z, zeta = -through * x[3:], np.zeros(3)
    rates, forces = np.zeros((samples, 3)), np.zeros((samples, 12))
    for k in range(samples):
        t, w = k * H, x[3:]
        estimate = z + through * w
        known = B @ (U_T - np.cross(w, J0 @ w))
        u0 = J0 @ (-K2 * w + K3 * (B @ zeta) - known - estimate)
        u = np.clip(u0, -1.5e-3, 1.5e-3)
        force = np.clip(PINV @ u, 0, 3.75e-3)
        rates[k], forces[k] = w, force
        told = u if feedback == "wanted" else A @ force
        z = z - (1 - np.exp(-BETA * H)) * (estimate + known + B @ told)
        zeta = np.exp(-K4 * H) * zeta + (1 - np.exp(-K4 * H)) / K4 * (told - u0)
        k1 = plant(t, x, force)
        k2 = plant(t + H / 2, x + H / 2 * k1, force)
        k3 = plant(t + H / 2, x + H / 2 * k2, force)
        k4 = plant(t + H, x + H * k3, force)
        x = x + H / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        if x[:3] @ x[:3] > 1:
            x[:3] = -x[:3] / (x[:3] @ x[:3])
    return {"rate": rates, "force": forces, "achieved": forces @ A.T}
