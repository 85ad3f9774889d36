"""The page of a campaign."""

import re
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from looking import keep, legible, opened, until

import casadi_gnc
from casadi_gnc.campaigns import DispersionTable
from casadi_gnc.campaigns.campaign import campaign
from casadi_gnc.missions.requirements import Requirement
from casadi_gnc.reports.campaign_page import of_campaign

SPREAD = [
    DispersionTable(key="truth.inertia_factor", normal={"mean": 1.1, "deviation": 0.03, "truncate": 3.0}),
    DispersionTable(key="initial.rate_rad_per_s", uniform=[0.05, 0.1]),
]
ASKED = [
    Requirement("ACS-1", metric="settling_time", at_most=60.0, share=0.95, text="<b>quick</b>"),
    Requirement("ACS-2", metric="force_sample_sum", at_most=100.0, share=0.9),
]


@pytest.fixture(scope="module")
def made(detumble, tmp_path_factory):
    mission = replace(detumble.with_timing(duration=120.0), requirements=ASKED)
    return campaign(mission, 400, scheme="observer_pinv", dispersions=SPREAD, out=tmp_path_factory.mktemp("mc") / "m")


@pytest.fixture(scope="module")
def page(made, tmp_path_factory):
    return of_campaign(made, tmp_path_factory.mktemp("page") / "a.html")


def shell(page):
    return re.sub(r"<(script|style).*?</\1>", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)


def test_what_the_summary_says_is_on_the_page(page, made):
    told, summary = shell(page), made.summary()
    assert told.index('id="verdict"') < told.index('id="requirements"') < told.index('id="metrics"')
    for name, one in summary["requirements"].items():
        assert f"{one['met_by']} of {one['of']}" in told
        assert name in told
    for name, one in summary["metrics"].items():
        assert name.replace("_", " ") in told
        for found in one["percentiles"].values():
            assert ("none" if found["value"] is None else f"{found['value']:.4g}") in told
        assert f"--case worst:{name} --report case-{one['worst'][0]['case']}.html" in told
    assert "&lt;b&gt;quick&lt;/b&gt;" in told
    assert page.stat().st_size < 5_000_000


def test_the_histogram_counts_every_flight(page, made):
    """Heights of the bars, read back from the picture, against the counts between the bars' own edges."""
    part = shell(page).split("<h3>force sample sum")[1].split("<h3>")[0]
    (chart,) = re.findall(r'<path class="bars c0" d="([^"]+)"', part)
    left, zero, top, right = np.array(re.findall(r"M(\S+) (\S+)V(\S+)H([\d.]+)V", chart), dtype=float).T
    heights, values = zero - top, made.column("metric.force_sample_sum")
    # Two marks say where the picture's places lie on the axis.
    marks = re.findall(r'<text x="([\d.]+)" y="271" class="middle">([\d.e+-]+)</text>', part.split("</svg>")[0])
    (a, low), *_, (b, high) = [(float(place), float(number)) for place, number in marks]
    edges = low + (np.append(left, right[-1]) - a) * (high - low) / (b - a)
    counts = np.array([(values < edge).sum() for edge in edges])
    assert counts[0] == 0
    assert counts[-1] == len(values) == 400
    # A place is rounded to a tenth of a unit: few flights lie so near to an edge.
    np.testing.assert_allclose(np.cumsum(heights) / heights.sum(), counts[1:] / 400, atol=0.02)


def test_ten_thousand_points_are_few_bytes(made, tmp_path):
    """As many as a campaign of 10 000 draws: no more points than the page shows, however many there are."""
    from casadi_gnc.reports.campaign_page import _scatter

    rng = np.random.default_rng(1)
    values = rng.standard_normal(10_000)
    chart = _scatter(rng.standard_normal(10_000), values, np.argsort(-values)[:5], "key", "label").svg()
    assert len(chart) < 60_000
    assert str(chart).count("h0") > 2000


@pytest.mark.slow
def test_commands_write_it(tmp_path):
    (tmp_path / "m.toml").write_text(
        casadi_gnc.load("huang2020/detumble").origin.text.replace("duration_s = 1500.0", "duration_s = 20.0")
        + '\n[[dispersion]]\nkey = "truth.inertia_factor"\nnormal = { mean = 1.1, deviation = 0.03 }\n'
    )
    command = [sys.executable, "-m", "casadi_gnc.cli.main"]
    flying = ["campaign", "m.toml", "--scheme", "observer_pinv", "--flights", "12", "--out", "mc", "--report", "a.html"]
    for words in (flying, ["report", "mc", "--out", "b.html"]):
        done = subprocess.run([*command, *words], capture_output=True, text=True, timeout=300, cwd=tmp_path)
        assert done.returncode == 0, done.stderr
    assert (tmp_path / "a.html").read_text(encoding="utf-8") == (tmp_path / "b.html").read_text(encoding="utf-8")
    assert "12 flights of 12 cases" in shell(tmp_path / "a.html")


@pytest.mark.tools("chromium")
@pytest.mark.packages("playwright")
@pytest.mark.parametrize(("width", "scheme"), [(1280, "light"), (400, "dark")])
def test_quiet_and_legible(browser, page, width, scheme):
    with opened(browser, page, width=width, scheme=scheme) as sheet:
        assert sheet.locator("figure.chart").count() >= 8
        legible(sheet, width)
        assert sheet.locator("td", has_text="<b>quick</b>").count() == 1
        assert sheet.locator("td b").count() == 0
        keep(sheet, f"campaign-{width}-{scheme}")


#: Marks of an axis of a chart and its places: [(place, number)], and where the largest dot of a kind lies.
PLACES = """([chart, kind]) => {
  const marks = (side) => [...chart.querySelectorAll(`text.${side}:not(.axis)`)].map((one) => [
    Number(one.getAttribute(side === "middle" ? "x" : "y")) - (side === "end" ? 4 : 0), Number(one.textContent)]);
  const dots = [...chart.querySelectorAll(`path.${kind}`)].map((one) => one.getAttribute("d")).join("");
  const places = [...dots.matchAll(/M([-\\d.]+) ([-\\d.]+)h0/g)].map((one) => [Number(one[1]), Number(one[2])]);
  return { across: marks("middle"), up: marks("end"), places };
}"""

#: When the first picture was there, [ms].
PAINTED = "performance.getEntriesByType('paint')"


def read(marks, places):
    """Return numbers at places of an axis, of which the first and the last mark are known."""
    (a, low), (b, high) = marks[0], marks[-1]
    return low + (np.asarray(places) - a) * (high - low) / (b - a)


@pytest.mark.slow
@pytest.mark.tools("chromium")
@pytest.mark.packages("playwright")
def test_ten_thousand_flights_in_a_browser(browser, detumble, tmp_path):
    """Flights of a minute: what the page costs depends on their number alone."""
    mission = replace(detumble.with_timing(duration=60.0), requirements=ASKED)
    found = campaign(mission, 10_000, scheme="observer_pinv", dispersions=SPREAD, out=tmp_path / "m")
    page = of_campaign(found, tmp_path / "a.html")
    assert page.stat().st_size < 5_000_000
    driver = found.summary()["metrics"]["force_sample_sum"]["drivers"][0]["key"]
    values, rates = found.column("metric.force_sample_sum"), found.column(driver)
    worst, painted = np.argsort(-values)[:5], []
    while len(painted) < 3 and min(painted, default=1500.0) >= 1500.0:  # other work on the machine is not the page's
        with opened(browser, page) as sheet:
            until(sheet, f"{PAINTED}.length > 0")
            painted.append(sheet.evaluate(f"Math.max(...{PAINTED}.map((one) => one.startTime))"))
    assert min(painted) < 1500.0
    with opened(browser, page) as sheet:
        assert "10000 flights of 10000 cases" in sheet.locator("#verdict").inner_text()
        legible(sheet, 1280)
        keep(sheet, "campaign-of-10000")
        (chart,) = [
            one
            for one in sheet.locator("figure.chart").all()
            if f"Over {driver}" in one.text_content() and "force sample sum" in one.text_content()
        ]
        handle = chart.element_handle()
        seen = sheet.evaluate(PLACES, [handle, "bad.dots"])
        drawn = np.array(seen["places"])
        # A place is rounded to a tenth of a unit of some hundred.
        wide, high = (float(np.ptp(each)) for each in (rates, values))
        assert len(drawn) == len(worst)
        np.testing.assert_allclose(
            np.sort(read(seen["up"], drawn[:, 1])), np.sort(values[worst]), atol=2e-3 * high, rtol=0
        )
        np.testing.assert_allclose(
            np.sort(read(seen["across"], drawn[:, 0])), np.sort(rates[worst]), atol=2e-3 * wide, rtol=0
        )
        # Of the others so many are drawn that they can be told apart; none lies beyond the worst.
        others = np.array(sheet.evaluate(PLACES, [handle, "quiet.dots"])["places"])
        assert 2000 < len(others) <= 4000
        assert read(seen["up"], others[:, 1]).max() <= values.max() + 2e-3 * high
