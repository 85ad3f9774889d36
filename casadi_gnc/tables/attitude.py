"""Where a craft that turns begins."""

from __future__ import annotations

from casadi_gnc.tables.part import Part, Vector


class AttitudeStart(Part):
    """State at t = 0."""

    mrp: Vector
    rate_rad_per_s: Vector

    def state(self) -> dict[str, list[float]]:
        """Return the start by signal."""
        return {"mrp": self.mrp, "rate": self.rate_rad_per_s}
