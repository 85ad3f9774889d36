"""What a picture in space shows of a craft: how it lies, where it is, what pushes and what spins."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from casadi_gnc.signals import Layout


@dataclass(frozen=True)
class Jets:
    """Say where thrusters push.

    Parameters
    ----------
    signal : recorded forces, (N,), [N].
    positions : (N, 3), [m], from the centre of mass, body frame.
    directions : (N, 3), of the force on the craft, unit vectors, body frame.
    most : (N,), the largest force of each, [N].
    """

    signal: str
    positions: Sequence[Sequence[float]]
    directions: Sequence[Sequence[float]]
    most: Sequence[float]


@dataclass(frozen=True)
class Spinners:
    """Say about what wheels turn.

    Parameters
    ----------
    signal : recorded speeds, (N,), [rad/s].
    axes : (N, 3), body frame.
    """

    signal: str
    axes: Sequence[Sequence[float]]


@dataclass(frozen=True)
class Arrow:
    """Draw a recorded vector of three numbers from the craft.

    Parameters
    ----------
    signal, label : its name, and what the reader is told.
    frame : in which it is resolved.
    reversed : draw it the other way: a position from the Earth's centre, reversed, points down.
    """

    signal: str
    label: str
    frame: Literal["body", "reference"] = "body"
    reversed: bool = False


@dataclass(frozen=True)
class Direction:
    """Draw a direction that stays during a flight, such as that of the sun.

    Parameters
    ----------
    label : what the reader is told.
    vector : (3,), unit vector, reference frame.
    """

    label: str
    vector: Sequence[float]


@dataclass(frozen=True)
class Track:
    """Draw a direction that moves during a flight and is not recorded, such as that of the magnetic field.

    Parameters
    ----------
    label : what the reader is told.
    times : (K,), increasing, [s]; between two of them the direction goes straight on, outside it stays.
    vectors : (K, 3), unit vectors, reference frame.
    """

    label: str
    times: Sequence[float]
    vectors: Sequence[Sequence[float]]


@dataclass(frozen=True)
class Scene:
    """Say what a picture in space shows; what is left empty is not drawn.

    Parameters
    ----------
    attitude : recorded MRPs of the body with respect to the reference frame; the body stays upright without.
    reference : what the reference frame is called.
    position, position_frame : recorded position of the craft, (3,), [m], and the frame in which it is resolved.
    offset : (3,), [m], added to the position, reference frame.
    other : what lies at the origin of the reference frame.
    keep_out : radius of the sphere about the origin that the craft must not enter, [m].
    size, centre : (3,), [m], of the box that stands for the craft, in the frame of `turned`.
    turned : rows of the rotation from that frame to the body frame, (3, 3).
    jets, spinners, arrows : what pushes, spins and points.
    directions, tracks : that stay, and that move without being recorded, reference frame.
    """

    attitude: str = ""
    reference: str = "reference frame"
    position: str = ""
    position_frame: Literal["body", "reference"] = "reference"
    offset: Sequence[float] = (0.0, 0.0, 0.0)
    other: str = ""
    keep_out: float = 0.0
    size: Sequence[float] = (1.0, 1.0, 1.0)
    centre: Sequence[float] = (0.0, 0.0, 0.0)
    turned: Sequence[Sequence[float]] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    jets: Jets | None = None
    spinners: Spinners | None = None
    arrows: Sequence[Arrow] = ()
    directions: Sequence[Direction] = ()
    tracks: Sequence[Track] = ()

    @classmethod
    def of(cls, state: Layout) -> Scene:
        """Return what the kinds of a plant's signals tell: how the craft lies and turns."""
        lies, turns = state.of_kind("mrp"), state.of_kind("rate")
        arrows = tuple(Arrow(one.name, one.name.replace("_", " ")) for one in turns if one.size == 3)
        return cls(attitude=lies[0].name if lies else "", arrows=arrows)
