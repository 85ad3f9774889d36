"""Electromagnetic docking pair: chaser and target, three coils on each, on an elliptic orbit.

==========  ==============================================================================
symbol      meaning
==========  ==============================================================================
eta         position [m] and velocity [m/s] of the chaser from the target, orbit frame
theta       true anomaly of the pair's centre of mass (CM), [rad]
r_C, r_T    chaser and target from the CM, (3,), [m]: m_C r_C = -m_T r_T, eta = r_C - r_T
m_CT        reduced mass m_C m_T/(m_C + m_T), [kg]
u           force on the chaser, (3,), [N]; the target feels -u
d           (m_T w_C - m_C w_T)/(m_C + m_T) of the outer forces w_C, w_T, (3,), [N]
f           fault, (3,), [N], that acts as f/m0 on the relative acceleration (E = B(m0))
w           lumped disturbance: what must be added to u in the model of mass m0, (3,), [N]
v(t)        error of the measurement, (3,) [m] and (3,) [m/s]
==========  ==============================================================================

    eta'' = orbital terms of (5) + (u + d)/m_CT + f/m0
    w = m0 (eta'' - orbital terms of the model) - u                                 (9), (12)

The actuator is either the chaser's moment, from which (6) makes u at the true separation, or u
itself, as the paper simulates it: then `moment` is the one that (8) gives for it afterwards.

Source: Shi, Liu, Biggs, Sun, Yue (2020), section 2, doi:10.1016/j.ast.2020.105759. The true
anomaly is a state; (2) needs the opposite sign of F_eTx, and of the linearised and the exact
gravity that (1) and (2) mix only the linearised one, as in (5), is used.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import casadi as ca

from casadi_gnc.mathematics.exact import array, is_zero
from casadi_gnc.mechanics import dipoles
from casadi_gnc.mechanics.dipoles import TargetDipole
from casadi_gnc.mechanics.disturbances import Harmonics
from casadi_gnc.mechanics.relative_motion import EllipticOrbit, PairModel
from casadi_gnc.missions.plant import Plant
from casadi_gnc.signals import Layout, Signal

FRAME = "orbit"


@dataclass(frozen=True)
class FaultPiece:
    """Describe a fault's share constant + amplitude sin(rate t + phase) for start < t <= stop.

    Parameters
    ----------
    start, stop : [s].
    constant, amplitude : [-].
    rate, phase : [rad/s] and [rad].
    """

    start: float
    stop: float
    constant: float = 0.0
    amplitude: float = 0.0
    rate: float = 0.0
    phase: float = 0.0


@dataclass(frozen=True)
class FaultProfile:
    """Scale a force by a share that is given piece by piece and zero elsewhere (Table 1).

    Parameters
    ----------
    force : (3,), [N].
    pieces : in any order, not overlapping.
    """

    force: tuple[float, ...] = (0.0, 0.0, 0.0)
    pieces: tuple[FaultPiece, ...] = ()

    def at(self, t: Any) -> Any:
        """Return f(t), (3,), [N]."""
        share: Any = 0.0
        for piece in self.pieces:
            value = piece.constant + piece.amplitude * ca.sin(piece.rate * t + piece.phase)
            share = ca.if_else(ca.logic_and(t > piece.start, t <= piece.stop), value, share)
        return array(self.force) * share


@dataclass(frozen=True)
class MeasurementNoise:
    """Hold the standard deviations of white noise on position [m] and velocity [m/s]."""

    position: float = 0.0
    velocity: float = 0.0


@dataclass(frozen=True, eq=False)
class DockingPair(Plant):
    """Simulate the pair.

    Parameters
    ----------
    chaser_mass, target_mass : m_C, m_T, [kg].
    orbit : orbit of the CM.
    target : moment of the target.
    model : what the flight software believes; `lumped_disturbance` is counted from it, its mass
        scales the fault, and `miss` is the way from its port.
    actuator : "moment" [A m^2] or "force" [N].
    on_chaser, on_target : outer forces w_C and w_T, [N].
    fault : f(t).
    position_error, velocity_error : v(t), [m] and [m/s].
    white : noise on top of them.
    reach, speed_limit : largest position [m] and velocity [m/s] per axis that can be true.
    """

    chaser_mass: float
    target_mass: float
    orbit: EllipticOrbit
    target: TargetDipole
    model: PairModel
    actuator: Literal["moment", "force"] = "moment"
    on_chaser: Harmonics = Harmonics()
    on_target: Harmonics = Harmonics()
    fault: FaultProfile = FaultProfile()
    position_error: Harmonics = Harmonics()
    velocity_error: Harmonics = Harmonics()
    white: MeasurementNoise = MeasurementNoise()
    reach: float = 1e6
    speed_limit: float = 1e3

    @property
    def state(self) -> Layout:
        """Relative position and velocity, and the true anomaly."""
        return Layout((*self.measurement.signals, Signal("anomaly", 1, "rad")))

    @property
    def measurement(self) -> Layout:
        """Relative position and velocity, each with the largest magnitude that can be true."""
        return Layout(
            (
                Signal("position", 3, "m", FRAME, limit=self.reach),
                Signal("velocity", 3, "m/s", FRAME, limit=self.speed_limit),
            )
        )

    @property
    def inputs(self) -> Layout:
        """Moment of the chaser, or the force on it."""
        return Layout((self._moment if self.actuator == "moment" else self._force,))

    @property
    def noise(self) -> Layout:
        """White noise of the two measured signals, where there is any."""
        quiet = is_zero(self.white.position) and is_zero(self.white.velocity)
        return Layout() if quiet else self.measurement

    @property
    def outputs(self) -> Layout:
        """Where both craft are, what they do to each other, and what the model leaves out."""
        return Layout(
            (
                self._force if self.actuator == "moment" else self._moment,
                Signal("miss", 3, "m", FRAME),
                Signal("chaser_position", 3, "m", FRAME),
                Signal("target_position", 3, "m", FRAME),
                Signal("distance", 1, "m"),
                Signal("alignment", 1, "-"),
                Signal("chaser_torque", 3, "N m", FRAME),
                Signal("target_torque", 3, "N m", FRAME),
                Signal("lumped_disturbance", 3, "N", FRAME),
            )
        )

    _moment = Signal("moment", 3, "A m^2", FRAME)
    _force = Signal("force", 3, "N", FRAME)

    @property
    def reduced_mass(self) -> float:
        """m_CT, [kg]."""
        return self.chaser_mass * self.target_mass / (self.chaser_mass + self.target_mass)

    def measure(self, t: Any, x: Any, noise: Any) -> Any:
        """Return relative position and velocity with their errors."""
        now = self.state.split(x)
        position, velocity = now.position + self.position_error.at(t), now.velocity + self.velocity_error.at(t)
        if self.noise.size:
            drawn = self.noise.split(noise)
            position = position + self.white.position * drawn.position
            velocity = velocity + self.white.velocity * drawn.velocity
        return ca.vertcat(position, velocity)

    def efforts(self, x: Any, actuators: Any) -> tuple[Any, Any]:
        """Return the chaser's moment, (3,), [A m^2], and the force on it, (3,), [N]."""
        separation = self.state.split(x).position
        moment_t = self.target.at(separation)
        if self.actuator == "moment":
            return actuators, dipoles.force(separation, actuators, moment_t)
        return dipoles.moment_for(actuators, separation, moment_t), actuators

    def disturbance(self, t: Any) -> Any:
        """Return d(t), (3,), [N], of the outer forces."""
        chaser, target = self.on_chaser.at(t), self.on_target.at(t)
        return (self.target_mass * chaser - self.chaser_mass * target) / (self.chaser_mass + self.target_mass)

    def acceleration(self, t: Any, x: Any, force: Any) -> Any:
        """Return eta'', (3,), [m/s^2], under a force [N] on the chaser (eq. 5)."""
        now = self.state.split(x)
        free = self.orbit.acceleration(now.anomaly, now.position, now.velocity)
        return free + (force + self.disturbance(t)) / self.reduced_mass + self.fault.at(t) / self.model.mass

    def rate(self, t: Any, x: Any, actuators: Any, noise: Any) -> Any:
        """Return x'."""
        now = self.state.split(x)
        _, force = self.efforts(x, actuators)
        return self.state.pack(
            position=now.velocity,
            velocity=self.acceleration(t, x, force),
            anomaly=self.orbit.rate(now.anomaly),
        )

    def show(self, t: Any, x: Any, actuators: Any) -> dict[str, Any]:
        """Return the signals of `outputs`."""
        now, total = self.state.split(x), self.chaser_mass + self.target_mass
        moment, force = self.efforts(x, actuators)
        moment_t = self.target.at(now.position)
        on_chaser, on_target = dipoles.torques(now.position, moment, moment_t)
        beyond = self.acceleration(t, x, force) - self.model.acceleration(now.position, now.velocity)
        shown = {
            "moment": moment,
            "force": force,
            "miss": -self.model.ahead(now.position),
            "chaser_position": self.target_mass / total * now.position,
            "target_position": -self.chaser_mass / total * now.position,
            "distance": dipoles.length(now.position),
            "alignment": dipoles.alignment(now.position, moment_t),
            "chaser_torque": on_chaser,
            "target_torque": on_target,
            "lumped_disturbance": self.model.mass * beyond - force,
        }
        return {name: shown[name] for name in self.outputs.names}
