"""Where a mission came from, so that a package can keep it and make it again."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import casadi as ca

from casadi_gnc.guests import GuestFile
from casadi_gnc.missions.timing import Timing
from casadi_gnc.tables.part import plain


@dataclass(frozen=True)
class Origin:
    """Say from which file a mission was read.

    Parameters
    ----------
    name : of the file.
    text : its content.
    changes : values that were put in the place of the file's, by path.
    guests : files of the user's own code that it names.
    folder : where it lay, for relative names.
    """

    name: str
    text: str
    changes: Mapping[str, Any] = field(default_factory=dict)
    guests: tuple[GuestFile, ...] = ()
    folder: Path = Path()

    @property
    def digest(self) -> str:
        """Hash of the text, what was changed, and the user's own code."""
        lines = [f"\n# {key} = {value!r}" for key, value in sorted(self.changes.items())]
        lines += [f"\n# {file.path} {file.sha256}" for file in self.guests]
        return hashlib.sha256((self.text + "".join(lines)).encode()).hexdigest()

    def with_changes(self, changes: Mapping[str, Any]) -> Origin | None:
        """Return the origin with further values by path; None where a value is none that a file could have."""
        values = {key: plain(value) for key, value in changes.items() if not isinstance(value, (ca.SX, ca.MX))}
        if len(values) < len(changes) or not all(map(_is_data, values.values())):
            return None
        return replace(self, changes={**self.changes, **values})


#: Keys of [timing] by the fields of `Timing`.
_TIMING_KEYS = {
    "mode": "mode",
    "sample_period": "sample_period_s",
    "duration": "duration_s",
    "substeps": "plant_substeps",
}


def keys_of_timing(given: Timing, changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return changes of the timing as a file has them; what is recorded follows from the sample period."""
    timing = replace(given, **changes)
    keys = {f"timing.{_TIMING_KEYS[name]}": value for name, value in changes.items() if name in _TIMING_KEYS}
    if "record_every" in changes or (timing.record_every > 1 and "sample_period" in changes):
        keys["timing.record_period_s"] = timing.record_every * timing.sample_period
    return keys


def _is_data(value: Any) -> bool:
    """Return whether a value can stand in a file."""
    if isinstance(value, list):
        return all(map(_is_data, value))
    return isinstance(value, (bool, int, float, str))
