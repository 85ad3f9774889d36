"""All pictures have one style: colours that all tell apart, legible letters, files that are the same again."""

import re
from itertools import combinations

import numpy as np
import pytest

import casadi_gnc
from casadi_gnc.allocation.attainable_plots import plot_slices
from casadi_gnc.campaigns.statistics import percentile
from casadi_gnc.checking import check
from casadi_gnc.checking.broken_loops import scheme_margins
from casadi_gnc.missions.requirements import Requirement
from casadi_gnc.problem_files.allocation_file import load_allocation
from casadi_gnc.reports import campaign_pictures, check_picture, falsify_picture, flight_pictures, margins_picture
from casadi_gnc.system import pictures

#: What the eye without one kind of cone sees of linear red, green and blue (G. M. Machado, M. M. Oliveira,
#: L. A. F. Fernandes, 2009, doi:10.1109/TVCG.2009.113, table for severity 1).
SEEN = {
    "all cones": np.eye(3),
    "protanopia": np.array(
        [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]
    ),
    "deuteranopia": np.array(
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]
    ),
    "tritanopia": np.array(
        [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]]
    ),
}
#: From linear sRGB to XYZ, and the white of daylight (IEC 61966-2-1).
XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
WHITE = XYZ.sum(axis=1)


def lab(colour, cones):
    """Return CIE L*a*b* of a colour as it is seen."""
    coded = np.array([int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)])
    linear = np.where(coded <= 0.04045, coded / 12.92, ((coded + 0.055) / 1.055) ** 2.4)
    x, y, z = XYZ @ np.clip(cones @ linear, 0, 1) / WHITE
    f = [t ** (1 / 3) if t > 216 / 24389 else (24389 / 27 * t + 16) / 116 for t in (x, y, z)]
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


@pytest.mark.parametrize("cones", SEEN.values(), ids=SEEN)
def test_colours_are_told_apart_with_every_kind_of_colour_vision(cones):
    """A just noticeable difference is 2.3 (M. Mahy and others, 1994); lines want some of them."""
    seen = [lab(colour, cones) for colour in pictures.COLOURS]
    assert min(np.linalg.norm(a - b) for a, b in combinations(seen, 2)) > 4 * 2.3


def made(folder, detumble, ending):
    """Every kind of picture, of what takes little time."""
    flights = [casadi_gnc.fly(detumble.with_timing(duration=20.0), name) for name in ("damping_pinv", "observer_pinv")]
    drawn = flight_pictures.plot_flights(detumble, flights, folder, ending)
    scheme = detumble.scheme("observer_pinv")
    drawn.append(check_picture.draw(detumble.title, check(detumble, scheme.name), folder / f"checks.{ending}"))
    drawn.append(margins_picture.draw(detumble.title, [scheme_margins(detumble, scheme)], folder / f"margins.{ending}"))
    asked = Requirement("SLOW", formula="always[5, 15](norm(rate) <= 0.9)")
    steps, way = [("nominal", 1, 0.1, 0.0), ("boundary", 20, -1e-3, 2.0)], [(0.0, 0.1), (1.0, 0.05), (2.0, -1e-3)]
    target = folder / f"falsify.{ending}"
    drawn.append(falsify_picture.draw(detumble.title, asked, steps, way, flights, target, unit="rad/s"))
    case = load_allocation("huang2020/allocation")
    drawn.append(plot_slices(case.physical, folder / f"attainable.{ending}", wanted=case.torque_limit))
    values = np.random.default_rng(1).normal(100, 10, 200)
    spread = {"label": "settling time [s]", "percentiles": [percentile(values, 0.5)], "title": "many " * 30}
    drawn.append(campaign_pictures.plot_histogram(values, folder / f"histogram.{ending}", **spread))
    inputs = values[:, None] + [0, 1]
    drawn.append(campaign_pictures.plot_scatter(inputs, values, ["a", "b"], folder / f"scatter.{ending}", label="x"))
    return drawn


@pytest.mark.slow
def test_letters_stay_legible_in_a_column_and_nothing_runs_out(detumble, tmp_path, monkeypatch):
    """In 3.5 in, a column of a page with two, no letters below 6 pt but exponents; and no ink beyond the sheet."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    figures, write = [], Figure.savefig
    monkeypatch.setattr(Figure, "savefig", lambda self, *a, **k: (write(self, *a, **k), figures.append(self))[0])
    with rc_context({"svg.fonttype": "none"}):
        drawn = made(tmp_path, detumble, "svg")
    assert len(drawn) == len(figures) == 9
    for path, figure in zip(drawn, figures, strict=True):
        text = path.read_text(encoding="utf-8")
        width = float(re.search(r'width="([\d.]+)pt"', text)[1])
        assert width == pytest.approx(72 * pictures.WIDTH)
        # Letters of formulas have their size as font-size, exponents 0.7 of it.
        letters = [float(size) for size in re.findall(r"font(?:-size)?: ([\d.]+)px", text)]
        whole = [size for size in letters if size != pytest.approx(0.7 * pictures.FONT)]
        assert len(whole) > 5
        assert min(whole) * 72 * pictures.COLUMN / width > 6.0, path.name
        ink, most = figure.get_tightbbox(), (pictures.WIDTH, figure.get_figheight())
        assert np.all(ink.min >= -0.01), path.name
        assert np.all(ink.max <= np.add(most, 0.01)), path.name


@pytest.mark.slow
@pytest.mark.parametrize(("ending", "begins"), [("svg", b"<?xml"), ("pdf", b"%PDF"), ("png", b"\x89PNG")])
def test_the_same_picture_is_the_same_file(detumble, tmp_path, ending, begins):
    flight = casadi_gnc.fly(detumble.with_timing(duration=20.0), "observer_pinv")
    files = []
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        (path,) = flight_pictures.plot_flights(detumble, [flight], tmp_path / name, ending)
        files.append(path.read_bytes())
    assert files[0] == files[1]
    assert files[0].startswith(begins)
