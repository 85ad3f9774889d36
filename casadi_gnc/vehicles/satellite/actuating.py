"""What a satellite's flight software makes of torque: bounds, effectiveness, and who shares it out."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from casadi_gnc.allocation import AllocationProblem, Direct
from casadi_gnc.errors import FlightError
from casadi_gnc.mathematics import bounds
from casadi_gnc.mathematics.exact import array, is_number, is_zero
from casadi_gnc.mechanics.satellite_parts import endless
from casadi_gnc.missions.actuation import Actuation, Actuators
from casadi_gnc.missions.craft import EffortKeys
from casadi_gnc.tables.allocation import Robust
from casadi_gnc.tables.part import MisfitError

from . import part_tables, pulse_tables
from .momentum import MomentumSharing
from .on_board import LeastByField, TorqueByField, WheelLimits

if TYPE_CHECKING:
    from .craft import SatelliteCraft

#: Smallest over largest singular value of the effectiveness below which an axis is left out.
_FLAT = 1e-9
#: Magnetic field [T] of a low orbit, by which the largest torque of coils is guessed.
_FIELD = 3e-5


def actuators(craft: SatelliteCraft, centre: Any) -> Actuators:
    """Return wheels, thrusters and coils as known about a centre of mass [m]."""
    rows = []
    if craft.wheel:
        rows.append(-part_tables.directions(craft.wheel, "axis"))
    torques = part_tables.thrusters(craft.thruster).arms(centre) if craft.thruster else ca.DM(3, 0)
    rows.append(torques)
    fixed = ca.horzcat(*rows)
    most = [each.max_torque_N_m for each in craft.wheel]
    dipoles = [each.max_dipole_A_m2 for each in craft.magnetorquer]
    lower = [-each for each in most] + [each.min_force_N for each in craft.thruster] + [-each for each in dipoles]
    upper = most + [each.max_force_N for each in craft.thruster] + dipoles
    effectiveness: Any = fixed
    if craft.magnetorquer:
        effectiveness = TorqueByField(fixed, part_tables.directions(craft.magnetorquer, "axis"))
    speeds = tuple(each.max_speed for each in craft.wheel)
    limits = None
    if not all(map(endless, speeds)):
        spin = tuple(each.spin_inertia for each in craft.wheel)
        limits = WheelLimits(speeds, spin, tuple(lower), tuple(upper))
    return Actuators(
        effectiveness=effectiveness,
        lower=lower,
        upper=upper,
        reach=None if limits is None else limits.reach,
        judge=None if limits is None else limits.judge,
        modulation=pulse_tables.modulation(
            len(craft.wheel), craft.thruster, len(craft.magnetorquer), craft.valves, torques
        ),
    )


def _spans(axes: Any) -> bool:
    """Return whether columns, (3, N), reach every direction."""
    strength = np.linalg.svd(np.array(ca.DM(axes)), compute_uv=False)
    return len(strength) == 3 and strength[2] > _FLAT * strength[0]


def _reaches(axes: Any) -> bool:
    """Return whether wheels and thrusters reach every direction; raise `FlightError` where that varies."""
    if axes.shape[1] < 3:
        return False
    if not is_number(axes):
        raise FlightError("whether coils have to help follows from it, so the way torque is shared out does")
    return _spans(axes)


def sharing(craft: SatelliteCraft) -> MomentumSharing | None:
    """Return how torque is shared out where wheels are looked after; None: as the scheme's allocation does."""
    told, wheels = craft.momentum, part_tables.wheels(craft.wheel) if craft.wheel else None
    if is_zero(told.unload_per_s) and is_zero(told.null_per_s):
        return None
    if wheels is None or (is_number(wheels.axes) and not _spans(wheels.axes)):
        raise MisfitError("wheels that are looked after have to make torque about every axis by themselves", "momentum")
    rest = told.rest_speeds_rad_per_s or [0.0] * wheels.count
    if len(rest) != wheels.count:
        message = f"{len(rest)} speeds, and there are {wheels.count} wheels"
        raise MisfitError(message, "momentum", "rest_speeds_rad_per_s")
    coils, dipoles = ca.DM(3, 0), ca.DM(0, 1)
    if not is_zero(told.unload_per_s):
        if not craft.magnetorquer:
            raise MisfitError("coils take momentum away; give [[magnetorquer]]", "momentum", "unload_per_s")
        coils = part_tables.directions(craft.magnetorquer, "axis")
        dipoles = array([each.max_dipole_A_m2 for each in craft.magnetorquer])
        if is_number(coils) and np.linalg.matrix_rank(np.array(coils), tol=1e-6) < min(len(craft.magnetorquer), 3):
            raise MisfitError("the coils' axes lie in one line or plane; turn one", "magnetorquer")
    idle = len(craft.magnetorquer) - coils.shape[1]
    return MomentumSharing(
        wheels.axes,
        array(wheels.spin_inertia),
        coils,
        dipoles,
        told.unload_per_s,
        told.null_per_s,
        array(rest),
        len(craft.thruster),
        idle,
    )


def actuation(craft: SatelliteCraft, known: Actuators, told: EffortKeys) -> Actuation:
    """Return the actuation of a scheme; where wheels are looked after, their sharing takes the allocation's place."""
    limit, shared, keys = told.effort_limit or _most(craft, known), sharing(craft), told.allocation
    if isinstance(keys, Robust):
        if shared is not None:
            message = "[momentum] shares the torque out itself; leave the robust allocation or [momentum] out"
            raise MisfitError(message, "allocation", "method")
        if callable(known.effectiveness):
            message = "the torque of coils follows the field, and robust allocation needs one that stays"
            raise MisfitError(message, "allocation", "method")
        effectiveness = np.array(known.fixed)
        problem = AllocationProblem(effectiveness, lower=known.lower, upper=known.upper, **keys.weights())
        return Actuation.of(known, limit, keys.allocator(problem))
    if shared is not None:
        return Actuation.of(replace(known, inverse=shared), limit, Direct())
    by_field = known.effectiveness
    if isinstance(by_field, TorqueByField) and not _reaches(by_field.fixed):
        return Actuation.of(replace(known, inverse=LeastByField(by_field)), limit, Direct())
    return Actuation.of(known, limit, keys.allocator(None))


def _most(craft: SatelliteCraft, known: Actuators) -> list[Any]:
    """Return the largest torque about each axis, coils in a field of the Earth's strength."""
    fixed: Any = known.effectiveness
    most = [0.0, 0.0, 0.0]
    if isinstance(fixed, TorqueByField):
        strength = _FIELD * sum(each.max_dipole_A_m2 for each in craft.magnetorquer)
        fixed, most = fixed.fixed, [strength] * 3
    bound = bounds.maximum(ca.fabs(array(known.lower)), ca.fabs(array(known.upper)))
    made = ca.mtimes(ca.fabs(fixed), bound[: fixed.shape[1]])
    return [value + own for value, own in zip(most, array(made).elements(), strict=True)]


def flaws(craft: SatelliteCraft, known: Actuators) -> Iterator[MisfitError]:
    """Yield whether wheels and thrusters leave an axis out."""
    if craft.magnetorquer:
        coils = np.array(ca.DM(part_tables.directions(craft.magnetorquer, "axis")))
        if not (craft.wheel or craft.thruster) and np.linalg.matrix_rank(coils, tol=1e-6) < 2:
            yield MisfitError("coils along one axis make torque about one direction alone; turn one", "magnetorquer")
        return
    made = np.array(ca.DM(known.matrix(None)))
    strength = np.linalg.svd(made, compute_uv=False)
    if len(strength) < 3 or strength[2] < _FLAT * strength[0]:
        what = " and ".join(name for name, there in (("wheels", craft.wheel), ("thrusters", craft.thruster)) if there)
        key = "wheel" if craft.wheel else "thruster"
        flat = np.linalg.svd(made)[0][:, -1]
        axis = ", ".join(f"{value + 0.0:.3g}" for value in flat)
        yield MisfitError(f"the {what} make no torque about the axis ({axis}); add or turn one", key)
