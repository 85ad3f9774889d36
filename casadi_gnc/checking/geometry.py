"""Is the craft's geometry one: actuators that make every effort, inertias that bodies can have?"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import casadi as ca
import numpy as np

from casadi_gnc.checking import authority
from casadi_gnc.checking.authority import believed
from casadi_gnc.checks import Check
from casadi_gnc.mathematics import exact
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.scheme import Scheme
from casadi_gnc.tables.disturbances import OrbitAndTorque

#: Angle [rad] by which a frame may turn in a flight and still be taken to stand.
_STANDS = 0.01
#: Angle [rad] beyond which two frames are no longer one frame badly aligned.
_ALIGNED = 0.2
#: Share of the true inertia by which the axes of the believed one may be off: products that are not known well.
_TURNED = 0.05
#: Largest condition number of the effectiveness that is no nuisance.
_WELL_CONDITIONED = 100.0


def checks(mission: Mission, scheme: Scheme) -> Iterator[Check]:
    """Yield rank and conditioning of the effectiveness, and the inertias."""
    matrix = scale(scheme) @ believed(mission, scheme)
    strength = np.linalg.svd(matrix, compute_uv=False)
    rank_gap = float(strength[-1] / strength[0]) if strength[0] > 0 else 0.0
    follows = callable(scheme.actuation.effectiveness)
    yield Check(
        "geometry.effectiveness",
        rank_gap,
        1e-6,
        "-",
        "note" if follows else "fail",
        f"Some effort cannot be made by any combination of the actuators{authority.AT_FIRST if follows else ''}.",
        authority.FOLLOWS if follows else "Add or turn an actuator.",
        "smallest over largest singular value of the effectiveness, rows scaled by their limits",
        at_least=True,
    )
    conditioning = 1 / rank_gap if rank_gap > 0 else float("inf")
    yield Check(
        "geometry.conditioning",
        conditioning,
        _WELL_CONDITIONED,
        "-",
        "note" if follows else "warn",
        f"Some effort costs the actuators very much more than another{authority.AT_FIRST if follows else ''}.",
        authority.FOLLOWS if follows else "Turn the actuators, or fit the limits of the effort to what they make.",
        "condition number of the effectiveness, rows scaled by their limits",
    )
    told = {"believed": scheme.law.believed_inertia(), **mission.truth.inertias()}
    known = {whose: np.array(ca.DM(one)) for whose, one in told.items() if one is not None and exact.is_number(one)}
    for whose, inertia in known.items():
        yield triangle(f"geometry.{whose}_inertia", inertia)
    if "believed" in known and len(known) > 1:
        yield turned_inertia(known.pop("believed"), list(known.values()))


def scale(scheme: Scheme) -> np.ndarray:
    """Return the matrix that scales efforts by their limits, (R, R); zero where nothing may be asked for."""
    below, above = (np.abs(np.array(each)) for each in (scheme.actuation.limit_below, scheme.actuation.limit_above))
    most = np.maximum(below, above)
    return np.diag(1 / np.where(most > 0, most, np.inf))


def triangle(name: str, inertia: np.ndarray) -> Check:
    """Return how far an inertia, (3, 3), is from that of a flat plate, which no body passes."""
    least, middle, largest = np.linalg.eigvalsh(inertia)
    return Check(
        name,
        float(min(least, least + middle - largest) / largest),
        0.0,
        "-",
        "fail",
        "No body has this inertia: a moment is negative or larger than the two others together.",
        "Correct the inertia.",
        "smallest principal moment, and the two smaller less the largest, over the largest",
        at_least=True,
    )


def turned_inertia(believed: np.ndarray, true: list[np.ndarray]) -> Check:
    """Return how far a believed inertia, (3, 3), differs by its axes alone from the one, (3, 3), that it is nearest to.

    Of two inertias the principal moments, sorted, differ by no more than the matrices do (Hoffman and Wielandt, 1953,
    doi:10.1215/S0012-7094-53-02004-3), and by as much where both have the same axes: what is left is what a turn makes.
    """
    shares = []
    for inertia in true:
        whole = np.linalg.norm(believed - inertia)
        moments = np.linalg.norm(np.linalg.eigvalsh(believed) - np.linalg.eigvalsh(inertia))
        shares.append(np.sqrt(max(whole**2 - moments**2, 0.0)) / np.linalg.norm(inertia))
    return Check(
        "geometry.believed_turn",
        float(min(shares)),
        _TURNED,
        "-",
        "warn",
        "The law believes in principal axes that the craft does not have; its inertia may be in another frame.",
        "Give the believed inertia in the frame of the measured rate, with its products.",
        "difference of the inertias that their principal moments do not account for, over the true one",
    )


def orbit_frame(environment: OrbitAndTorque, mission: Mission) -> Iterator[Check]:
    """Yield the angle by which the orbit frame turns in a flight under an attitude that is held as to where it was."""
    if environment.frame_rate == 0 and "mrp" in mission.target:
        yield Check(
            "geometry.orbit_frame",
            environment.orbit_rate_rad_per_s * mission.timing.duration,
            _STANDS,
            "rad",
            "note",
            "The attitude is told from the orbit frame as it is at t = 0; the real one turns away under the flight.",
            'Add environment.corrected = ["orbit_frame_rate"] where the attitude is meant to follow the orbit.',
            "orbit rate times duration",
        )


def believed_axes(known: Any, believed: Any) -> Check:
    """Return the angle between the axes of attitude and rate and those in which actuators are believed, (3, 3) each."""
    turn = np.array(ca.DM(known)).T @ np.array(ca.DM(believed))
    return Check(
        "geometry.believed_axes",
        float(np.arccos(np.clip((np.trace(turn) - 1) / 2, -1.0, 1.0))),
        _ALIGNED,
        "rad",
        "fail",
        "The software commands its actuators in other axes than those in which it measures attitude and rate.",
        "Give inertia, actuators and limits of the effort in one frame: that of the measured rate.",
        "angle of the rotation between both frames, against the largest error of an alignment",
    )


def rotation(name: str, matrix: Any, consequence: str, remedy: str) -> Check:
    """Return how far a matrix, (3, 3), is from a rotation."""
    turned = np.array(ca.DM(matrix))
    residual = float(max(np.abs(turned @ turned.T - np.eye(3)).max(), abs(np.linalg.det(turned) - 1)))
    return Check(name, residual, 1e-3, "-", "warn", consequence, remedy, "largest entry of R R' - I, and det R - 1")
