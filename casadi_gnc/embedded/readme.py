"""Write a package's README: how to call it, what it says, what it costs."""

from __future__ import annotations

from typing import Any

from casadi_gnc.embedded.controller import Controller, Options
from casadi_gnc.embedded.faults import Faults
from casadi_gnc.embedded.members import members, output_members, tunable_members
from casadi_gnc.system.templates import template


def render_usage(controller: Controller, options: Options) -> str:
    """Return the C of a caller; the functions that read sensors and drive actuators are the user's."""
    return template("package_usage.c.j2").render(
        name=options.name,
        NAME=options.name.upper(),
        measured=[{"name": one.name, "size": one.size} for one in controller.measured.signals],
        actuators=[{"name": one.name, "size": one.size} for one in controller.actuators.signals],
    )  # fmt: skip


def render_readme(
    controller: Controller,
    options: Options,
    about: dict[str, Any],
    measured: list[dict[str, Any]],
    sizes: tuple[int, int],
) -> str:
    """Return the README.

    Parameters
    ----------
    about : of the manifest.
    measured : a row a target; may be empty.
    sizes : bytes of state and parameters on this machine.
    """
    faults = controller.faults
    rows, monitor = tunable_members(controller), controller.monitor
    for row, one in zip(rows, controller.tunables, strict=True):
        row["default"] = ", ".join(f"{value:g}" for value in one.default)
    return template("package_readme.md.j2").render(
        name=options.name,
        NAME=options.name.upper(),
        title=controller.title,
        source=controller.source,
        scheme=controller.scheme,
        real=options.real,
        period=f"{controller.period:g}",
        version=about["made_by"]["casadi_gnc"],
        steps=about["steps"],
        allocation=controller.allocation is not None,
        usage=render_usage(controller, options).rstrip(),
        inputs=members(controller.measured),
        outputs=output_members(controller),
        statuses=[{"value": b, "name": n, "sentence": s} for b, (n, s) in controller.raised.items()],
        tunables=rows,
        faults=faults if faults is not None and faults != Faults(faults.failures) else None,
        failures=[name for bit, (name, _) in controller.raised.items() if faults is not None and bit & faults.failures],
        safe=_safe(faults),
        watched=[
            {"name": one.name, "id": one.id, "asked": one.asked, "unit": one.unit or "-", "delay": f"{one.delay:g}"}
            for one in (monitor.watched if monitor is not None else ())
        ],
        left_out=[{"why": why} for _, why in (monitor.left_out if monitor is not None else ())],
        measured=measured,
        host={"state": sizes[0], "params": sizes[1]},
    )  # fmt: skip


def _safe(faults: Faults | None) -> str:
    """Return in words what the actuators are told in safe mode."""
    if faults is None or faults.safe is None:
        return ""
    if not faults.safe:
        return "what they were told last"
    return ", ".join(f"{value:g}" for value in faults.safe) if any(faults.safe) else "zero"
