"""What the convergence theorem of close-proximity tracking asks of the gains, given target and tumble.

    2 a min Gamma/(1 + max Lambda)^2 > kappa_1^2                                       (28)

    a = min(min Lambda/8, min K_1/4, the two sides of (27))
    kappa_1 = (m |p_t| + ||J||) ||J_t^-1|| ||J_t|| alpha_1^2

with alpha_1 a bound on the target's rate. The paper takes it from an energy with the orbit's in it,
which makes kappa_1^2 exceed 1e13; the energy of rotation alone is conserved too and gives

    alpha_1^2 = omega_t' J_t omega_t/min eig J_t.

Source: Sun and Zheng (2018), doi:10.1109/TCST.2017.2669145. Its own gains violate (28) by three
orders of magnitude even so.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from casadi_gnc.checks import Check, sufficient
from casadi_gnc.laws.proximity_tracking import ProximityTracking
from casadi_gnc.mechanics.proximity_motion import ProximityMotion


def coupling_condition(law: ProximityTracking, motion: ProximityMotion, target_inertia: Any, target_rate: Any) -> Check:
    """Return condition (28) for numeric gains.

    Parameters
    ----------
    law : its gains are numbers.
    motion : the truth: m, J and p_t.
    target_inertia : J_t, (3, 3), [kg m^2], symmetric positive definite.
    target_rate : omega_t at any time, (3,), [rad/s], target frame.
    """
    slopes = float(law.position_slope), float(law.attitude_slope)
    damping = min(float(law.force_damping), float(law.torque_damping))
    a = min(min(slopes) / 8, damping / 4, *(check.value for check in law.checks()))
    margin = 2 * a * float(law.observer_gain) / (1 + max(slopes)) ** 2
    moments, rate = np.linalg.eigvalsh(np.array(target_inertia)), np.array(target_rate).ravel()
    fastest = rate @ np.array(target_inertia) @ rate / moments[0]
    largest = np.linalg.eigvalsh(np.array(motion.body.inertia))[-1]
    reach = float(motion.mass) * float(np.linalg.norm(np.array(motion.hold_point)))
    needed = ((reach + largest) * moments[-1] / moments[0] * fastest) ** 2
    return sufficient("gains.theorem2.coupling", margin, float(needed), "-", "Sun and Zheng (2018), eq. (28)")
