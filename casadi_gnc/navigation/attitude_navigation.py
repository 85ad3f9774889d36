"""Attitude as laws read it: that of the body as seen from the reference, by whatever knows both.

==========  ==============================================================================================
symbol      meaning
==========  ==============================================================================================
q, w        attitude of the body from inertial, and its rate, body axes: measured or estimated
q_r, w_r    the same of the reference, w_r and w_r' in the reference's axes (`Reference.at`)
q_e, C_e    (c_e, v_e), attitude of the body from the reference, C(q_e) = C(q) C(q_r)', taken the short way round
==========  ==============================================================================================

    mrp = v_e/(1 + c_e),    rate = w - C_e w_r,    reference_rate = C_e w_r,    reference_acceleration = C_e w_r'
"""

from __future__ import annotations

from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import casadi as ca

from casadi_gnc.mechanics import quaternions
from casadi_gnc.navigation._navigation import Estimator, Navigation, Reference
from casadi_gnc.signals import Layout, Signal
from casadi_gnc.status import StepStatus

FRAME = "body"
_ATTITUDE = Layout((Signal("mrp", 3, "-", FRAME), Signal("rate", 3, "rad/s", FRAME)))
_SEEN = (
    Signal("mrp", 3, "-", FRAME, kind="mrp"),
    Signal("rate", 3, "rad/s", FRAME, kind="rate"),
    Signal("quaternion", 4, "-"),
    Signal("body_rate", 3, "rad/s", FRAME),
    Signal("reference_rate", 3, "rad/s", FRAME),
    Signal("reference_acceleration", 3, "rad/s^2", FRAME),
)


@dataclass(frozen=True, eq=False)
class AttitudeNavigation(Navigation):
    """Give laws the attitude and the rate relative to a reference, and what else is measured as it is.

    Parameters
    ----------
    estimator : of attitude and rate; without one they are measured, as `mrp` and `rate`.
    reference : what should be pointed where.
    passed : further measured signals that laws may read as they are.
    """

    estimator: Estimator | None = None
    reference: Reference = field(default_factory=Reference)
    passed: Layout = field(default_factory=Layout)

    @property
    def inputs(self) -> Layout:  # type: ignore[override]
        """What the estimator, the reference and laws read of the measurement."""
        first = _ATTITUDE if self.estimator is None else self.estimator.inputs
        signals = (*first.signals, *self.reference.reads.signals, *self.passed.signals)
        return Layout(tuple({signal.name: signal for signal in signals}.values()))

    @property
    def signals(self) -> Layout:  # type: ignore[override]
        """Attitude and rates, and what is passed on."""
        return Layout(_SEEN) + Layout(tuple(one for one in self.passed.signals if one.name not in ("mrp", "rate")))

    @property
    def memory(self) -> Layout:  # type: ignore[override]
        """The estimator's."""
        return Layout() if self.estimator is None else self.estimator.memory

    @property
    def outputs(self) -> Layout:  # type: ignore[override]
        """The estimator's."""
        return Layout() if self.estimator is None else self.estimator.outputs

    @property
    def changed(self) -> tuple[str, ...]:
        """Attitude and rate, which are measured from inertial."""
        return () if self.reference.is_inertial else ("mrp", "rate")

    def start(self, t: Any, y: Any) -> Any:
        """Return the estimator's memory."""
        return ca.DM.zeros(0, 1) if self.estimator is None else self.estimator.start(t, self._read(y))

    def jump(self, t: Any, y: Any, m: Any) -> Any:
        """Return the estimator's memory at this sample."""
        return m if self.estimator is None else self.estimator.jump(t, self._read(y), m, self.hold)

    def _read(self, y: Any) -> Any:
        """Return what the estimator reads, in its order."""
        assert self.estimator is not None
        now = self.inputs.split(y)
        return ca.vertcat(*(getattr(now, name) for name in self.estimator.inputs.names))

    def _attitude(self, t: Any, y: Any, m: Any) -> SimpleNamespace:
        if self.estimator is not None:
            return self.estimator.estimate(t, self._read(y), m)
        now = self.inputs.split(y)
        return SimpleNamespace(quaternion=quaternions.from_mrp(now.mrp), rate=now.rate)

    def seen(self, t: Any, y: Any, m: Any) -> Any:
        """Return what laws read."""
        now, own = self.inputs.split(y), self._attitude(t, y, m)
        wanted = self.reference.at(t, now)
        error = quaternions.short_way(quaternions.relative(own.quaternion, ca.SX(wanted.quaternion)))
        turn = quaternions.dcm(error)
        moving = ca.mtimes(turn, ca.SX(wanted.rate))
        told = {
            "mrp": quaternions.to_mrp(error),
            "rate": own.rate - moving,
            "quaternion": error,
            "body_rate": own.rate,
            "reference_rate": moving,
            "reference_acceleration": ca.mtimes(turn, ca.SX(wanted.acceleration)),
        }
        rest = {name: getattr(now, name) for name in self.signals.names if name not in told}
        return self.signals.pack(**told, **rest)

    def status(self, t: Any, y: Any, m: Any) -> dict[StepStatus, Any]:
        """Return the estimator's flags."""
        return {} if self.estimator is None else self.estimator.status(t, self._read(y), m)

    def show(self, t: Any, y: Any, m: Any) -> dict[str, Any]:
        """Return what the estimator shows."""
        return {} if self.estimator is None else self.estimator.show(t, self._read(y), m)
