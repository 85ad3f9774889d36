"""Pictures are drawn, say what they show, and refuse what they cannot show."""

import math
from pathlib import Path

import numpy as np
import pytest

from casadi_gnc.campaigns.statistics import Convergence, Estimate, convergence, percentile, share_bounds
from casadi_gnc.errors import ProblemError
from casadi_gnc.reports import campaign_pictures as pictures


def texts(path: Path) -> str:
    """Return what stands in an SVG: letters are drawn as shapes there, with their text in a comment."""
    return "\n".join(line for line in path.read_text(encoding="utf-8").splitlines() if "<!--" in line)


@pytest.fixture
def values(rng) -> np.ndarray:
    found = rng.normal(100, 10, 3000)
    found[found > 125] = math.inf
    return found


def test_histogram(values, tmp_path):
    found = [percentile(values, share) for share in (0.5, 0.99, 0.999)]
    target = pictures.plot_histogram(
        values, tmp_path / "h.svg", label="settling time [s]", percentiles=found, limit=120.0, title="cost in $"
    )
    said = texts(target)
    never = int(np.isinf(values).sum())
    for text in (
        "settling time [s]",
        "99.9 %: no value",
        "limit: 120",
        f"3000 flights, {never} without a value",
        "cost",
    ):
        assert text in said
    assert f"50 %: {found[0].value:.4g}" in said


def test_histogram_of_few_flights(tmp_path):
    for values in (np.array([1.0]), np.array([math.inf, math.inf]), np.full(10, 3.0)):
        target = pictures.plot_histogram(values, tmp_path / "h.png", label="x", percentiles=[percentile(values, 0.5)])
        assert target.stat().st_size > 1000
    weights = np.array([0.1, 2.0])
    assert pictures.plot_histogram(np.array([1.0, 2.0]), tmp_path / "w.png", label="x", weights=weights).is_file()


def test_convergence(values, tmp_path):
    passed = np.cumsum(values < 120)
    found = convergence(3000, lambda n: share_bounds(int(passed[n - 1]), n))
    target = pictures.plot_convergence(found, tmp_path / "c.svg", label="share [-]", level=0.99, level_label="required")
    assert "required" in texts(target)
    assert "share [-]" in texts(target)


def test_convergence_without_bounds(tmp_path):
    one = np.array([10.0])
    found = Convergence(np.array([5]), one, -one * math.inf, one * math.inf)
    assert pictures.plot_convergence(found, tmp_path / "c.png", label="x").stat().st_size > 1000


@pytest.mark.parametrize("count", [1, 2, 3, 9])
def test_scatter(rng, values, tmp_path, count):
    inputs = rng.normal(size=(3000, count))
    names = [f"input_{i} [-]" for i in range(count)]
    worst = np.argsort(-values)[:20]
    said = texts(pictures.plot_scatter(inputs, values, names, tmp_path / "s.svg", label="time [s]", worst=worst))
    assert [name for name in names if name in said] == names[:6]
    assert "worst" in said
    assert "no value" in said


def test_drivers(tmp_path):
    first = [Estimate(0.1, 0.05, 0.2, 0.9), Estimate(0.6, 0.5, 0.7, 0.9), Estimate(math.nan, math.nan, math.nan, 0.9)]
    total = [Estimate(0.9, 0.8, 1.0, 0.9), Estimate(0.7, 0.6, 0.8, 0.9), Estimate(0.0, 0.0, 0.0, 0.9)]
    names = ["alpha_1", "beta", "gamma"]
    said = texts(pictures.plot_drivers(names, tmp_path / "d.svg", label="share [-]", first=first, total=total))
    assert "first order" in said
    # The strongest is on top: names are written from the bottom.
    assert said.index("gamma") < said.index("beta") < said.index("alpha_1")
    said = texts(pictures.plot_drivers(names, tmp_path / "f.svg", label="share [-]", first=first))
    assert said.index("gamma") < said.index("alpha_1") < said.index("beta")


def test_endings_that_are_no_pictures(values, tmp_path):
    found = convergence(10, lambda n: share_bounds(n, n))
    for draw in (
        lambda target: pictures.plot_histogram(values, target, label="x"),
        lambda target: pictures.plot_convergence(found, target, label="x"),
        lambda target: pictures.plot_scatter(values[:, None], values, ["x"], target, label="x"),
        lambda target: pictures.plot_drivers(["x"], target, label="x", first=[Estimate(0.0, 0.0, 0.0, 0.9)]),
    ):
        with pytest.raises(ProblemError, match="a picture ends in .png"):
            draw(tmp_path / "picture.txt")
    assert list(tmp_path.iterdir()) == []
