"""Linearise a closed loop, and take the gradient of a whole flight by a gain.

What flies is a CasADi function, so analysis needs no second model:

1. one sample of the closed de-tumble loop is differentiated at its steady state, thrusters that sit
   on a bound included, and its poles are printed;
2. the cost of a 30 s slew is differentiated by the law's rate gain, through 300 samples, and the
   gradient is compared with central differences.
"""

import dataclasses

import casadi as ca
import numpy as np

import casadi_gnc


def linearise() -> np.ndarray:
    """Return the poles of the sampled loop (in z) after a minute at rest under its disturbance."""
    mission = casadi_gnc.load("huang2020/detumble")
    loop = mission.closed_loop("observer_pinv")
    calm = dataclasses.replace(mission, start_from={"mrp": [0.0] * 3, "rate": [0.0] * 3})
    state = calm.loop_start("observer_pinv")
    for k in range(600):
        found = loop(t=k * mission.timing.sample_period, **state)
        state = {name: found[f"{name}_next"] for name in state}
    t, x, m, force, good = loop.sx_in()
    x_next, m_next, *_ = loop(t, x, m, force, good)
    moving = ca.vertcat(x[3:], m)  # the attitude does not act on this loop
    jacobian = ca.Function("slope", [t, x, m, force, good], [ca.jacobian(ca.vertcat(x_next[3:], m_next), moving)])
    return np.linalg.eigvals(np.array(jacobian(60.0, *(state[name] for name in ("x", "m", "actuators", "good")))))


def flight_cost() -> ca.Function:
    """Return the sum of squared attitude over the flight as a function of the rate gain k2."""
    mission = casadi_gnc.load("huang2020/slew").with_timing(duration=30.0)
    gain = ca.SX.sym("k2")
    tuned = mission.with_scheme("funnel_pinv", rate_gain=gain)
    loop = tuned.closed_loop(parameters=[gain])
    state = tuned.loop_start()
    k2, cost = ca.MX.sym("k2"), 0
    for k in range(mission.timing.samples - 1):
        found = loop(t=k * mission.timing.sample_period, p=k2, **state)
        state = {name: found[f"{name}_next"] for name in state}
        cost += ca.sumsqr(state["x"][:3])
    return ca.Function("cost", [k2], [cost, ca.gradient(cost, k2)])


if __name__ == "__main__":
    poles = linearise()
    print("poles of the sampled loop:", np.array2string(np.sort_complex(poles), precision=3))
    assert np.all(np.abs(poles) < 1)
    cost = flight_cost()
    at, step = 2.0, 1e-5
    gradient = float(cost(at)[1])
    difference = (float(cost(at + step)[0]) - float(cost(at - step)[0])) / (2 * step)
    print(f"d(cost)/d(k2) by differentiation      {gradient:.9e}")
    print(f"d(cost)/d(k2) by central differences  {difference:.9e}")
    assert abs(gradient - difference) < 1e-5 * abs(gradient)
