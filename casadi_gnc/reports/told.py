"""What a page is told of a mission and of its flights: the shapes of `mission.json` and of `summary.json`."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, FiniteFloat

#: Three numbers.
Three = tuple[FiniteFloat, FiniteFloat, FiniteFloat]


class Told(BaseModel):
    """Base of what is read from a folder: plain data, of the kinds that it declares; further keys are left alone."""

    model_config = ConfigDict(extra="ignore", frozen=True)


class Level(Told):
    """A value at which a line is drawn, in the signal's unit, and what it is."""

    value: FiniteFloat
    label: str


class ShownPanel(Told):
    """A panel of `casadi_gnc.missions.panel.Panel`, with the limits that stand beside its signal.

    `commanded` is the effort before the actuators, `walls` are those of a funnel, `bounds` those of an actuator,
    `finest` is the level down to which the axis is logarithmic.
    """

    kind: Literal["tracked", "effort", "actuators", "lines"] = "lines"
    signal: str
    label: str
    unit: str = ""
    scale: FiniteFloat = 1.0
    log: bool = False
    levels: list[Level] = []
    finest: FiniteFloat | None = None
    walls: tuple[str, str] | None = None
    commanded: str | None = None
    bounds: tuple[FiniteFloat, FiniteFloat] | None = None


class ShownJets(Told):
    """`casadi_gnc.missions.scene.Jets`; a force without end is None."""

    signal: str
    positions: list[Three]
    directions: list[Three]
    most: list[FiniteFloat | None]


class ShownSpinners(Told):
    """`casadi_gnc.missions.scene.Spinners`."""

    signal: str
    axes: list[Three]


class ShownArrow(Told):
    """`casadi_gnc.missions.scene.Arrow`."""

    signal: str
    label: str
    frame: Literal["body", "reference"]
    reversed: bool = False


class ShownDirection(Told):
    """`casadi_gnc.missions.scene.Direction`."""

    label: str
    vector: Three


class ShownTrack(Told):
    """`casadi_gnc.missions.scene.Track`."""

    label: str
    times: list[FiniteFloat]
    vectors: list[Three]


class ShownScene(Told):
    """`casadi_gnc.missions.scene.Scene`."""

    attitude: str
    reference: str
    position: str
    position_frame: Literal["body", "reference"]
    offset: Three
    other: str
    keep_out: FiniteFloat
    size: Three
    centre: Three
    turned: tuple[Three, Three, Three]
    jets: ShownJets | None
    spinners: ShownSpinners | None
    arrows: list[ShownArrow]
    directions: list[ShownDirection] = []
    tracks: list[ShownTrack] = []


class ShownScheme(Told):
    """One scheme: its parts by name, its panels, what is seen in space."""

    title: str
    law: str
    allocator: str
    feedback: str
    panels: list[ShownPanel]
    scene: ShownScene


class ShownRequirement(Told):
    """What is required, and the metric or formula that shows it."""

    id: str
    text: str
    asked: str
    evidence: str


class ShownMetric(Told):
    """What a metric measures."""

    name: str
    kind: str
    signal: str
    threshold: FiniteFloat
    unit: str


class ShownCurve(Told):
    """The loop cut at one effort: frequency [rad/s], gain [dB], phase [deg]."""

    name: str
    frequency: list[FiniteFloat]
    gain: list[FiniteFloat]
    phase: list[FiniteFloat]


class ShownLoop(Told):
    """A scheme's loop in words, its poles, curves and rows of margins; poles are None where it has no slope."""

    scheme: str
    told: str
    sampled: bool = False
    poles: list[tuple[FiniteFloat, FiniteFloat]] | None = None
    curves: list[ShownCurve] = []
    margins: list[list[str]] = []


class ShownSlice(Told):
    """Outlines of the attainable sets in a plane through zero, by name, and the limit of the effort there."""

    schemes: list[str]
    across: str
    up: str
    outlines: dict[str, list[tuple[FiniteFloat, FiniteFloat]]]
    limit: tuple[FiniteFloat, FiniteFloat] | None = None


class ShownLoops(Told):
    """What `loops.json` holds."""

    format: Literal[1] = 1
    loops: list[ShownLoop] = []
    slices: list[ShownSlice] = []


class ShownMission(Told):
    """What a reader of a flight must know of its mission beside the record."""

    format: Literal[1] = 1
    mission: str
    title: str
    source: str
    problem_sha256: str
    craft: str
    mode: str
    sample_period_s: FiniteFloat
    duration_s: FiniteFloat
    samples: int
    requirements: list[ShownRequirement]
    metrics: list[ShownMetric]
    schemes: dict[str, ShownScheme]


class Measured(Told):
    """The value of a metric, None for none."""

    value: FiniteFloat | None
    unit: str = ""


class Raised(Told):
    """How many samples raised a status, and when first."""

    status: str
    samples: int
    first_s: FiniteFloat
    meaning: str


class Judged(Told):
    """The verdict on a requirement; a robustness without end is a word."""

    id: str
    text: str = ""
    asked: str
    robustness: FiniteFloat | str
    unit: str = ""
    verdict: Literal["met", "not met"]


class Summary(Told):
    """A flight as `Flight.summary` tells it."""

    scheme: str
    title: str = ""
    metrics: dict[str, Measured] = {}
    statuses: list[Raised] = []
    requirements: list[Judged] = []
    notes: list[str] = []
    made: dict[str, Any] = {}
    seconds: FiniteFloat | None = None
