"""What a time depends on besides the program: processor, governor, load, versions."""

from __future__ import annotations

import os
import platform
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import Any

_CPU = Path("/sys/devices/system/cpu/cpu0/cpufreq")


def describe() -> dict[str, Any]:
    """Return processor, cores, governor, load, system, Python and compiler, as plain data."""
    from casadi_gnc.system import compilers

    found = compilers.available()
    return {
        "processor": processor(),
        "cores": os.cpu_count(),
        "governor": _first_line(_CPU / "scaling_governor") or "not reported by the system",
        "load": load(),
        "system": platform.platform(),
        "python": platform.python_version(),
        "compiler": found[0].version if found else "none",
        "date": datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"),
    }


def load() -> list[float] | None:
    """Return the mean number of waiting processes over 1, 5 and 15 minutes; None where it is not known."""
    try:
        return [round(value, 2) for value in os.getloadavg()]
    except (AttributeError, OSError):
        return None


def processor() -> str:
    """Return the processor's name."""
    try:
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()


def version(package: str) -> str:
    """Return the version of an installed distribution, or "unknown"."""
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return "unknown"


def _first_line(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8").splitlines()[0]
    except (OSError, IndexError):
        return ""
