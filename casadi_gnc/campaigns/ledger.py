"""What a folder of a campaign says of itself: which campaign it holds, and which cases each of its files.

Everything here may have been written by another program, or half copied: it is looked at before it is used.
"""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

from casadi_gnc.errors import CampaignError

IDENTITY = "campaign.json"
#: Kinds of what a campaign is told by.
_KINDS: dict[str, tuple[type, ...]] = {
    "mission": (str,),
    "problem_sha256": (str,),
    "changes": (dict, type(None)),
    "scheme": (str,),
    "mode": (str,),
    "maths": (str,),
    "seed": (int,),
    "plan": (str,),
    "plan_name": (str, type(None)),
    "parameters": (list,),
    "dispersions": (list, type(None)),
    "distributions": (list,),
    "cases": (int,),
    "shard": (int,),
}
#: From and to of the numbers among them.
_RANGES = {"seed": (0, 2**64 - 1), "cases": (1, 2**32), "shard": (1, 2**32)}


def read_identity(folder: Path) -> dict[str, Any]:
    """Return what a folder holds a campaign of; raise `CampaignError` where it holds none."""
    place = folder / IDENTITY
    try:
        found = json.loads(place.read_text(encoding="utf-8"))
    except (FileNotFoundError, NotADirectoryError):
        raise CampaignError(f"{str(folder)!r} holds no campaign: it has no {IDENTITY}") from None
    except (OSError, ValueError, RecursionError) as error:
        raise CampaignError(f"{place} cannot be read: {_line(error)}") from error
    if not isinstance(found, dict) or found.get("format") != 1 or found.get("table") not in ("parquet", "npz"):
        raise CampaignError(f"{place} is no campaign of format 1")
    for name in _KINDS:
        if not _is_sound(name, found):
            raise CampaignError(
                f"{place} is damaged: its {name} is {short(found.get(name))}; run the campaign into another folder"
            )
    return found


def _is_sound(name: str, found: dict[str, Any]) -> bool:
    """Return whether an identity has something of that name, of its kind and in its range."""
    if name not in found or type(found[name]) not in _KINDS[name]:
        return False
    low, high = _RANGES.get(name, (0, 0))
    return name not in _RANGES or low <= found[name] <= high


def name_of(identity: dict[str, Any]) -> str:
    """Return what tells a campaign from every other, however many cases it has grown to."""
    fixed = {name: value for name, value in identity.items() if name != "cases"}
    return hashlib.sha256(json.dumps(fixed, sort_keys=True).encode()).hexdigest()


def entry_of(identity: dict[str, Any], first: int, cases: int, sha256: str) -> dict[str, Any]:
    """Return what the ledger says of the file of a shard."""
    return {"campaign": name_of(identity), "first": first, "cases": cases, "sha256": sha256}


def read_entry(place: Path) -> dict[str, Any]:
    """Return what the ledger says of the file of a shard; raise `CampaignError` where that cannot be read."""
    try:
        found = json.loads(place.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise CampaignError(f"{place.name} cannot be read: {_line(error)}") from error
    kinds = {"campaign": str, "first": int, "cases": int, "sha256": str}
    if not isinstance(found, dict) or any(type(found.get(name)) is not kind for name, kind in kinds.items()):
        raise CampaignError(f"{place.name} does not say what its file holds")
    return found


def short(value: Any) -> str:
    """Return a value as a few words of JSON."""
    text = json.dumps(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def _line(error: BaseException) -> str:
    if isinstance(error, OSError) and error.strerror:
        return error.strerror
    return str(error).splitlines()[0] if str(error) else type(error).__name__
