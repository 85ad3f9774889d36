"""A satellite: a rigid body, what it carries, and what acts on it from outside.

==========  ====================================================================================
symbol      meaning
==========  ====================================================================================
sigma       attitude MRPs of the body from the inertial frame, (3,)
w           rate, (3,), [rad/s], body axes
r, v        position [m] and velocity [m/s] of the centre of mass, inertial, where there is an orbit
C           direction cosines, inertial -> body
J_c         inertia of the whole about its centre of mass, (3, 3), [kg m^2]
==========  ====================================================================================

    sigma' = G(sigma) w,    r' = v,    v' = gravity(r) + C' F/m
    w' and the parts by `casadi_gnc.mechanics.multibody`, under 3 mu/|r|^5 (C r) x J_c (C r) + d(t)

The sensors say what is true, or what `sensors` make of it.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from types import SimpleNamespace
from typing import Any

import casadi as ca

from casadi_gnc.errors import FlightError
from casadi_gnc.mechanics import attitude, quaternions
from casadi_gnc.mechanics.disturbances import Harmonics
from casadi_gnc.mechanics.multibody import Assembly
from casadi_gnc.missions.plant import Plant
from casadi_gnc.navigation import Reference
from casadi_gnc.signals import Layout, Signal
from casadi_gnc.status import StepStatus

from .surroundings import Surroundings

FRAME = "body"
#: Largest component of a position [m] and a velocity [m/s] that is credible: twice the moon's distance.
FARTHEST, FASTEST = 8e8, 2e4
#: Largest magnetic field that is credible, [T]; the Earth's is below 7e-5.
STRONGEST = 1e-3
_DEGREE = 57.29577951308232


@dataclass(frozen=True, eq=False)
class Satellite(Plant):
    """Simulate a satellite.

    Parameters
    ----------
    assembly : body and parts.
    surroundings : what is outside: gravity, magnetic field.
    disturbance : torque d(t), body axes.
    rate_limit : rate [rad/s] per axis beyond which a measured rate cannot be true.
    sensors : what measures; without sensors all is told exactly.
    estimated : whether attitude and rate are estimated from sensors, and are not measured themselves.
    reference : where the satellite should point, for the records.
    """

    assembly: Assembly
    surroundings: Surroundings = Surroundings()
    disturbance: Harmonics = Harmonics()
    rate_limit: float = 10.0
    sensors: tuple[Any, ...] = ()
    estimated: bool = False
    reference: Reference = field(default_factory=Reference)

    def timed(self, hold: float, step: float) -> Satellite:
        """Return the satellite whose sensors and parts know the sample period [s] and the integrator's step.

        Raises
        ------
        FlightError
            For sensors or pulses without samples.
        """
        if self.sensors and not hold:
            raise FlightError(f"{self.sensors[0].name} is a sensor that is sampled; fly in mode sampled")
        parts = tuple(part.timed(hold, step) for part in self.assembly.components)
        sensors = tuple(replace(sensor, hold=hold) for sensor in self.sensors)
        return replace(self, assembly=replace(self.assembly, components=parts), sensors=sensors)

    def averaged(self) -> Satellite:
        """Return the satellite whose parts do at once what they are told."""
        parts = tuple(part.averaged() for part in self.assembly.components)
        return replace(self, assembly=replace(self.assembly, components=parts))

    @cached_property
    def state(self) -> Layout:
        """Attitude, rate, the parts' states, the orbit's, the sensors', and what sensors that are late remember."""
        return self._own + past(self._own, self.sensors)

    @cached_property
    def _own(self) -> Layout:
        own = (Signal("mrp", 3, "-", FRAME, kind="mrp"), Signal("rate", 3, "rad/s", FRAME, kind="rate"))
        return Layout(
            (*own, *self.assembly.state.signals, *self.surroundings.state.signals, *self._of_sensors("state"))
        )

    @cached_property
    def _exact(self) -> Layout:
        """What would be measured without any sensor."""
        attitude_limits = (
            Signal("mrp", 3, "-", FRAME, limit=2.0, kind="mrp"),
            Signal("rate", 3, "rad/s", FRAME, limit=self.rate_limit, kind="rate"),
        )
        parts = tuple(signal for part in self.assembly.components for signal in part.measured.signals)
        orbit = (Signal("position", 3, "m", limit=FARTHEST), Signal("velocity", 3, "m/s", limit=FASTEST))
        magnetic = (Signal("magnetic_field", 3, "T", FRAME, limit=STRONGEST),)
        told = (() if self.estimated else attitude_limits) + parts
        told += orbit if self.surroundings.state.size else ()
        return Layout(told + (magnetic if self.surroundings.has_field else ()))

    @cached_property
    def measurement(self) -> Layout:
        """What sensors give, and exactly what no sensor gives."""
        given = self._of_sensors("measured")
        names = {signal.name for signal in given}
        return Layout((*(signal for signal in self._exact.signals if signal.name not in names), *given))

    @cached_property
    def inputs(self) -> Layout:
        """What the parts are told."""
        return self.assembly.inputs

    @cached_property
    def noise(self) -> Layout:
        """Normal numbers of the sensors."""
        return Layout(self._of_sensors("noise"))

    def _of_sensors(self, layout: str) -> tuple[Signal, ...]:
        return tuple(signal for sensor in self.sensors for signal in getattr(sensor, layout).signals)

    @property
    def outputs(self) -> Layout:
        """The angle from the reference, and the angular momentum of the whole."""
        momentum = Signal("momentum", 3, "N m s", FRAME)
        return Layout((Signal("pointing_error", 1, "rad"), Signal("pointing_error_deg", 1, "deg"), momentum))

    def inertias(self) -> dict[str, Any]:
        """Return the true inertia of the whole, liquids at rest."""
        rest = {signal.name: ca.DM.zeros(signal.size) for signal in self.assembly.state.signals}
        return {"true": self.assembly.inertia(SimpleNamespace(**rest))}

    def _around(self, t: Any, now: Any) -> SimpleNamespace:
        """Return what the parts and the sensors feel: rate, attitude, field, sun, body axes."""
        return self.surroundings.felt(t, now)

    def measure(self, t: Any, x: Any, noise: Any) -> Any:
        """Return what the sensors say."""
        now = self.state.split(x)
        truth, drawn, told = self._around(t, now), self.noise.split(noise), {}
        for sensor in self.sensors:
            told.update(sensor.measure(t, self._seen(t, now, sensor) if sensor.delay else truth, now, drawn))
        exact = {name: getattr(truth, name) for name in self._exact.names if name not in told}
        return self.measurement.pack(**{name: (told.get(name, exact.get(name))) for name in self.measurement.names})

    def _seen(self, t: Any, now: Any, sensor: Any) -> SimpleNamespace:
        """Return what a sensor that is late looked at."""
        then = dict(vars(now))
        for name in sensor.looks_at:
            size = self._own.signal(name).size
            then[name] = getattr(now, f"{name}_past")[sensor.delay * size : (sensor.delay + 1) * size]
        return self._around(t - sensor.delay * sensor.hold, SimpleNamespace(**then))

    def rate(self, t: Any, x: Any, actuators: Any, noise: Any) -> Any:
        """Return x'."""
        now, told, drawn = self.state.split(x), self.inputs.split(actuators), self.noise.split(noise)
        around = self._around(t, now)
        torque = self.disturbance.at(t) + self.surroundings.torque(now, self.assembly.inertia(now))
        pushed = ca.SX.zeros(3)
        if self.surroundings.plates:
            pushed, turning = self.surroundings.pushed(now, around, self.assembly.centre(now))
            torque = torque + turning
        turned, parts, force = self.assembly.moved(t, now.rate, now, told, torque, around)
        rates = dict(vars(self.assembly.state.split(parts)))
        rates.update(self.surroundings.moved(now, (force + pushed) / self.assembly.mass))
        for sensor in self.sensors:
            rates.update(sensor.rate(t, now, drawn))
        for signal in past(self._own, self.sensors).signals:
            rates[signal.name] = ca.SX.zeros(signal.size)
        return self.state.pack(mrp=attitude.mrp_rate(now.mrp, now.rate), rate=turned, **rates)

    def settle(self, x: Any) -> Any:
        """Return the same physical state in the representation kept between steps (|sigma| <= 1)."""
        now = self.state.split(x)
        moved = {name: value for part in self.assembly.components for name, value in part.settle(now).items()}
        settled = {**vars(now), **moved, "mrp": attitude.short_way(now.mrp)}
        for signal in past(self._own, self.sensors).signals:
            name = signal.name.removesuffix("_past")
            kept = settled[signal.name]
            settled[signal.name] = ca.vertcat(settled[name], kept[: signal.size - self._own.signal(name).size])
        return self.state.pack(**settled)

    def show(self, t: Any, x: Any, actuators: Any) -> dict[str, Any]:
        """Return the pointing error and the momentum."""
        now = self.state.split(x)
        wanted = self.reference.at(t, now)
        error = quaternions.relative(quaternions.from_mrp(now.mrp), ca.SX(wanted.quaternion))
        angle = 2 * ca.atan2(ca.sqrt(ca.sumsqr(error[1:])), ca.fabs(error[0]))
        return {
            "pointing_error": angle,
            "pointing_error_deg": _DEGREE * angle,
            "momentum": self.assembly.momentum(now.rate, now),
        }

    def status(self, t: Any, x: Any, actuators: Any) -> dict[StepStatus, Any]:
        """Return what truly happened to the parts."""
        now, told, flags = self.state.split(x), self.inputs.split(actuators), {}
        for part in self.assembly.components:
            for bit, flag in part.flags(now, told).items():
                flags[bit] = ca.logic_or(flags[bit], flag) if bit in flags else flag
        return flags


def past(own: Layout, sensors: tuple[Any, ...]) -> Layout:
    """Return what sensors that are late look at, now and at the samples before: for each state, the last one first."""
    latest = max((sensor.delay for sensor in sensors), default=0)
    names = {name for sensor in sensors if sensor.delay for name in sensor.looks_at}
    kept = (signal for signal in own.signals if signal.name in names)
    return Layout(tuple(Signal(f"{each.name}_past", each.size * (latest + 1), each.unit) for each in kept))
