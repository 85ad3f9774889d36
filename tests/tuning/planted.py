"""Missions into which a failure is planted, each in a corner that few dispersed flights reach.

A planted mission is a shipped file with other values, and tables at its end. The bench and the tests search the same.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from casadi_gnc.problem_files.document import read
from casadi_gnc.problem_files.loading import craft_of
from casadi_gnc.problem_files.rewriting import dumped, rewritten


@dataclass(frozen=True)
class Planted:
    """A failure that is planted.

    Parameters
    ----------
    base, changes : a shipped file, and values of it.
    scheme : the only one that is left.
    tables : requirements and dispersions, and what else is added.
    over : as for `falsify`.
    cause : a normal dispersion whose upper end, alone, breaks; where noise decides whether it does.
    """

    base: str
    changes: dict[str, Any]
    scheme: str
    tables: dict[str, Any]
    over: dict[str, list[Any]] = field(default_factory=dict)
    cause: str = ""

    def write(self, file: Path, seed: int = 0, dispersed: int | None = None) -> Path:
        """Write the problem file; its requirement is P, `seed` is that of its noise.

        Of the dispersions the first `dispersed` are kept, all by default; the slew does not break by its first five.
        """
        document = read(self.base)
        kept = [each for each in document.data["scheme"] if each["name"] == self.scheme]
        data = {**document.data, "scheme": [*kept, *self.tables.get("scheme", [])]}
        tables = {name: each for name, each in self.tables.items() if name != "scheme"}
        tables["dispersion"] = tables["dispersion"][:dispersed]
        data.pop("metric", None)
        one = document.with_data({**data, **tables})
        file.write_text(dumped(one.data), encoding="utf-8")
        again = read(file)
        file.write_text(rewritten(again, {**self.changes, "noise.seed": seed}, craft_of(again)), encoding="utf-8")
        return file


def requirement(formula: str) -> dict[str, Any]:
    """Return the table of a requirement."""
    return {"id": "P", "formula": formula}


def normal(key: str, mean: float, deviation: float, **more: float) -> dict[str, Any]:
    """Return the table of a normal dispersion."""
    return {"key": key, "normal": {"mean": mean, "deviation": deviation, **more}}


def alike(keys: list[str], mean: float, deviation: float) -> list[dict[str, Any]]:
    """Return the tables of normal dispersions of one law."""
    return [normal(key, mean, deviation) for key in keys]


#: What else is not known of the wheel craft: it hardly matters.
_OF_THE_WHEEL_CRAFT = [
    *(normal(f"initial.mrp.{i}", mean, 0.01) for i, mean in enumerate((0.323, -0.194, 0.388), 1)),
    *(normal(f"initial.rate_rad_per_s.{i}", mean, 2e-3) for i, mean in enumerate((-0.01, 0.02, -0.03), 1)),
    *(normal(f"truth.inertia_kg_m2.{i}.{i}", mean, 0.2) for i, mean in enumerate((12.0, 14.0, 22.0), 1)),
    *alike(["environment.harmonic.1.amplitude_N_m.1"], 0.005, 5e-4),
    *alike(["environment.harmonic.2.amplitude_N_m.2"], -0.005, 5e-4),
    *alike(["environment.harmonic.3.amplitude_N_m.3"], 0.006, 5e-4),
    *(normal(f"environment.harmonic.{i}.frequency_rad_per_s", mean, 1e-3)
      for i, mean in enumerate((0.02, 0.025, 0.04), 1)),
    *(normal(f"environment.harmonic.{i}.phase_rad", mean, 0.1)
      for i, mean in enumerate((1.5707963267948966, 1.5707963267948966), 1)),
    normal("environment.orbit_rate_rad_per_s", 7.292115e-5, 1e-6),
]  # fmt: skip

_OBSERVER = {
    "name": "observer",
    "force_limit_N": [17.321, 17.321, 17.321],
    "allocation": {"damping": 0.05},
    "as_printed": ["held_feed_through"],
    "law": {
        "type": "position_disturbance_observer",
        "approach_speed": 0.3,
        "observer_gain": 400.0,
        "controller_gain": [
            [30.9591, 0.0, -0.0060, 42.0051, 0.0, 0.0123],
            [0.0, 30.9592, 0.0, 0.0, 42.0052, 0.0],
            [0.0061, 0.0, 30.9590, -0.0121, 0.0, 42.0050],
        ],
    },
}

PLANTED = {
    # A large accuracy weight lets wheels oppose each other: below half its strength the first turns the loop around.
    "wheel_fault": Planted(
        "huang2019/wheel_faults",
        {
            "timing.duration_s": 40.0,
            **{f"fault.{i}.effectiveness": 1.0 for i in (1, 2, 3, 4)},
            "fault.2.bias_rad_per_s2": 0.0,
            "fault.4.bias_rad_per_s2": 0.0,
        },
        "observers_robust",
        {
            "requirement": [requirement("always[25, 40](norm(mrp) <= 0.05)")],
            "dispersion": [
                {
                    "key": "fault.1.effectiveness",
                    "choice": {"values": [1.0, 0.8, 0.3], "weights": [0.5, 0.495, 0.005]},
                },
                {"key": "initial.rate_rad_per_s", "uniform": [-0.02, 0.02]},
            ],
        },
    ),
    # The printed observer, sampled, takes its own ramp for a disturbance: a true mass past what its gain bears, and its
    # loop grows at each sample.
    "observer": Planted(
        "shi2020/docking",
        {"timing.duration_s": 30.0},
        "none",
        {
            "scheme": [_OBSERVER],
            "requirement": [requirement("always[20, 30](norm(velocity) <= 0.05)")],
            "dispersion": [
                normal("spacecraft.chaser_mass_kg", 40.0, 3.6),
                normal("spacecraft.target_mass_kg", 100.0, 10.0),
                *(normal(f"initial.position_m.{i}", mean, 0.02) for i, mean in enumerate((2.0, 3.0, 4.0), 1)),
                *(normal(f"environment.chaser.constant_N.{i}", m, 0.01) for i, m in enumerate((0.1, 0.15, 0.2), 1)),
                *(normal(f"environment.target.constant_N.{i}", m, 0.01) for i, m in enumerate((0.1, 0.2, 0.3), 1)),
                *(normal(f"fault.force_N.{i}", m, 0.01) for i, m in enumerate((0.08, 0.09, 0.04), 1)),
                *(normal(f"sensors.position_error_m.{i}", m, 1e-5) for i, m in enumerate((4e-4, 5e-4, 6e-4), 1)),
                normal("orbit.eccentricity", 0.15, 0.005),
                normal("orbit.semi_major_axis_m", 1e7, 1e4),
            ],
        },
    ),
    # The paper's own gains, towards which these are dispersed, leave the funnel.
    "printed_slew": Planted(
        "huang2020/slew",
        {"timing.duration_s": 100.0},
        "funnel_pinv",
        {
            "requirement": [requirement("always(funnel_use < 1)")],
            "dispersion": [
                normal("scheme.funnel_pinv.law.attitude_gain", 0.25, 0.02),
                normal("scheme.funnel_pinv.law.rate_gain", 2.0, 0.35),
                normal("scheme.funnel_pinv.law.compensator_gain", 0.1, 0.02),
                normal("truth.inertia_factor", 1.1, 0.03),
                normal("environment.constant_torque_N_m.1", 1e-4, 1e-5),
                normal("environment.constant_torque_N_m.2", 2e-4, 1e-5),
                normal("environment.constant_torque_N_m.3", -1e-4, 1e-5),
                normal("initial.rate_rad_per_s", 0.0, 5e-4),
                *(normal(f"initial.mrp.{i}", m, 1e-3) for i, m in enumerate((-0.206, -0.179, 0.075), 1)),
                *(
                    normal(f"environment.harmonic.1.amplitude_N_m.{i}", m, 1e-5)
                    for i, m in enumerate((1e-4, 1.5e-4, 2e-4), 1)
                ),
                *(
                    normal(f"environment.harmonic.2.amplitude_N_m.{i}", m, 1e-5)
                    for i, m in enumerate((1.5e-4, -2e-4, -1.5e-4), 1)
                ),
                normal("environment.orbit_rate_rad_per_s", 1.1e-3, 1e-5),
            ],
        },
    ),
    # Walls that narrow to a floor below what the star tracker can tell.
    "funnel_below_noise": Planted(
        "huang2019/wheel_faults",
        {
            "timing.mode": "sampled",
            "timing.duration_s": 60.0,
            **{f"fault.{i}.effectiveness": 1.0 for i in (1, 2, 3, 4)},
            "fault.2.bias_rad_per_s2": 0.0,
            "fault.4.bias_rad_per_s2": 0.0,
        },
        "observers_pinv",
        {
            "funnel": [
                {
                    "signal": "mrp",
                    "start": [1.0, 1.0, 1.0],
                    "floor": [4.9e-4, 4.9e-4, 4.9e-4],
                    "decay_per_s": [0.2, 0.2, 0.2],
                    "below": [1.0, 1.0, 1.0],
                    "above": [1.0, 1.0, 1.0],
                }
            ],
            "requirement": [requirement("always(funnel_use < 1)")],
            "dispersion": [
                normal("sensors.mrp_deviation", 1e-4, 1.5e-5),
                normal("sensors.rate_deviation_rad_per_s", 1e-4, 1e-5),
                *_OF_THE_WHEEL_CRAFT,
            ],
        },
        cause="sensors.mrp_deviation",
    ),
    # The rate loop, sampled ever more slowly: half a period of hold is a delay, and the last is just past its margin.
    "delay": Planted(
        "satellites/slew",
        {"timing.duration_s": 180.0, "timing.sample_period_s": 1.0, "initial.angle_deg": 10.0},
        "pd",
        {
            "requirement": [requirement("always[60, 180](pointing_error_deg <= 0.5)")],
            "dispersion": [
                normal("spacecraft.inertia_kg_m2.1.1", 85.0, 3.0),
                normal("spacecraft.inertia_kg_m2.2.2", 110.0, 3.0),
                normal("spacecraft.inertia_kg_m2.3.3", 64.0, 3.0),
                normal("initial.angle_deg", 10.0, 0.5),
                *alike([f"wheel.{i}.viscous_N_m_s_per_rad" for i in range(1, 5)], 5e-6, 5e-7),
                *alike([f"wheel.{i}.coulomb_N_m" for i in range(1, 5)], 1e-3, 1e-4),
                *alike([f"scheme.pd.law.{key}" for key in ("attitude_gain",)], 4.0, 0.02),
            ],
        },
        {"timing.sample_period_s": [3.0, 6.0]},
    ),
}
