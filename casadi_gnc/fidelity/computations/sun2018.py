"""Numbers of Sun and Zheng (2018), doi:10.1109/TCST.2017.2669145, that no flight answers alone."""

from __future__ import annotations

import json
import math
from functools import cache
from types import SimpleNamespace
from typing import Any

import casadi as ca
import numpy as np
from scipy.special import erfinv

import casadi_gnc
from casadi_gnc.checks import Check
from casadi_gnc.errors import FlightError
from casadi_gnc.fidelity.computations.conditions import condition_of
from casadi_gnc.laws.proximity_conditions import coupling_condition
from casadi_gnc.mathematics.noise import normals, uniform_count, uniforms
from casadi_gnc.missions.flight import Flight
from casadi_gnc.missions.metrics import settled
from casadi_gnc.missions.mission import Mission

_PRINTED, _COMPARISON = "sun2018/as_printed", "sun2018/without_observer"
#: The last minute of the flights [s]: the paper's "steady state".
_LATE = 190.0


@cache
def _mission() -> Mission:
    return casadi_gnc.load(_PRINTED)


def _plant() -> Any:
    return _mission().truth


def _law() -> Any:
    return _mission().scheme("tracking").law


@cache
def _target() -> SimpleNamespace:
    """Return the target's position, velocity and rate at t = 0, which the printed data imply, (3,) each."""
    target = _plant().target(ca.DM(_mission().start))
    return SimpleNamespace(**{name: np.array(part).ravel() for name, part in vars(target).items()})


# The orbit.


def _eccentricity(position: np.ndarray, velocity: np.ndarray) -> float:
    mu = _plant().motion.gravitational_parameter
    lean = np.cross(velocity, np.cross(position, velocity)) / mu - position / np.linalg.norm(position)
    return float(np.linalg.norm(lean))


def eccentricity() -> float:
    """Return the eccentricity of the target's orbit."""
    return _eccentricity(_target().position, _target().velocity)


def eccentricity_bound() -> float:
    """Return what the eccentricity is at least, whatever the exponent of r(0) and the Earth's pull.

    e^2 = (r v^2/mu - 1)^2 cos^2 + sin^2 of the flight-path angle, which neither changes.
    """
    r, v = _target().position, _target().velocity
    return float(abs(r @ v) / np.linalg.norm(r) / np.linalg.norm(v))


def escape_ratio() -> float:
    """Return the target's speed over that of escape."""
    r, v = (float(np.linalg.norm(part)) for part in (_target().position, _target().velocity))
    return v / math.sqrt(2 * _plant().motion.gravitational_parameter / r)


def perigee(exponent: int) -> float:
    """Return the chaser's perigee radius with r(0) = [1, 1, 1] 7.078e<exponent> m, [m]."""
    state = _plant().state.split(ca.DM(_mission().start))
    r, v = 7.078 * 10.0**exponent * np.ones(3), np.array(state.velocity).ravel()
    momentum = np.cross(r, v)
    return float(momentum @ momentum / _plant().motion.gravitational_parameter / (1 + _eccentricity(r, v)))


def _orbit_rate() -> float:
    """Return omega_o of the chaser at t = 0, [rad/s]."""
    return math.sqrt(float(_plant().motion.pull(_plant().state.split(ca.DM(_mission().start)).position)))


def turn_ratio() -> float:
    """Return the rate of the line from the target to the point to hold, over the orbital rate."""
    arm, rate = np.array(_plant().motion.hold_point), _target().rate
    return float(np.linalg.norm(np.cross(rate, arm)) / np.linalg.norm(arm)) / _orbit_rate()


def disturbance_phase(duration_s: float) -> float:
    """Return omega_o t of the disturbance's sines at a time, [rad]."""
    return _orbit_rate() * duration_s


# Theorem 2.


def condition(name: str) -> float:
    """Return the left side of a condition (27), by its check."""
    return condition_of(_law(), name).value


def pole_ratio() -> float:
    """Return min Gamma over max Lambda, which Remark 2 asks to exceed 1."""
    law = _law()
    return float(law.observer_gain) / max(float(law.position_slope), float(law.attitude_slope))


def _coupling() -> Check:
    return coupling_condition(_law(), _plant().motion, _plant().target_inertia, _target().rate)


def _rotation_energy() -> float:
    """Return omega_t' J_t omega_t, twice the energy, [J]."""
    return float(_target().rate @ np.array(_plant().target_inertia) @ _target().rate)


def coupling_ratio() -> float:
    """Return left over right side of (28), alpha_1 from the energy of rotation."""
    return _coupling().value / _coupling().limit


def coupling_ratio_bound() -> float:
    """Return left over right side of (28) with alpha_1 = |omega_t(0)|, which no bound on the rate goes below."""
    rate, slowest = _target().rate, np.linalg.eigvalsh(np.array(_plant().target_inertia))[0]
    return coupling_ratio() * (_rotation_energy() / slowest / float(rate @ rate)) ** 2


def coupling_ratio_of_energy(target_mass_kg: float) -> float:
    """Return left over right side of (28) with alpha_1 from the printed E(0), the orbit's energy in it."""
    r, v = _target().position, _target().velocity
    pull = _plant().motion.gravitational_parameter / np.linalg.norm(r)
    energy = target_mass_kg * (pull + v @ v) + _rotation_energy()
    return coupling_ratio() * (_rotation_energy() / float(energy)) ** 2


def ultimate_bound(share: float) -> float:
    """Return the theorem's bound (d b/(a c))^(1/2) on the error with kappa_1, u_Delta and delta_a zero.

    Parameters
    ----------
    share : of the a before (28) that decays: 1/2 in (29), 1 before it.

    The rate of the lumped disturbance is that of the noise-free flight in the last minute.
    """
    law, gain = _law(), float(_law().observer_gain)
    slope = max(float(law.position_slope), float(law.attitude_slope))
    a = _coupling().value * (1 + slope) ** 2 / (2 * gain)
    b = _disturbance_rate() ** 2 / (2 * gain)
    inertias = [float(law.body.mass), *np.linalg.eigvalsh(np.array(law.body.body.inertia))]  # of M_0
    c, d = min(1.0, *inertias) / 2, max(1.0, *inertias) / 2
    return math.sqrt(d * b / (share * a * c))


# Flights.


@cache
def _flown(problem: str, scheme: str, changes: str = "{}") -> tuple[Mission, Flight]:
    mission = casadi_gnc.load(problem, json.loads(changes))
    return mission, casadi_gnc.fly(mission, scheme, decimation=1)


def _compared(scheme: str) -> Flight:
    return _flown(_COMPARISON, scheme)[1]


def _sizes(flight: Flight, signal: str, after_s: float = 0.0) -> np.ndarray:
    """Return 2-norms of a signal from a time on."""
    return np.linalg.norm(flight.block(signal)[flight.time >= after_s], axis=1)


def settling_ratio(scheme: str, over: str, signal: str, threshold: float) -> float:
    """Return the settling time with one scheme of the comparison over that with another; 0 if that is never."""
    flights = [_compared(name) for name in (scheme, over)]
    one, other = (settled(flight.time, _sizes(flight, signal), threshold) for flight in flights)
    if one is None:
        raise FlightError(f"with {scheme} the {signal} does not settle below {threshold:g}")
    return 0.0 if other is None else one / other


def steady_ratio(scheme: str, over: str, signal: str) -> float:
    """Return the mean 2-norm of the last minute with one scheme of the comparison over that with another."""
    one, other = (float(_sizes(_compared(name), signal, _LATE).mean()) for name in (scheme, over))
    return one / other


def effort_ratio(scheme: str, over: str, effort: str, measure: str) -> float:
    """Return what one scheme of the comparison spends over what another does.

    Parameters
    ----------
    effort : "force" or "torque".
    measure : "impulse", the sum of magnitudes over axes and time, or "peak", the largest magnitude.
    """
    spent = [np.abs(_compared(name)[f"achieved_{effort}"]) for name in (scheme, over)]
    one, other = (float(part.sum() if measure == "impulse" else part.max()) for part in spent)
    return one / other


def _lumped() -> tuple[np.ndarray, np.ndarray]:
    """Return w of (16) along the printed flight, (K, 6), [N] and [N m], and the error of its estimate."""
    flight, plant, law = _flown(_PRINTED, "tracking")[1], _plant(), _law()
    t, x, u = ca.SX.sym("t"), plant.state.symbol("x"), plant.inputs.symbol("u")
    now = law.inputs.split(plant.measure(t, x, ca.DM.zeros(0)))
    slide_rate = ca.jtimes(ca.SX(law.slide(now)), x, plant.rate(t, x, u, ca.DM.zeros(0)))
    lumped = ca.Function("w", [t, x, u], [law.body.impulse(slide_rate) - law.known(now) - u])
    states = np.hstack([flight.block(name) for name in plant.state.names])
    efforts = np.hstack([flight["force"], flight["torque"]])
    found = np.array(lumped(flight.time[None, :], states.T, efforts.T)).T
    return found, found - np.hstack([flight["force_estimate"], flight["torque_estimate"]])


def _disturbance_rate() -> float:
    """Return the largest |w'| in the last minute, [N/s] and [N m/s]."""
    flight = _flown(_PRINTED, "tracking")[1]
    late = _lumped()[0][flight.time >= _LATE]
    return float(np.linalg.norm(np.diff(late, axis=0), axis=1).max()) / _mission().timing.sample_period


def estimate_error_share(effort: str) -> float:
    """Return the largest error of the estimated disturbance in the last minute over that at the start."""
    places = slice(0, 3) if effort == "force" else slice(3, 6)
    error = np.linalg.norm(_lumped()[1][:, places], axis=1)
    return float(error[_flown(_PRINTED, "tracking")[1].time >= _LATE].max() / error[0])


def compensator_share(effort: str) -> float:
    """Return the largest state of the saturation compensator in the last minute over the largest of all."""
    flight = _flown(_PRINTED, "tracking")[1]
    return float(_sizes(flight, f"missing_{effort}", _LATE).max() / _sizes(flight, f"missing_{effort}").max())


# Noise.


def _noisy(position_m: float, attitude: float) -> str:
    return json.dumps(
        {
            "sensors": {"position_deviation_m": position_m, "attitude_deviation": attitude},
            "noise": {"seed": 1, "truncation_sigma": 3.0},
            "environment.random_force_N": 0.5,
            "environment.random_torque_N_m": 0.25,
        }
    )


def measured_error(position_m: float, attitude: float) -> float:
    """Return the largest measured |e_1| of the last minute, sensors with these standard deviations."""
    mission, flight = _flown(_PRINTED, "tracking", _noisy(position_m, attitude))
    plant, noise = mission.truth, mission.noise
    late = np.flatnonzero(flight.time >= _LATE)
    count = plant.noise.size
    t, x, drawn = ca.SX.sym("t"), plant.state.symbol("x"), ca.SX.sym("drawn", uniform_count(count))
    read = plant.measure(t, x, normals(drawn, count, noise.truncation))
    sense = ca.Function("sense", [t, x, drawn], [read[:6]])
    states = np.hstack([flight.block(name) for name in plant.state.names])[late]
    numbers = np.array([uniforms(noise.seed, int(k) // noise.every, uniform_count(count)) for k in late])
    return float(np.linalg.norm(np.array(sense(flight.time[late][None, :], states.T, numbers.T)), axis=0).max())


def measured_error_bound(position_m: float, samples: int, probability: float) -> float:
    """Return a level that the measured |e_1| stays below for so many samples with at most a probability.

    Independent normal noise of one axis, cut at three deviations, on an error that does not foresee it:
    the level is passed least often where the error is zero (Anderson 1955, doi:10.2307/2032333), so
    it holds for every controller.
    """
    inside = probability ** (1 / samples)
    return position_m * min(3.0, math.sqrt(2) * float(erfinv(inside)))
