"""Stop a tumble with magnetic coils and a magnetometer alone: B-dot.

==========  ========================================================  =================
symbol      meaning                                                   name in the code
==========  ========================================================  =================
B           magnetic field, body axes, (3,), [T]                      now.magnetic_field
tau, x      time constant of the filter, its state                    filter_time, memory.field
B'          (B - x)/tau, the field's filtered slope                   slope
k           damping, [N m s]                                          damping_gain
==========  ========================================================  =================

    m = -k B'/|B|^2,    u = m x B

In a field that stands, B' = -w x B and u = -k (w - b b'w) with b = B/|B|: all rates but that along the field are
damped; the field's turn along the orbit reaches that one too. What remains is about twice the orbit's rate. The coils
make u exactly: it is perpendicular to the field.

Source: Stickler and Alfriend (1976), doi:10.2514/3.57089; gain: Avanzini and Giulietti (2012), doi:10.2514/1.53074,
k = 2 n (1 + sin i) J_min for an orbit of rate n and an inclination i from the magnetic equator.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

from casadi_gnc.laws._law import Law, gain
from casadi_gnc.laws.efforts import TORQUE
from casadi_gnc.signals import Layout, Signal

#: Square of a field, [T^2], below which none is made out: a thousandth of the weakest near the Earth.
_NO_FIELD = 1e-16


@dataclass(frozen=True, eq=False)
class BDot(Law):
    """Bring the rate to about twice the orbit's, from the magnetic field's change alone."""

    damping_gain: Any = gain("N m s", "torque per rate across the field", symbol="k", above=0.0)
    filter_time: Any = gain("s", "time constant of the field's slope", symbol="tau", above=0.0, default=5.0)

    effort = TORQUE
    inputs = Layout((Signal("magnetic_field", 3, "T"),))
    memory = Layout((Signal("field", 3, "T"),))

    def start(self, t: Any, y: Any) -> Any:
        """Return the filter at the first field."""
        return self.memory.pack(field=self.inputs.split(y).magnetic_field)

    def slope(self, y: Any, m: Any) -> Any:
        """Return B', (3,), [T/s]."""
        return (self.inputs.split(y).magnetic_field - self.memory.split(m).field) / self.filter_time

    def command(self, t: Any, y: Any, m: Any) -> Any:
        """Return u, (3,), [N m]."""
        field = self.inputs.split(y).magnetic_field
        square = ca.sumsqr(field)
        seen = square > _NO_FIELD
        return -self.damping_gain * ca.cross(self.slope(y, m), field) / ca.if_else(seen, square, 1.0)

    def rate(self, t: Any, y: Any, m: Any, wanted: Any, achieved: Any) -> Any:
        """Return (B - x)/tau."""
        return self.memory.pack(field=self.slope(y, m))
