"""The page of flights as a file: what it holds, what it forbids, what it says it lacks."""

import base64
import hashlib
import json
import re
import shutil
import subprocess
import sys
import time
import zlib
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from scipy.optimize import linprog

import casadi_gnc
from casadi_gnc.errors import ReportError
from casadi_gnc.reports import flight_page, records
from casadi_gnc.reports.describing import described
from casadi_gnc.reports.flight_data import data_of
from casadi_gnc.reports.loops import loops_of
from casadi_gnc.reports.packed import Packed
from casadi_gnc.reports.told import ShownLoops
from casadi_gnc.reports.writing import write_report
from casadi_gnc.system.text import visible


@pytest.fixture(scope="module")
def page(flown, tmp_path_factory):
    return write_report(flown, tmp_path_factory.mktemp("page") / "report.html").read_text(encoding="utf-8")


def test_verdict_comes_first_and_every_number_is_told(page, flown):
    told = re.sub(r"<(script|style).*?</\1>", "", page, flags=re.DOTALL)
    assert told.index('id="verdict"') < told.index('id="look"') < told.index('id="metrics"') < told.index('id="space"')
    for scheme in json.loads((flown / "summary.json").read_text())["schemes"]:
        for one in scheme["metrics"].values():
            assert ("never" if one["value"] is None else f"{one['value']:.5g}") in told
        for one in scheme["statuses"]:
            assert one["meaning"] in told
            assert f"{one['samples']} samples" in told
        assert scheme["made"]["problem_sha256"] in told


def test_only_what_the_page_was_made_of_may_run(page):
    """Each script and style is allowed by its hash, and nothing else is: no attribute, no address."""
    (policy,) = re.findall(r'<meta http-equiv="Content-Security-Policy" content="([^"]*)">', page)
    rules = dict(rule.split(" ", 1) for rule in policy.replace("&#39;", "'").split("; "))
    assert rules["default-src"] == "'none'"
    assert "unsafe" not in policy
    assert "http" not in policy
    blocks = {"script-src": re.findall(r"<script>(.*?)</script>", page, re.DOTALL)}
    blocks["style-src"] = re.findall(r"<style>(.*?)</style>", page, re.DOTALL)
    for rule, texts in blocks.items():
        hashes = [base64.b64encode(hashlib.sha256(text.encode()).digest()).decode() for text in texts]
        assert rules[rule].split() == [f"'sha256-{each}'" for each in hashes]
        assert len(texts) >= 2
    shell = re.sub(r"<(script|style).*?</\1>", "", page, flags=re.DOTALL)
    assert not re.search(r'\s(on\w+|style|src)="', shell)
    assert {target[:1] for target in re.findall(r'href="([^"]*)"', shell)} <= {"#", "d"}


def test_it_stays_small_and_costs_little(flown, tmp_path):
    """2 MB; and far from the 3 s of which a flight may be longer, of this process alone."""
    started = time.process_time()
    page = write_report(flown, tmp_path / "report.html")
    assert time.process_time() - started < 3.0
    assert page.stat().st_size < 2_000_000


def test_the_command_writes_what_the_folder_gives(flown, tmp_path, page):
    done = subprocess.run(
        [sys.executable, "-m", "casadi_gnc.cli.main", "report", str(flown), "--out", str(tmp_path / "a.html")],
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert (done.returncode, done.stdout) == (0, f"wrote {tmp_path / 'a.html'}\n"), done.stderr
    assert (tmp_path / "a.html").read_text(encoding="utf-8") == page


def test_fly_writes_the_same_page(tmp_path):
    command = [sys.executable, "-m", "casadi_gnc.cli.main"]
    flying = ["fly", "shi2020/docking", "--scheme", "iobc", "--out", str(tmp_path / "o")]
    done = subprocess.run(
        [*command, *flying, "--report", str(tmp_path / "a.html")], capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stderr
    assert f"wrote {tmp_path / 'a.html'}" in done.stdout
    again = write_report(tmp_path / "o", tmp_path / "b.html")
    assert again.read_text(encoding="utf-8") == (tmp_path / "a.html").read_text(encoding="utf-8")


HOSTILE = "</script><script>alert(1)</script><img src=x onerror=alert(2)>\"' " + chr(0x202E) + "gnp.exe {{ 7*7 }} & co"


def test_hostile_texts_are_texts(detumble, tmp_path):
    mission = replace(detumble, title=HOSTILE, source=10_000 * "long ").with_timing(duration=20.0)
    scheme = mission.with_scheme("damping_pinv", title=HOSTILE)
    flight = replace(casadi_gnc.fly(scheme), notes=(HOSTILE,))
    told = flight_page.of_mission(scheme, [flight], tmp_path / "a.html", ShownLoops()).read_text(encoding="utf-8")
    assert chr(0x202E) not in told
    shell = re.sub(r"<(script|style)[^>]*>.*?</\1>", "", told, flags=re.DOTALL)
    assert "<img" not in shell
    assert "alert(1)" in shell
    assert "{{ 7*7 }}" in shell
    data = json.loads(re.search(r'<script type="application/json" id="data">(.*?)</script>', told, re.DOTALL)[1])
    assert data["schemes"][0]["title"] == visible(HOSTILE)


def copy(flown, tmp_path):
    return shutil.copytree(flown, tmp_path / "copy")


def lacking(folder, tmp_path):
    """Return what the page of a folder says that it lacks."""
    page = write_report(folder, tmp_path / "report.html").read_text(encoding="utf-8")
    found = re.search(r'id="lacking">(.*?)</section>', page, re.DOTALL)
    return page, found[1] if found else ""


def test_a_whole_folder_lacks_nothing(flown, tmp_path):
    assert lacking(flown, tmp_path)[1] == ""


def test_half_a_folder_is_shown_as_far_as_it_goes(flown, tmp_path):
    folder = copy(flown, tmp_path)
    (folder / "observer_pinv.npz").unlink()
    (folder / "damping_pinv.npz").write_bytes((flown / "damping_pinv.npz").read_bytes()[:5000])
    page, told = lacking(folder, tmp_path)
    assert "observer_pinv.npz is not there" in told
    assert "damping_pinv.npz cannot be read" in told
    assert 'name="scheme" value="0"' in page
    assert 'name="scheme" value="1"' not in page
    assert "967.2" in page  # the metric of the flight whose record is gone


@pytest.mark.parametrize(
    ("name", "content", "sentence"),
    [
        ("summary.json", None, "summary.json is not there: metrics, verdicts, statuses and provenance are not known"),
        ("summary.json", "{", "summary.json cannot be read"),
        ("summary.json", "[]", "summary.json is no object of JSON"),
        ("summary.json", '{"schemes": [{"scheme": "damping_pinv", "metrics": 3}]}', "summary.json: metrics:"),
        ("mission.json", None, "mission.json is not there: limits, funnels and the view in space are not drawn"),
        ("mission.json", '{"format": 2}', "mission.json: format:"),
        ("mission.json", "nonsense", "mission.json cannot be read"),
        ("loops.json", '{"format": 2}', "loops.json: format:"),
        ("loops.json", "[", "loops.json cannot be read"),
    ],
)
def test_what_another_version_wrote_is_said_and_the_rest_shown(flown, tmp_path, name, content, sentence):
    folder = copy(flown, tmp_path)
    if content is None:
        (folder / name).unlink()
    else:
        (folder / name).write_text(content)
    page, told = lacking(folder, tmp_path)
    assert sentence in told
    assert page.count('name="scheme"') == 3


def test_margins_poles_and_attainable_sets_are_there(page, flown, detumble):
    """Of every scheme, as `margins` tells them; sets of two kinds of allocation, the corners by a linear program."""
    told = re.sub(r"<(script|style).*?</\1>", "", page, flags=re.DOTALL)
    part = told[told.index('id="loops"') : told.index('id="attainable"')]
    for scheme in detumble.schemes:
        own = part.split(f"<h3>{scheme.title}</h3>")[1].split("<h3>")[0]
        found = casadi_gnc.margins(detumble, scheme.name)[0]
        for name, one in found.channels.items():
            assert f'<td class="name">{name}</td>' in own
            assert f"{one.delay:.4g} s" in own
        assert own.count('<figure class="chart">') == 4
    part = told[told.index('id="attainable"') : told.index('id="provenance"')]
    assert part.count("<h3>") == 2  # schemes of the pseudo-inverse together
    assert part.count('<figure class="chart">') == 6
    # What is farthest along x in the slice of x and y: a linear program with the other two axes.
    kept = json.loads((flown / "loops.json").read_text())["slices"][0]
    assert (kept["across"], kept["up"]) == ("torque x [N m]", "torque y [N m]")
    actuation = detumble.scheme("damping_pinv").actuation
    matrix = np.array(actuation.effectiveness)
    best = linprog(
        -matrix[0], A_eq=matrix[2:], b_eq=[0.0], bounds=list(zip(actuation.lower, actuation.upper, strict=True))
    )
    assert max(x for x, _ in kept["outlines"]["nominal geometry"]) == pytest.approx(-best.fun, rel=1e-4)


def test_a_folder_without_loops_has_none(flown, tmp_path):
    folder = copy(flown, tmp_path)
    (folder / "loops.json").unlink()
    page, told = lacking(folder, tmp_path)
    assert told == ""
    assert 'id="loops"' not in page


def test_signals_that_pictures_want_and_records_lack(flown, tmp_path):
    folder = copy(flown, tmp_path)
    with np.load(flown / "damping_pinv.npz") as kept:
        rest = {name: kept[name] for name in kept.files if name not in ("force", "mrp", "limited", "status")}
    np.savez(folder / "damping_pinv.npz", **rest)
    page, told = lacking(folder, tmp_path)
    assert "damping_pinv.npz has no force, limited, status, which its pictures want" in told
    assert "damping_pinv.npz has no mrp, force, which the view in space wants" in told
    assert page.count('name="scheme"') == 3


def test_records_that_are_none(flown, tmp_path):
    folder = copy(flown, tmp_path)
    np.savez(folder / "observer_pinv.npz", time=np.arange(3.0), rate=np.zeros((4, 3)))
    np.savez(folder / "damping_pinv.npz", rate=np.zeros((4, 3)))
    np.savez(folder / "observer_robust.npz", time=np.array([object()], dtype=object), allow_pickle=True)
    _, told = lacking(folder, tmp_path)
    assert "observer_pinv.npz cannot be read (rate and the times differ in length)" in told
    assert "damping_pinv.npz cannot be read (it has no times)" in told
    assert "observer_robust.npz cannot be read" in told


def test_numbers_that_are_none_are_gaps(flown, tmp_path):
    """A flight that ran away: infinite, not a number, beyond single precision."""
    folder = copy(flown, tmp_path)
    with np.load(flown / "damping_pinv.npz") as kept:
        signals = {name: kept[name].copy() for name in kept.files}
    signals["rate"][9000:] = np.nan
    signals["achieved"][5000:9000] = 1e200
    signals["mrp"][7000:] = np.inf
    signals["status"][9000:] = np.nan
    np.savez(folder / "damping_pinv.npz", **signals)
    flown_again = records.of_folder(folder)
    assert flown_again.lacking == []
    assert flight_page.page_of(flown_again)


def test_what_is_no_flight_is_told(tmp_path):
    with pytest.raises(ReportError, match="is no folder with flights"):
        write_report(tmp_path, tmp_path / "a.html")
    with pytest.raises(ReportError, match=r"a\.pdf has the ending '\.pdf'; a report ends in \.html"):
        write_report(tmp_path, tmp_path / "a.pdf")
    (tmp_path / "summary.json").write_text("{}")
    with pytest.raises(ReportError, match="holds no flight that can be read: summary.json tells of no flight"):
        write_report(tmp_path, tmp_path / "a.html")
    assert not (tmp_path / "a.html").exists()


CRAFT = ["huang2019/nominal", "sun2018/circular_orbit", "shi2020/docking", "tao2019/case1", "satellites/thruster_hold"]


@pytest.mark.slow
def test_the_field_is_drawn_where_it_is(tmp_path):
    """Its direction at the recorded positions, a whole revolution, by the field's own function."""
    mission = casadi_gnc.load("satellites/detumble_bdot")
    flight = casadi_gnc.fly(mission, decimation=100)
    packed = Packed()
    flown = records.of_flights([flight], described(mission, [flight.scheme]), ShownLoops())
    scene = data_of(flown, packed)["schemes"][0]["scene"]
    (arrow,) = [one for one in scene["arrows"] if one["label"] == "field"]
    numbers, ends = zlib.decompress(base64.b64decode(packed.letters())), np.cumsum([0, *packed.counts])
    planes = [np.frombuffer(numbers[4 * ends[i] : 4 * ends[i + 1]], np.uint8).reshape(4, -1) for i in arrow["a"]]
    drawn = np.stack([each.T.copy().view("<f4")[:, 0] for each in planes], axis=1)
    moments = np.unique(np.round(np.linspace(0, len(flight.time) - 1, len(drawn))).astype(int))
    t, r = ca.SX.sym("t"), ca.SX.sym("r", 3)
    field = ca.Function("field", [t, r], [mission.craft.surroundings().field(t, r)])
    for k, seen in list(zip(moments, drawn, strict=True))[::7]:
        true = np.array(field(flight.time[k], flight["position"][k])).ravel()
        angle = np.degrees(np.arccos(np.clip(seen @ true / np.linalg.norm(true) / np.linalg.norm(seen), -1, 1)))
        assert angle < 0.5


@pytest.mark.slow
@pytest.mark.parametrize("name", CRAFT)
def test_loops_of_every_craft(name):
    """A curve of each row of effort; three planes, where the effectiveness stays."""
    mission = casadi_gnc.load(name)
    actuation = mission.schemes[0].actuation
    found = loops_of(mission, [mission.schemes[0].name])
    assert len(found.loops[0].curves) == actuation.effort.size
    assert len(found.slices) == (0 if callable(actuation.effectiveness) else 3)


@pytest.mark.parametrize("name", CRAFT)
def test_every_craft_is_drawn_whole(name, tmp_path):
    """All that its pictures and its scene name is recorded."""
    mission = casadi_gnc.load(name).with_timing(duration=10.0)
    flights = [casadi_gnc.fly(mission)]
    page = flight_page.of_mission(mission, flights, tmp_path / "a.html", ShownLoops()).read_text(encoding="utf-8")
    assert 'id="lacking"' not in page
    data = json.loads(re.search(r'<script type="application/json" id="data">(.*?)</script>', page, re.DOTALL)[1])
    assert data["schemes"][0]["scene"] is not None
