"""The theory pages: what they compute comes out as they say."""

import sys

import numpy as np
import pytest
from running_pages import ROOT, run, sections

sys.path.insert(0, str(ROOT / "docs"))
import theory_pictures

PAGES = ["theory_attitude.md", "theory_observers.md", "theory_allocation.md", "theory_inequalities.md"]


@pytest.mark.parametrize(("page", "section"), [(page, section.title) for page in PAGES for section in sections(page)])
def test_section(page, section, tmp_path):
    run(page, section, tmp_path)


@pytest.mark.slow
def test_pictures_are_made(tmp_path):
    theory_pictures.main(str(tmp_path))
    shown = {path.name for path in tmp_path.iterdir()}
    text = "".join((ROOT / "docs" / page).read_text() for page in PAGES)
    assert all(f"images/{name}" in text and (ROOT / "docs/images" / name).exists() for name in shown)


def test_pictures_show_what_their_captions_say():
    angle, mrp, other = theory_pictures.shadows()
    apart = np.abs(angle - 180) > 1e-9
    assert np.all((np.abs(mrp) < np.abs(other))[apart] == (angle < 180)[apart])
    _, true, bound = theory_pictures.gaps()
    assert np.all(true > 0)
    assert np.all(true < bound)
    for gain, held in ((1.0, 0.1 / (1 - np.exp(-0.1))), (27.0, 2.7 / (1 - np.exp(-2.7)))):
        assert theory_pictures.estimates(gain, 0.1, False, 400)[-1] == pytest.approx(held, rel=1e-9)
        assert theory_pictures.estimates(gain, 0.1, True, 400)[-1] == pytest.approx(1.0, rel=1e-9)
    turn = np.linspace(0, 2 * np.pi, 400)
    inside = [0.999 * share * np.array([np.cos(turn), np.sin(turn)]) for share in np.linspace(0, 1, 50)]
    met = [
        theory_pictures.lyapunov(plant, *np.hstack(inside)).min() < 0
        for plant in (theory_pictures.STABLE, theory_pictures.UNSTABLE)
    ]
    assert met == [True, False]
