"""The shipped missions, and numbers of each that differ from flight to flight."""

from __future__ import annotations

import casadi_gnc
from casadi_gnc.problem_files import read

#: Missions with what varies, sampled and continuous, with noise and without, each kind of allocation.
FLOWN = {
    "huang2020/detumble": ("observer_pinv", ["truth.inertia_factor", "initial.*"]),
    "huang2020/slew": ("funnel_robust", ["truth.inertia_factor", "initial.rate_rad_per_s"]),
    "huang2019/wheel_faults": (None, ["fault.1.effectiveness", "initial.rate_rad_per_s"]),
    "shi2020/docking": ("iobc", ["spacecraft.target_mass_kg", "initial.position_m"]),
    "sun2018/circular_orbit": (None, ["spacecraft.mass_kg", "initial.position_error_m"]),
    "tao2019/case1": (None, ["spacecraft.mass_kg", "initial.mrp"]),
    "satellites/earth_pointing": (None, ["truth.inertia_factor"]),
}


def missions():
    """Return the names of all shipped missions."""
    return [name for name in casadi_gnc.shipped() if read(name).data["kind"] == "mission"]


def what_varies(name):
    """Return the scheme that flies a mission, None for its first, and keys that differ from flight to flight."""
    return FLOWN.get(name, (None, ["truth.inertia_factor" if name.startswith("satellites/") else "initial.*"]))
