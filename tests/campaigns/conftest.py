"""What the tests of campaigns share."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

PROBLEM = """
[[dispersion]]
key = "truth.inertia_factor"
normal = { mean = 1.0, deviation = 0.03, truncate = 3.0 }

[[dispersion]]
key = "initial.rate_rad_per_s"
uniform = [-0.05, 0.05]

[[requirement]]
id = "DTB-1"
metric = "settling_time"
at_most = 120.0
share = 0.95
"""


@pytest.fixture
def problem(tmp_path):
    from casadi_gnc.system import assets

    text = (assets.folder("problems") / "huang2020" / "detumble.toml").read_text()
    place = tmp_path / "tumbling.toml"
    place.write_text(text.replace("duration_s = 1500.0", "duration_s = 150.0") + PROBLEM)
    return place


@pytest.fixture
def small_shards(monkeypatch):
    """Shards of 16 flights, where a flight has 400 samples."""
    monkeypatch.setattr("casadi_gnc.campaigns.campaign._SHARD_SAMPLES", 400 * 16)
