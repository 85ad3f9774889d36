"""Truth: a Riccati solver of SciPy's, for a satellite that stands and sees stars."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.linalg import solve_discrete_are

from casadi_gnc.mechanics.sensors import Gyro, StarTracker
from casadi_gnc.navigation import Mekf
from casadi_gnc.vehicles.satellite import SatelliteCraft, pointing_checks

BODY = {"mass_kg": 90.0, "inertia_kg_m2": np.diag([9.0, 11.0, 7.0]).tolist()}
WHEELS: Any = [{"axis": [1.0, 0.0, 0.0], "inertia_kg_m2": 0.01, "max_torque_N_m": 0.1}]


@pytest.mark.parametrize("dropout", [0.0, 0.5])
def test_knowledge_is_the_solution_of_a_riccati_equation(dropout):
    arw, rrw, period, across, about = 6e-6, 1.6e-6, 0.5, 5e-5, 3e-4
    gyro = Gyro("gyro", angle_random_walk=arw, bias_random_walk=rrw)
    tracker = StarTracker("stars", across=across, about=about, period=period, dropout=dropout)
    craft = SatelliteCraft(**BODY, wheel=WHEELS)
    mission: Any = SimpleNamespace(timing=SimpleNamespace(sample_period=period, duration=1500.0))
    F = np.array([[1.0, -period], [0.0, 1.0]])
    Q = np.diag([arw**2 * period + rrw**2 * period**3 / 3, rrw**2 * period])
    right = max(
        solve_discrete_are(F.T, np.array([[1.0], [0.0]]), Q, np.array([[deviation**2 / (1 - dropout)]]))[0, 0]
        for deviation in (across, about)
    )
    assert pointing_checks.knowledge(craft, mission, Mekf(gyro, (tracker,))) == pytest.approx(right**0.5, rel=1e-6)
