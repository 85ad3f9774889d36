"""The disk of all channels at once by mu. Truth: a published example, triangular loops, and factors put into a loop."""

import json
import math

import numpy as np
import pytest
from typer.testing import CliRunner

from casadi_gnc.checking.margins import BrokenLoop, disk_of_all, margins
from casadi_gnc.checking.structured_disk import structured_disk
from casadi_gnc.cli.main import app

NONE = np.zeros((2, 2))


def held(loop, found):
    """Assert that the factors which are told make 1 + F L singular where they are told to."""
    F = np.diag(found.factors)
    sizes = np.abs((F - np.eye(len(F))) @ np.linalg.inv(F + np.eye(len(F)))).max()
    assert sizes == pytest.approx(found.broken / 2, rel=1e-6)
    assert np.linalg.svd(np.eye(len(F)) + F @ loop.at(found.at))[1][-1] < 1e-6
    assert found.proved <= found.broken


def test_the_spinning_satellite_of_doyle():
    """One channel bears everything, 2, both at once a twentieth of that: 0.0997 as published, and by calculus.

    S - T = (1 - 2 (1 + 10 j)/(1 + j w)) on the eigenvectors (1, j), (1, -j), whose magnitude is the largest where
    (100 + 10 x)/(1 + x^2) is, at x = sqrt(101) - 10.
    """
    loop = BrokenLoop(
        np.array([[0.0, 10.0], [-10.0, 0.0]]), np.eye(2), -np.array([[1.0, 10.0], [-10.0, 1.0]]), NONE
    )  # fmt: skip
    x = math.sqrt(101) - 10
    right = 1 / math.sqrt(0.25 + (100 + 10 * x) / (1 + x * x))
    found = structured_disk(loop)
    held(loop, found)
    assert right == pytest.approx(0.0997, abs=1e-4)
    assert found.proved == pytest.approx(right, rel=3e-5)
    assert found.broken == pytest.approx(right, rel=1e-6)
    assert found.at == pytest.approx(x, rel=1e-3)
    assert margins(loop.channel(0)).disk == pytest.approx(2.0, rel=1e-4)


@pytest.mark.parametrize("coupling", [1.0, 30.0])
def test_a_loop_that_feeds_one_way_bears_what_its_channels_bear(coupling):
    """Of a triangular loop the poles are those of its channels, whatever couples them; singular values mislead."""
    poles = np.array([1.0, 2.0])
    state = BrokenLoop(-np.diag(poles), np.eye(2), -np.array([[3.0, 0.0], [coupling, 5.0]]), NONE, period=0.0)
    slow = BrokenLoop(  # each channel of two states, so that its disk is below 2
        np.block([[state.A, np.eye(2)], [NONE, -np.diag(3 * poles)]]), np.vstack([NONE, np.eye(2)]),
        np.hstack([state.C, NONE]), NONE,
    )  # fmt: skip
    right = min(margins(slow.channel(i)).disk for i in range(2))
    found = structured_disk(slow)
    held(slow, found)
    assert right < 1.9
    assert found.proved == pytest.approx(right, rel=1e-3)
    if coupling > 1:
        assert disk_of_all(slow)[0] < 0.5 * right


@pytest.mark.slow
def test_the_command_tells_both_bounds():
    words = ["margins", "satellites/slew", "--structured"]
    (one,) = json.loads(CliRunner().invoke(app, [*words, "--json"]).stdout)["schemes"]
    disk = one["structured_disk"]
    assert one["disk_of_efforts"] * (1 - 1e-4) < disk["proved"] <= disk["broken"]
    assert len(disk["gains"]) == len(disk["phases_rad"]) == 3
    told = CliRunner().invoke(app, words).stdout
    assert f"mu proves a disk of {disk['proved']:.4g} for all efforts at once" in told
