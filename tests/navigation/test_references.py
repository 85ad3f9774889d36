"""Truth: fine differences of the attitude along a closed-form orbit, and where each kind has to look."""

import math
from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from casadi_gnc.errors import GncError, LawError
from casadi_gnc.mechanics import earth, quaternions
from casadi_gnc.mechanics.earth import Epoch
from casadi_gnc.mechanics.orbits import Elements, Orbit
from casadi_gnc.navigation import GroundTarget, Inertial, Nadir, Slew, SunPointing, Table, Timeline

EPOCH = Epoch.of("2026-11-27T12:00:00")
ELEMENTS = Elements(6.95e6, 0.02, 1.2, 0.4, 0.3, 0.2)
TURNED = [0.8, 0.0, 0.6, 0.0]
TIMES = [0.0, 40.0, 70.0, 130.0, 180.0]
ROWS = [list(map(float, quaternions.from_321(0.01 * t, 0.3 * math.sin(0.03 * t), -0.2).nonzeros())) for t in TIMES]
SLEW = Slew((1.0, 0, 0, 0), (0.5, 0.5, -0.5, 0.5), rate=math.radians(1.5), acceleration=math.radians(0.05), start=20.0)
KINDS = {
    "inertial": Inertial(TURNED),
    "nadir": Nadir(),
    "nadir turned": Nadir(TURNED),
    "sun": SunPointing(EPOCH, (0.0, -1.0, 0.0)),
    "ground": GroundTarget(EPOCH, math.radians(48.8), math.radians(9.2), 400.0),
    "slew": SLEW,
    "table": Table(TIMES, ROWS),
    "timeline": Timeline([(0.0, Nadir()), (100.0, SLEW)]),
    "turns": Timeline(
        [(0.0, Nadir()), (20.0, SunPointing(EPOCH)), (110.0, GroundTarget(EPOCH, 0.85, 0.16)), (150.0, SLEW)],
        [0.0, 60.0, 20.0, 50.0],
    ),
}


def dense(value) -> np.ndarray:
    return np.array(ca.DM(value)).squeeze()


def along(reference) -> ca.Function:
    """Return attitude, rate, acceleration by time, on the orbit."""
    t = ca.SX.sym("t")
    position, velocity = Orbit(ELEMENTS).at(t)
    wanted = reference.at(t, SimpleNamespace(position=position, velocity=velocity))
    return ca.Function("along", [t], [wanted.quaternion, wanted.rate, wanted.acceleration, position, velocity])


@pytest.mark.parametrize("name", KINDS)
def test_attitude_rate_and_acceleration_belong_together(name):
    """Central differences over 0.02 s; what they leave is h^2/6 of third derivatives, and rounding over h."""
    wanted, h = along(KINDS[name]), 0.01
    for t in (0.7, 33.0, 61.3, 117.9, 163.1, 1000.0):
        q, rate, acceleration, _, _ = (dense(each) for each in wanted(t))
        before, after = ([dense(each) for each in wanted(t + step)] for step in (-h, h))
        assert np.linalg.norm(q) == pytest.approx(1, abs=1e-14)
        turn = dense(quaternions.to_rotation_vector(quaternions.relative(ca.DM(after[0]), ca.DM(before[0]))))
        assert np.allclose(turn / (2 * h), rate, atol=1e-7), t
        assert np.allclose((after[1] - before[1]) / (2 * h), acceleration, atol=1e-8), t


def test_nadir_looks_down_and_turns_once_a_revolution():
    wanted = along(Nadir())
    for t in (0.0, 1000.0):
        q, rate, _, r, v = (dense(each) for each in wanted(t))
        frame = dense(quaternions.dcm(ca.DM(q)))
        assert np.allclose(frame[2], -r / np.linalg.norm(r), atol=1e-14)
        assert frame[0] @ v > 0.999 * np.linalg.norm(v)
        h = np.cross(r, v)
        assert np.allclose(rate, [0, -float(np.linalg.norm(h) / (r @ r)), 0], atol=1e-15)


def test_sun_and_ground_are_looked_at():
    t = 777.0
    q, *_ = (dense(each) for each in along(KINDS["sun"])(t))
    sun = dense(quaternions.turned(ca.DM(q), EPOCH.sun(t)[0]))
    assert np.allclose(sun / np.linalg.norm(sun), [0, -1, 0], atol=1e-14)
    q, _, _, r, _ = (dense(each) for each in along(KINDS["ground"])(t))
    place = dense(EPOCH.to_earth(t)).T @ dense(earth.place(math.radians(48.8), math.radians(9.2), 400.0))
    seen = dense(quaternions.turned(ca.DM(q), ca.DM(place - r)))
    assert np.allclose(seen / np.linalg.norm(seen), [0, 0, 1], atol=1e-13)


@pytest.mark.parametrize(("rate", "acceleration"), [(1.5, 0.05), (30.0, 0.05), (0.2, 5.0)])
def test_a_slew_keeps_its_limits_and_arrives(rate, acceleration):
    """120 degrees; the profile lasts angle/rate + rate/acceleration, or 2 sqrt(angle/acceleration)."""
    rate, acceleration = math.radians(rate), math.radians(acceleration)
    slew, angle = Slew(SLEW.first, SLEW.last, rate, acceleration, 20.0), math.radians(120)
    short = rate**2 / acceleration > angle
    whole = 2 * math.sqrt(angle / acceleration) if short else angle / rate + rate / acceleration
    assert slew.times[1] == pytest.approx(whole, rel=1e-14)
    wanted = along(slew)
    for t in np.linspace(0, whole + 40, 200):
        q, w, a, _, _ = (dense(each) for each in wanted(t))
        assert np.linalg.norm(w) <= rate * (1 + 1e-12)
        assert np.linalg.norm(a) <= acceleration * (1 + 1e-12)
    q, w, *_ = (dense(each) for each in wanted(whole + 40))
    assert np.allclose(q, SLEW.last, atol=1e-14)
    assert not w.any()
    assert np.allclose(dense(wanted(10.0)[0]), SLEW.first)


def test_no_turn_is_no_slew():
    still = Slew(TURNED, [-each for each in TURNED], 0.1, 0.1)
    assert np.array_equal(dense(still.at(5.0, None).quaternion), TURNED)


def test_a_table_is_a_natural_spline():
    """scipy's spline of the elements, normalised; outside the table the attitude stands."""
    flipped = [[-each for each in row] if i % 2 else row for i, row in enumerate(ROWS)]
    wanted, spline = along(Table(TIMES, flipped)), CubicSpline(TIMES, ROWS, bc_type="natural")
    for t in (0.0, 13.0, 40.0, 99.0, 179.9):
        q = spline(t) / np.linalg.norm(spline(t))
        assert np.allclose(dense(wanted(t)[0]), q, atol=1e-13)
    for t, row in ((-5.0, ROWS[0]), (400.0, ROWS[-1])):
        q, w, a, _, _ = (dense(each) for each in wanted(t))
        assert np.allclose(q, row)
        assert not w.any()
        assert not a.any()


def test_a_table_comes_from_a_file(tmp_path):
    file = tmp_path / "attitudes.csv"
    lines = [",".join(map(repr, [t, *row])) for t, row in zip(TIMES, ROWS, strict=True)]
    file.write_text("\n".join(["t, q0, q1, q2, q3", *lines]))
    assert Table.read(file).quaternions == Table(TIMES, ROWS).quaternions
    for text, told in (
        ("t,a,b,c,d\n", "attitudes.csv, line 1: has the columns t, a, b, c, d, expected t, q0, q1, q2, q3"),
        ("t,q0,q1,q2,q3\n0,1,0,0,x\n", "attitudes.csv, line 2, column q3: 'x' is no number"),
        ("t,q0,q1,q2,q3\n0,1,0,0,0\n", "1 times and 1 attitudes"),
        ("t,q0,q1,q2,q3\n\n# note\n0,1,0,0,0\n0,1,0,0,0\n", "attitudes.csv, line 5: row 2 of the table is at 0 s"),
        ("t,q0,q1,q2,q3\n0,1,0,0,0\n1,1,1,0,0\n", "attitudes.csv, line 3: row 2 of the table, .* is no unit"),
        ("t,q0,q1,q2,q3\n0,1,0,0,0\n9,0,1,0,0\n", "attitudes.csv, line 3: the table jumps by 180 degrees"),
        ("t,q0,q1,q2,q3\n0,1,0,0,0\nnan,1,0,0,0\n", "attitudes.csv, line 3: row 2 of the table is at nan s"),
    ):
        file.write_text(text)
        with pytest.raises(GncError, match=told):
            Table.read(file)


def test_a_timeline_changes_at_its_times():
    wanted, nadir = along(KINDS["timeline"]), along(Nadir())
    for t, one in ((99.9, nadir), (100.0, along(SLEW))):
        assert all(np.array_equal(dense(a), dense(b)) for a, b in zip(wanted(t), one(t), strict=True))


def test_a_turn_between_attitudes_that_stay_is_about_one_axis_and_jerks_nowhere():
    """By hand: half of the turn after half of the time, at 15/8 of the mean rate; 53/512 of it after a quarter."""
    axis, angle = np.array([0.6, 0.0, -0.8]), 2.0
    last = [math.cos(angle / 2), *(math.sin(angle / 2) * axis)]
    wanted = along(Timeline([(0.0, Inertial()), (10.0, Inertial(last))], [0.0, 40.0]))
    for t, share, speed, push in (
        (10.0, 0.0, 0.0, 0.0),
        (20.0, 53 / 512, 30 * 9 / 256, 60 * 3 / 32),
        (30.0, 0.5, 15 / 8, 0.0),
        (50.0, 1.0, 0.0, 0.0),
    ):
        q, rate, acceleration, *_ = (dense(each) for each in wanted(t))
        assert np.allclose(dense(quaternions.to_rotation_vector(ca.DM(q))), share * angle * axis, atol=1e-14)
        assert np.allclose(rate, speed * angle / 40 * axis, atol=1e-15)
        assert np.allclose(acceleration, push * angle / 1600 * axis, atol=1e-15)


def test_a_turn_takes_attitude_rate_and_acceleration_from_one_to_the_other():
    before, after = Nadir(), SunPointing(EPOCH)
    joined = along(Timeline([(0.0, before), (20.0, after)], [0.0, 60.0]))
    for at, one in ((20.0, before), (80.0, after)):
        for found, expected in zip(joined(at), along(one)(at), strict=True):
            assert np.allclose(np.abs(dense(found)), np.abs(dense(expected)), rtol=1e-12, atol=1e-15)


def test_the_euler_axis_stays():
    """Every attitude of a slew is a turn about one axis from the first."""
    wanted = along(SLEW)
    first = Rotation.from_quat(SLEW.first, scalar_first=True)
    for t in (30.0, 60.0, 90.0):
        turn = (first.inv() * Rotation.from_quat(dense(wanted(t)[0]), scalar_first=True)).as_rotvec()
        assert np.allclose(turn / np.linalg.norm(turn), np.array([1, -1, 1]) / math.sqrt(3), atol=1e-12)


@pytest.mark.parametrize(
    ("make", "told"),
    [
        (lambda: Table([0, 1], [TURNED, [0.6, 0.0, -0.8, 0.0]]), "jumps by 180 degrees from 0 s to 1 s"),
        (lambda: Table([0, 0], [TURNED, TURNED]), "row 2 of the table is at 0 s, not after row 1, 0 s"),
        (lambda: Table([0, 1], [TURNED, [1, 1, 0, 0]]), "row 2 of the table.*no unit quaternion"),
        (lambda: Table([0], [TURNED]), "1 times and 1 attitudes, expected as many, 2 to 200 rows"),
        (lambda: Slew(TURNED, TURNED, 0.0, 1.0), "slew's rate is 0, expected more than 0"),
        (lambda: Timeline([]), "from no s on, expected one or more"),
        (lambda: Timeline([(0.0, Nadir())], [1.0]), "a turn of 1 s to the first reference, which has none before it"),
        (lambda: Timeline([(0.0, Nadir())], [0.0, 1.0]), "2 turns to 1 references, expected one to each"),
        (lambda: Timeline([(0.0, Nadir()), (1.0, Nadir())], [0.0, -1.0]), "a turn of -1 s from 1 s on, expected 0"),
        (
            lambda: Timeline([(0.0, Nadir()), (1.0, Nadir()), (2.0, Nadir())], [0.0, 3.0, 0.0]),
            "a turn of 3 s from 1 s on, expected 0 or more, and an end before 2 s",
        ),
        (lambda: Timeline([(1.0, Inertial()), (1.0, Nadir())]), "from 1, 1 s on, expected one or more, with rising"),
    ],
)
def test_references_that_cannot_be(make, told):
    with pytest.raises(LawError, match=told):
        make()
