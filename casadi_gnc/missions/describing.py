"""A mission, and a craft, told on one screen."""

from __future__ import annotations

from typing import TYPE_CHECKING

from casadi_gnc.signals import Layout

if TYPE_CHECKING:
    from casadi_gnc.missions.mission import Mission

_WIDTH = 110


def on_one_screen(mission: Mission) -> str:
    """Return craft, timing, schemes, metrics and funnels of a mission, a line each."""
    plant, timing = mission.truth, mission.timing
    rows = [("craft", f"{type(mission.craft).__name__}: measured {columns(plant.measurement)}")]
    rows += [("", f"actuators {columns(plant.inputs)}")]
    mode = f"{timing.mode}, every {timing.sample_period:g} s for {timing.duration:g} s, {timing.samples} samples"
    rows += [("timing", mode)]
    for number, scheme in enumerate(mission.schemes):
        how = (
            f"{type(scheme.law).__name__}, {type(scheme.actuation.allocator).__name__}, told what is {scheme.feedback}"
        )
        rows += [("" if number else "schemes", f"{scheme.name}: {how}")]
    rows += [("" if n else "funnels", f"of {each.signal}") for n, each in enumerate(mission.funnels)]
    rows += [("" if n else "metrics", f"{m.name}: {m.kind} of {m.signal}") for n, m in enumerate(mission.metrics)]
    rows += [("" if n else "required", f"{one.id}: {one.asked}") for n, one in enumerate(mission.requirements)]
    rows += [("note", note) for note in mission.craft.notes()]
    rows += [("made of", f"{mission.origin.name if mission.origin else 'objects'}, sha256 {mission.digest[:12]}")]
    title = f"Mission {mission.name}" + (f": {mission.title}" if mission.title else "")
    return "\n".join(shortened(line) for line in (title, *(f"  {name:<8} {text}" for name, text in rows)))


def columns(layout: Layout) -> str:
    """Return the signals of a column with sizes and units: "mrp (3), rate (3) [rad/s]"."""
    told = [f"{s.name} ({s.size})" + (f" [{s.unit}]" if s.unit not in ("", "-") else "") for s in layout.signals]
    return ", ".join(told) or "nothing"


def shortened(line: str, width: int = _WIDTH) -> str:
    """Return a line that is cut where it is longer than the screen."""
    return line if len(line) <= width else f"{line[: width - 3]}..."
