"""Print the monitor of a package as C: header and source beside the controller's."""

from __future__ import annotations

from casadi_gnc.embedded.controller import Controller, Options
from casadi_gnc.embedded.members import access, elements
from casadi_gnc.embedded.printer import print_function
from casadi_gnc.errors import PackageError
from casadi_gnc.system.templates import template

#: Samples that a number of the type counts without a gap.
_COUNTED = {"double": 2**31, "float": 2**24}
#: Objects that the tape may read or write.
_OBJECTS = {
    "state": "const {name}_state *state",
    "input": "const {name}_input *input",
    "output": "const {name}_output *output",
    "monitor": "{name}_monitor *monitor",
    "now": "moment *now",
}


def monitor_files(controller: Controller, options: Options) -> dict[str, str]:
    """Return header and source of the monitor by their names; none where nothing is watched.

    Raises
    ------
    PackageError
        For intervals that the numbers of the package cannot count.
    """
    monitor, name = controller.monitor, options.name
    if monitor is None or not monitor.watched:
        return {}
    if monitor.horizon >= _COUNTED[options.real]:
        raise PackageError(
            f"the intervals of the requirements reach {monitor.horizon} samples far, and a {options.real} counts "
            f"{_COUNTED[options.real]} without a gap; shorten them, or take float64"
        )
    places = {
        "t": ["input->time"],
        "y": access(controller.measured, "state->good."),
        "wanted": access(controller.wanted, "output->"),
        "limited": access(controller.limited, "output->"),
        "actuators": access(controller.actuators, "output->"),
        "report": access(controller.report, "output->"),
        "status": ["(gnc_real)output->status"],
        "age": ["(gnc_real)monitor->age"],
        "after": ["now->after"],
        "past": elements("now->past", len(monitor.lines)),
        "kept": elements("monitor->kept", len(monitor.initial)),
        "pushed": elements("now->pushed", len(monitor.lines)),
        "later": elements("monitor->kept", len(monitor.initial)),
        "robustness": [f"monitor->seen.{one.name}.robustness" for one in monitor.watched],
        "verdict": elements("now->verdict", len(monitor.watched)),
    }
    given = {"maths": options.maths, "real": options.real, "places": places, "flag": "gnc_flag"}
    draft = print_function(monitor.tape, arguments=[], **given)
    touched = [thing for thing in _OBJECTS if f"{thing}->" in draft]
    declared = [_OBJECTS[thing].format(name=name) for thing in touched]
    about = {
        "name": name,
        "NAME": name.upper(),
        "title": controller.title,
        "scheme": controller.scheme,
        "real": options.real,
        "maths": options.maths,
        "watched": [
            {"name": one.name, "NAME": one.name.upper(), "id": one.id, "asked": one.asked, "unit": one.unit or "-"}
            for one in monitor.watched
        ],
        "lines": monitor.lines,
        "room": sum(monitor.lines),
        "initial": [options.constant(value) for value in monitor.initial],
        "horizon": monitor.horizon,
        "finish": monitor.finish,
        "tape": print_function(monitor.tape, arguments=declared, **given),
        "call": ", ".join("&now" if thing == "now" else thing for thing in touched),
        "unused": [thing for thing in ("state", "input", "output") if thing not in touched],
    }
    return {f"{name}_monitor.{ending}": template(f"package_monitor.{ending}.j2").render(**about) for ending in "hc"}
