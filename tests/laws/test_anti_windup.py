"""The sign of the saturation compensator, shown on the closed loop it belongs to."""

import casadi as ca
import numpy as np
import pytest

from casadi_gnc.laws import REGISTRY, Detumble, PerformanceFunnel, PrescribedPerformance
from casadi_gnc.mechanics.rigid_body import RigidBody

BODY = RigidBody(ca.DM(np.diag([0.5, 1.2, 1.3])))
GAINS = {"compensator_gain": 1.0, "compensator_decay": 0.5, "observer_gain": 1.0, "rate_gain": 0.4}


def saturated_slope(law) -> float:
    """Return d(zeta')/d(zeta) while the achieved torque is cut to a constant."""
    y, m = ca.SX.sym("y", law.inputs.size), law.memory.symbol("m")
    wanted = law.command(0.0, y, m)
    rate = law.rate(0.0, y, m, wanted, ca.DM([1e-3, 0, 0]))
    rows = law.memory.place("missing")
    slope = ca.Function("slope", [y, m], [ca.jacobian(rate, m)[rows, rows]])
    return float(slope(np.full(law.inputs.size, 1e-3), np.zeros(law.memory.size))[0, 0])


@pytest.mark.parametrize("name", ["detumble", "prescribed_performance"])
def test_corrected_sign_is_stable_and_printed_sign_runs_away(name):
    funnel = PerformanceFunnel(
        ca.DM([1.0] * 3), ca.DM([1e-3] * 3), ca.DM([0.1] * 3), ca.DM([1.0] * 3), ca.DM([1.0] * 3)
    )
    extra = {"funnel": funnel, "attitude_gain": 0.1, "filter_time_constant": 1.0} if name != "detumble" else {}
    law = REGISTRY.find(name)(body=BODY, **GAINS, **extra)
    assert isinstance(law, (Detumble, PrescribedPerformance))
    # zeta' = -k4 zeta + u - u_c0 with u_c0 = ... +- k3 zeta: the rate is -k4 -+ k3.
    assert saturated_slope(law) == pytest.approx(-1.5)
    printed = REGISTRY.find(name)(body=BODY, printed=frozenset({"anti_windup_sign"}), **GAINS, **extra)
    assert saturated_slope(printed) == pytest.approx(+0.5)
