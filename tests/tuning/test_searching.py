"""A search over formulas in the place of flights, whose smallest breaks are known in closed form."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from casadi_gnc.campaigns import Choice, Normal, Uniform
from casadi_gnc.errors import CampaignError
from casadi_gnc.tuning.descending import Effort
from casadi_gnc.tuning.flights import THERE_AND_BACK, Flights
from casadi_gnc.tuning.journal import Journal
from casadi_gnc.tuning.reach import Reach
from casadi_gnc.tuning.searching import search
from casadi_gnc.tuning.shrinking import fewest, smallest
from casadi_gnc.tuning.space import Space


class Formula:
    """A build whose number is a formula of a row, with derivatives by another formula or without."""

    changes: dict = {}
    why = ""

    def __init__(self, of, derivatives=None):
        self.of, self.derivatives, self.count = of, derivatives, 0

    def at(self, rows):
        self.count += len(rows)
        return np.array([self.of(row) for row in rows])

    def gradient(self, row):
        return None if self.derivatives is None else np.array(self.derivatives(row), dtype=float)


def space_of(*laws, nominal=None):
    keys = [f"k{i}" for i in range(len(laws))]
    return Space(keys, keys, laws, np.zeros(len(laws)) if nominal is None else np.array(nominal, dtype=float))


def looked(formulas, space, most=2000, journal=None, derivatives=None, **set_of):
    """Return the flights, the first break, the smallest, the one of fewest dispersions, and the effort."""
    flights = Flights([Formula(each, derivatives) for each in formulas], space, journal or Journal({}), most)
    reach, effort = Reach(space, **set_of), Effort()
    first = search(flights, reach, 0, effort)
    if first is None:
        return flights, None, None, None, effort
    near = smallest(flights, reach, first, 0, effort)
    return flights, first, near, fewest(flights, reach, near), effort


NORMAL = Normal(0.0, 1.0)


def test_a_half_space_is_found_at_once_and_its_nearest_point_is():
    """The distance of a half space is its offset over the length of its normal; irrelevant numbers stay nominal."""
    along = np.array([3.0, 0.0, -4.0, 0.0, 0.0, 0.0])
    found = looked([lambda row: 3.0 - along @ row / 5.0], space_of(*[NORMAL] * 6))
    flights, first, near, few, _ = found
    assert flights.path[1].flights == 1 + 6 + 1  # the nominal, a slope, and the end of the way down
    assert first.broken
    space = flights.space
    assert space.distance(near.point)[0] == pytest.approx(3.0, rel=0.01)
    assert space.distance(near.point)[0] >= 3.0
    assert np.isnan(few.point).tolist() == [False, True, False, True, True, True]


def test_a_half_space_is_found_by_one_slope_there_and_back():
    along = np.array([3.0, 0.0, -4.0, 0.0, 0.0, 0.0])
    found = looked([lambda row: 3.0 - along @ row / 5.0], space_of(*[NORMAL] * 6), derivatives=lambda row: -along / 5.0)
    flights, first, near, _, effort = found
    assert flights.path[1].flights == 1 + THERE_AND_BACK + 1
    assert first.broken
    assert flights.space.distance(near.point)[0] == pytest.approx(3.0, rel=0.01)
    assert (effort.derivatives > 0, effort.differences) == (True, 0)


@pytest.mark.parametrize("wrong", [-1.0, 0.0, math.nan])
def test_derivatives_that_lead_nowhere_give_way_to_differences(wrong):
    """The decided side of a switch says nothing of the other: derivatives uphill, flat, or none; a break at z1 = 3."""
    found = looked(
        [lambda row: 3.0 - row[0]], space_of(*[NORMAL] * 6), derivatives=lambda row: [wrong * -1.0] + [0.0] * 5
    )
    _, first, _, _, effort = found
    assert first.broken
    assert effort.derivatives > 0
    assert effort.differences > 0


def test_a_curved_boundary_s_nearest_point_by_its_own_minimum():
    """On z1 + z2^2/4 = 2 the square of the distance, z1^2 + 8 - 4 z1, is least at z1 = 2: the distance is 2."""
    flights, _, near, few, _ = looked([lambda row: 2.0 - row[0] - 0.25 * row[1] ** 2], space_of(NORMAL, NORMAL))
    assert flights.space.distance(near.point)[0] == pytest.approx(2.0, rel=0.02)
    assert np.isnan(few.point).tolist() == [False, True]


def test_stairs_without_slope_are_climbed_down_by_sampling():
    """A number that goes in steps of 0.5, as sampled times do, has no small slope; it breaks above 3.2 of |z|."""
    space = space_of(*[NORMAL] * 3)
    _, first, near, _, effort = looked([lambda row: 3.2 - 0.5 * math.floor(2.0 * math.sqrt(row @ row) + 1e-9)], space)
    assert first.broken
    assert effort.sampled > 0
    assert 3.5 <= space.distance(near.point)[0] <= 3.6


def test_a_pocket_between_the_slopes_is_found_by_the_plan():
    """A flat number with a pocket of a fifth of the square is seen by no slope and no end."""
    space = space_of(Uniform(-1.0, 1.0), Uniform(-1.0, 1.0))
    _, first, _, _, effort = looked(
        [lambda row: -1.0 if abs(row[0] - 0.6) < 0.25 and abs(row[1] + 0.5) < 0.4 else 1.0], space
    )
    assert first.broken
    assert effort.sampled > 0


def test_two_choices_that_break_together_only():
    choice = Choice(((0.0,), (1.0,), (2.0,)), weights=(0.98, 0.01, 0.01))
    space = space_of(choice, choice, choice, NORMAL)
    flights, _, near, few, _ = looked(
        [lambda row: -1.0 if row[0] == 2.0 and row[2] == 1.0 else 1.0 + 0.01 * row[3]], space
    )
    assert space.rows(near.point[None, :])[0, :3].tolist() == [2.0, 0.0, 1.0]
    assert space.distance(few.point)[0] == 0.0
    assert flights.count < 200


def test_the_build_that_breaks_and_the_coordinate_that_it_needs():
    space = space_of(NORMAL, NORMAL)
    _, first, near, _, _ = looked([lambda row: 1.0, lambda row: 3.0 - row[1]], space)
    assert (first.of, near.of) == (1, 1)
    assert space.distance(near.point)[0] == pytest.approx(3.0, rel=0.01)


@pytest.mark.parametrize(("kind", "least"), [("box", 6.0 - 4.0 * 2), ("contour", 6.0 - 4.0 * math.sqrt(2.0))])
def test_no_break_leaves_what_the_set_allows(kind, least):
    """The least of 6 - z1 - z2 in the box of 4 is -2: a break; on the contour 0.343: none."""
    space = space_of(NORMAL, NORMAL)
    flights, first, _, _, effort = looked([lambda row: 6.0 - row[0] - row[1]], space, most=300, kind=kind)
    if least < 0:
        assert first is not None
    else:
        assert first is None
        assert flights.lowest.value == pytest.approx(least, abs=1e-6)
        assert flights.count <= 300
        assert effort.plan >= 64


def test_sets_are_what_they_say():
    space = space_of(Normal(0.0, 1.0, truncate=3.0), NORMAL, Uniform(-1.0, 1.0))
    far = np.array([[9.0, 9.0, 9.0]])
    assert Reach(space, "box", 4.0).nearest(far)[0].tolist() == [3.0, 4.0, 1.0]
    assert Reach(space, "contour", 4.0).nearest(far)[0] == pytest.approx([2.4, 3.2, 1.0])
    assert Reach(space, "ellipsoid", 4.0).nearest(far)[0] == pytest.approx(np.array([3.0, 4.0, 1.0]) / math.sqrt(3.0))
    inside = np.array([[0.5, math.nan, -0.2]])
    for kind in ("box", "contour", "ellipsoid"):
        assert Reach(space, kind, 4.0).nearest(inside)[0, [0, 2]].tolist() == [0.5, -0.2]
    with pytest.raises(CampaignError, match="'ball'; expected one of contour, box, ellipsoid"):
        Reach(space, "ball")
    with pytest.raises(CampaignError, match="reaches 9 standard deviations"):
        Reach(space, "box", 9.0)


@pytest.mark.parametrize("exact", [False, True])
def test_a_search_that_was_killed_goes_on_word_for_word(tmp_path, exact):
    """Whatever of the journal is left, a whole number of lines and a torn one, the search ends as it would have."""

    def number(row):
        return 3.0 - 0.6 * row[0] - 0.8 * row[1] + 0.05 * row[2] ** 2

    def slope(row):
        return [-0.6, -0.8, 0.1 * row[2], 0.0, 0.0]

    space, place = space_of(*[NORMAL] * 5), tmp_path / "journal"
    more = {"derivatives": slope if exact else None}
    whole, *right = looked([number], space, journal=Journal({"a": 1}, place), **more)[:4]
    lines = place.read_bytes().splitlines(keepends=True)
    assert len(lines) > 5
    for kept in (1, 3, len(lines) - 1):
        place.write_bytes(b"".join(lines[:kept]) + lines[kept][: len(lines[kept]) // 2])
        journal = Journal({"a": 1}, place)
        flights, *again = looked([number], space, journal=journal, **more)[:4]
        told = [json.loads(line) for line in lines[1:kept]]
        known = sum(THERE_AND_BACK if "gradient" in one else len(one["rows"]) for one in told)
        assert flights.flown == whole.count - known
        assert flights.path == whole.path
        assert all(np.array_equal(a.point, b.point, equal_nan=True) for a, b in zip(right, again, strict=True))
        assert place.read_bytes() == b"".join(lines)
    with pytest.raises(CampaignError, match="is the journal of another search"):
        Journal({"a": 2}, place)
    place.write_bytes(lines[0] + b"{}\n")
    with pytest.raises(CampaignError, match="cannot be read"):
        Journal({"a": 1}, place)


def test_numbers_without_end_and_none_are_kept(tmp_path):
    rows = np.arange(3.0)[:, None]
    Journal({}, tmp_path / "j").note(0, rows, np.array([-math.inf, math.nan, 0.1]))
    found = Journal({}, tmp_path / "j").numbers(0, rows)
    assert found[0] == -math.inf
    assert math.isnan(found[1])
    assert found[2] == 0.1
