"""Put a package into the frames that others fly: a file or two beside it, printed from its dictionary.

A frame is a folder of the package with its own name. It reads the package's inputs, calls its step and hands its
outputs on, in the words of the frame; no number is computed there.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from casadi_gnc.embedded import packets
from casadi_gnc.embedded.controller import Options
from casadi_gnc.embedded.deviations import DEVIATIONS, deviations
from casadi_gnc.embedded.dictionary import DICTIONARY, Dictionary
from casadi_gnc.embedded.packable import Packable
from casadi_gnc.errors import PackageError
from casadi_gnc.system.templates import template


@dataclass(frozen=True)
class Frame:
    """Describe a frame: files in its folder -> templates ({name}: of the package), and what the README says of it."""

    files: dict[str, str]
    note: str


_UNTESTED = "It compiles against stub headers of our own; in the real frame it was never run."
FRAMES = {
    "basilisk": Frame(
        {"{name}_module.py": "basilisk.py.j2", "{name}_binding.c": "basilisk_binding.c.j2"},
        "A module of Basilisk (AVS Laboratory): a SysModel in Python that compiles the C of this package when it is "
        "first made and calls it in each update; messages are connected by port and field.",
    ),
    "ros2": Frame(
        {
            "{name}_node.cpp": "ros2_node.cpp.j2",
            "CMakeLists.txt": "ros2_cmake.j2",
            "package.xml": "ros2_package.xml.j2",
        },
        f"A lifecycle node of ROS 2: a topic for each port, a timer with the period, parameters. {_UNTESTED}",
    ),
    "freertos": Frame(
        {"{name}_task.c": "freertos_task.c.j2"},
        f"A periodic task of FreeRTOS that wakes at absolute ticks and counts the periods that it missed. {_UNTESTED}",
    ),
    "timer": Frame(
        {"{name}_timer.c": "timer.c.j2"},
        f"A bare timer: its interrupt counts periods, the main loop takes one step for each. {_UNTESTED}",
    ),
    "simulink": Frame(
        {"{name}_sfun.c": "simulink_sfun.c.j2"},
        f"A level-2 S-function in C: a port for each input and output, its state in work vectors. {_UNTESTED}",
    ),
    "xtce": Frame(
        {"{name}.xml": "xtce.xml.j2", "{name}_telemetry.h": "telemetry.h.j2", "{name}_telemetry.c": "telemetry.c.j2"},
        "The structs of this package as space packets (CCSDS 133.0-B): a definition in XTCE 1.2, and a packer in C.",
    ),
}


def package_files(thing: Packable, options: Options) -> dict[str, str]:
    """Return all that a package has before its vectors: what flies, its dictionary and deviations, its frame.

    Raises
    ------
    PackageError
        For a frame that there is not, or that the package does not fit.
    """
    about = thing.dictionary(options)
    files = {**thing.files(options), DICTIONARY: about.text()}
    files[DEVIATIONS] = deviations(options.name, list(files))
    return files | (frame_files(options.frame, about, sorted(files)) if options.frame else {})


def frame_files(kind: str, about: Dictionary, files: list[str]) -> dict[str, str]:
    """Return the files of a frame; `files` are those of the package."""
    if kind not in FRAMES:
        raise PackageError(f"the frame is {kind!r}, expected {', '.join(FRAMES)}")
    if not about.period_s and kind in ("ros2", "freertos", "timer", "simulink"):
        raise PackageError(
            f"a frame of {kind} needs a period, and {about.name} has none; a function gets one by --rate"
        )
    units = [path for path in files if path.endswith(".c")]
    given: dict[str, Any] = {"about": about, "name": about.name, "NAME": about.name.upper(), "units": units}
    given["reals"] = "double" if about.real == "float64" else "float"
    if kind == "xtce":
        given["packets"], given["types"] = packets.layout(about)
    return {
        f"{kind}/{path.format(name=about.name)}": template(source).render(**given)
        for path, source in FRAMES[kind].files.items()
    }


def note(options: Options) -> str:
    """Return the end of the README of a package in a frame."""
    return f"\n## In a frame\n\n`{options.frame}/`: {FRAMES[options.frame].note}\n" if options.frame else ""
