"""Contract tests of every kind of guest, one function a kind; the house's own are tested by the same.

Each takes what is to be tested and raises `ContractError`, an AssertionError whose sentence says what is not kept:

>>> import casadi_gnc as gnc
>>> from casadi_gnc import testing
>>> testing.check_law(gnc.load("huang2020/detumble"), "observer_pinv")
>>> testing.check_plant(gnc.load("huang2020/detumble"))

`check_mission` does the craft, its plant and every law, and flies some samples on both engines; a test of your
own folder is one line: `testing.check_mission(gnc.load("mission.toml"))`.
"""

from casadi_gnc.testing.allocation import check_allocation_backend
from casadi_gnc.testing.asserting import ContractError
from casadi_gnc.testing.craft import check_craft, check_mission
from casadi_gnc.testing.family import check_family
from casadi_gnc.testing.law import check_law
from casadi_gnc.testing.plant import check_plant
from casadi_gnc.testing.synthesis import check_lmi_backend, check_recipe
from casadi_gnc.testing.target import check_target

__all__ = [
    "ContractError",
    "check_allocation_backend",
    "check_craft",
    "check_family",
    "check_law",
    "check_lmi_backend",
    "check_mission",
    "check_plant",
    "check_recipe",
    "check_target",
]
