"""Numbers of Shi, Liu, Biggs, Sun, Yue (2020), doi:10.1016/j.ast.2020.105759, that its docking's flight gives.

They are of the flight as printed, section 4.B, beyond what a metric tells: estimates, utilisation of the limit, and the
Lyapunov function (27) along it.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from scipy.integrate import trapezoid

import casadi_gnc
from casadi_gnc.errors import FlightError
from casadi_gnc.fidelity.computations.shi2020_data import DOCKING, printed_matrices, problem_data
from casadi_gnc.missions.flight import Flight
from casadi_gnc.missions.metrics import settled


@cache
def _flown(scheme: str) -> Flight:
    return casadi_gnc.fly(casadi_gnc.load(DOCKING), scheme, engine="vm")


def _error(signal: str) -> tuple[np.ndarray, np.ndarray]:
    """Return times [s] and the error of the estimate of a signal, (N, 3)."""
    flight = _flown("iobc")
    true = "lumped_disturbance" if signal == "disturbance" else signal
    return flight.time, flight[true] - flight[f"{signal}_estimate"]


def estimate_settling(signal: str, threshold: float) -> float:
    """Return the time, [s], after which the norm of an estimate's error stays below a threshold."""
    time, error = _error(signal)
    found = settled(time, np.linalg.norm(error, axis=1), threshold)
    if found is None:
        raise FlightError(f"the error of the {signal} does not settle below {threshold:g}")
    return found


def disturbance_error(after_s: float) -> float:
    """Return the largest norm of w - w_hat after a time, [N]."""
    time, error = _error("disturbance")
    return float(np.linalg.norm(error[time > after_s], axis=1).max())


def utilisation(scheme: str) -> float:
    """Return the integral of |u|/30 N over the flight, [s]."""
    flight = _flown(scheme)
    return float(trapezoid(np.linalg.norm(flight["limited"], axis=1), flight.time) / problem_data()["limit"])


def mean_utilisation(scheme: str) -> float:
    """Return the time mean of |u|/30 N, in percent."""
    return 100 * utilisation(scheme) / float(_flown(scheme).time[-1])


def distance_ratio() -> float:
    """Return the least ratio of the chaser's to the target's distance from their centre of mass."""
    flight = _flown("iobc")
    chaser, target = (np.linalg.norm(flight[f"{name}_position"], axis=1) for name in ("chaser", "target"))
    return float(np.min(chaser / target))


def overshoot() -> float:
    """Return by how much the chaser passes the target along an axis, [m]."""
    return float(-(_flown("iobc")["position"] * np.sign(_flown("iobc")["position"][0])).min())


def _intermediate() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return eta - eta_hat, (N, 6), xi, (N, 3), and xi - xi_hat, (N, 3), of (13) and (18)."""
    flight, data = _flown("iobc"), problem_data()
    eta_error = np.hstack([_error("position")[1], _error("velocity")[1]])
    eta = np.hstack([flight["position"], flight["velocity"]])
    through = data["varpi"] * data["B"]
    return eta_error, flight["lumped_disturbance"] - eta @ through, _error("disturbance")[1] - eta_error @ through


def intermediate_peak() -> float:
    """Return the largest norm of xi = w - varpi B'eta, [N]."""
    return float(np.linalg.norm(_intermediate()[1], axis=1).max())


def lyapunov_peak() -> float:
    """Return the largest V of (27), with the printed X1 and X3."""
    flight = _flown("iobc")
    eta_error, _, xi_error = _intermediate()
    eta = np.hstack([flight["position"], flight["velocity"]])
    P1, P3 = (np.linalg.inv(printed_matrices()[name]) for name in ("X1", "X3"))
    terms = ((eta, P1), (eta_error, P1), (xi_error, P3))
    return float(np.max(sum(np.einsum("ti,ij,tj->t", e, P, e) for e, P in terms)))
