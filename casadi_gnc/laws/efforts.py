"""The efforts that laws command and crafts make, in the order in which they are stacked."""

from __future__ import annotations

from casadi_gnc.signals import Layout, Signal

#: Of a craft that only turns.
TORQUE = Layout((Signal("torque", 3, "N m"),))
#: Of a craft that only moves.
FORCE = Layout((Signal("force", 3, "N"),))
#: Of a craft that does both.
FORCE_AND_TORQUE = FORCE + TORQUE
