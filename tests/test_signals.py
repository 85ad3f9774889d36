import casadi as ca
import numpy as np
import pytest

from casadi_gnc.signals import Layout, Signal

LAYOUT = Layout((Signal("mrp", 3), Signal("mass", 1, "kg"), Signal("rate", 3, "rad/s", limit=2.0)))


def test_places_cover_the_column_once():
    rows = [i for name in LAYOUT.names for i in range(LAYOUT.size)[LAYOUT.place(name)]]
    assert rows == list(range(LAYOUT.size)) == list(range(7))


def test_pack_undoes_split():
    column = ca.DM(range(7))
    assert np.array_equal(np.array(LAYOUT.pack(**vars(LAYOUT.split(column)))), np.array(column))


def test_columns_have_the_shape_of_the_signal():
    parts = LAYOUT.columns(np.arange(14.0).reshape(2, 7))
    assert parts["mrp"].shape == (2, 3)
    assert parts["mass"].shape == (2,)
    assert LAYOUT.limits() == [np.inf] * 4 + [2.0] * 3


def test_wrong_parts_are_named():
    with pytest.raises(KeyError, match="expected mrp, mass, rate"):
        LAYOUT.pack(mrp=ca.DM(3, 1))
    with pytest.raises(ValueError, match="mrp has 2 elements, expected 3"):
        LAYOUT.pack(mrp=ca.DM(2, 1), mass=1.0, rate=ca.DM(3, 1))
    with pytest.raises(KeyError, match="no signal 'spin'; there is mrp, mass, rate"):
        LAYOUT.place("spin")
    with pytest.raises(ValueError, match="repeat"):
        Layout((Signal("a"), Signal("a")))
    with pytest.raises(ValueError, match="no.* identifier"):
        Signal("two words")
