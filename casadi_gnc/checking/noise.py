"""How much of the actuators goes into measurement noise?"""

from __future__ import annotations

from collections.abc import Iterator

import casadi as ca
import numpy as np

from casadi_gnc.checking.allocation import allocation_slope, pushes_both_ways
from casadi_gnc.checking.linear import command_slope
from casadi_gnc.checks import Check
from casadi_gnc.missions.linear_plant import target_state
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.scheme import Scheme

#: Shares of an effort's limit, as standard deviation, from which noise is a nuisance and a failure.
NUISANCE, DROWNING = 0.3, 1.0


def checks(mission: Mission, scheme: Scheme) -> Iterator[Check]:
    """Yield the share of the effort limits that noise commands, and each funnel's floor against noise."""
    if not mission.truth.noise.size:
        return
    deviations = measurement_deviation(mission)
    for funnel in mission.funnels:
        floor = np.array(ca.DM(funnel.bounds.floor)).ravel()
        noise = deviations[mission.truth.measurement.place(funnel.signal)]
        yield Check(
            f"noise.funnel.{funnel.signal}",
            float((3 * noise / floor).max()),
            1.0,
            "-",
            "fail" if scheme.law.keeps(funnel.signal) else "note",
            "Three deviations of the measurement reach the funnel's wall though the signal stands at zero.",
            "Widen the floor, or take better sensors.",
            "three standard deviations over the floor",
        )
    share = float((command_deviation(mission, scheme) / limits(scheme)).max())
    yield Check(
        "noise.authority",
        share,
        NUISANCE,
        "-",
        "note" if np.isnan(share) else "fail" if share >= DROWNING else "warn",
        "Noise alone commands this share of the limit (one standard deviation); clipped, it turns into drift.",
        "Lower the gain from measurement to command, filter the measurement, or take better sensors.",
        "direct gain of the command at the target times the noise's deviations, over the limits",
    )
    if np.isfinite(share):
        yield from _actuators(mission, scheme)


def _actuators(mission: Mission, scheme: Scheme) -> Iterator[Check]:
    """Yield the share of the actuators' bounds that noise takes, through the allocation and by which measurement."""
    actuation = scheme.actuation
    if not pushes_both_ways(scheme) or actuation.inverse is not None:
        return
    slope, _ = command_slope(mission, scheme)
    gain = np.abs(allocation_slope(mission, scheme) @ slope @ measurement_slope(mission))
    bounds = np.minimum(np.abs(np.array(actuation.lower)), np.abs(np.array(actuation.upper)))
    shares = np.sqrt((gain**2).sum(axis=1)) / bounds
    worst, layout = int(shares.argmax()), mission.truth.measurement
    by = np.abs(allocation_slope(mission, scheme) @ slope)[worst] * measurement_deviation(mission)
    loudest = max(layout.names, key=lambda name: float(np.linalg.norm(by[layout.place(name)])))
    yield Check(
        "noise.actuators",
        float(shares[worst]),
        NUISANCE,
        "-",
        "warn",
        f"Noise alone commands this share of what actuator {worst + 1} can do, most of it from {loudest}.",
        f"Lower the gain from {loudest} to command, filter it, or take a better sensor.",
        "direct gain from measurement to actuators at the target times the noise's deviations, over their bounds",
    )


def limits(scheme: Scheme) -> np.ndarray:
    """Return the smaller limit of each effort, (R,); infinite where nothing may be asked for, so no share counts."""
    below, above = (np.abs(np.array(each)) for each in (scheme.actuation.limit_below, scheme.actuation.limit_above))
    least = np.minimum(below, above)
    return np.where(least > 0, least, np.inf)


def measurement_slope(mission: Mission) -> np.ndarray:
    """Return d(measurement)/d(noise) at the target."""
    plant = mission.truth
    noise = plant.noise.symbol("noise")
    y = ca.SX(plant.measure(0.0, ca.DM(target_state(mission)), noise))
    return np.array(ca.DM(ca.substitute(ca.jacobian(y, noise), noise, 0)).full())


def measurement_deviation(mission: Mission) -> np.ndarray:
    """Return the standard deviation of every measured element at the target."""
    return np.sqrt((measurement_slope(mission) ** 2).sum(axis=1))


def command_deviation(mission: Mission, scheme: Scheme) -> np.ndarray:
    """Return the standard deviation of the command at the target by direct feed-through, (R,)."""
    slope, _ = command_slope(mission, scheme)
    return np.sqrt(((slope @ measurement_slope(mission)) ** 2).sum(axis=1))
