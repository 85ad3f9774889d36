"""Where a campaign is kept: a file for each shard of its cases, and what it is a campaign of.

=======================  ==================================================================================
file                     content
=======================  ==================================================================================
campaign.json            identity: mission, scheme, plan, seed, dispersions, code and versions; number of cases
problem.toml, *.py       what the mission was read from, where it was read
shard-00000.parquet      a row a case, in order (`.npz` without pyarrow)
shard-00000.json         which campaign and cases the shard is of, and the hash of its file; written last, so that it
                         stands for a whole one
kept/                    whole records of some cases, where they were asked for
=======================  ==================================================================================

A file is written beside its place, brought to the disk and renamed; whoever is interrupted leaves whole files or none.
Shards depend on nothing but the campaign, so several processes may write into one folder, and the next run goes on.
"""

from __future__ import annotations

import hashlib
import json
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from casadi_gnc.campaigns.ledger import IDENTITY, entry_of, name_of, read_entry, read_identity, short
from casadi_gnc.errors import CampaignError
from casadi_gnc.system.files import prepare_folder, write_beside

#: States of a shard: as it should be; not flown; without its last cases, for the campaign has grown.
WHOLE, MISSING, SHORT = "whole", "missing", "short"
#: A table: columns by name, of one length.
Columns = dict[str, np.ndarray]


def has_arrow() -> bool:
    """Return whether pyarrow is installed, so that tables are Parquet files."""
    try:
        import pyarrow.parquet  # noqa: F401
    except ImportError:
        return False
    return True


class Store:
    """Keep the shards of one campaign in a folder, which need only be readable as long as nothing is written.

    Parameters
    ----------
    folder : that holds the campaign.
    identity : of the campaign, data that JSON can hold; `cases` and `shard` are the numbers of cases in all and in
        a shard.
    """

    def __init__(self, folder: Path, identity: dict[str, Any]) -> None:
        self.folder, self.identity = folder, identity
        self.suffix = identity["table"]

    @classmethod
    def prepared(cls, folder: Path, asked: dict[str, Any]) -> Store:
        """Return the store of a campaign that is to be flown, in a folder that is made if it does not exist.

        Raises
        ------
        CampaignError, OutputError
            Where the folder holds another campaign, or cannot be written.
        """
        place, identity = prepare_folder(folder) / IDENTITY, asked
        if place.exists():
            identity = cls._grown(folder, read_identity(folder), asked)
        if not place.exists() or identity is asked:
            _put_text(place, json.dumps(asked, indent=2) + "\n")
        return cls(folder, identity)

    @staticmethod
    def _grown(folder: Path, known: dict[str, Any], asked: dict[str, Any]) -> dict[str, Any]:
        """Return what the folder is to say: what it says already, or the same with more cases."""
        apart = [name for name in asked if name != "cases" and known.get(name) != asked[name]]
        if apart:
            fixed = apart == ["plan"] and known["plan_name"] == asked["plan_name"] and known["cases"] != asked["cases"]
            why = "such a plan is made for its number of cases and cannot grow; " if fixed else ""
            raise CampaignError(
                f"{folder} holds another campaign: its {apart[0]} is {short(known.get(apart[0]))}, and this "
                f"one's is {short(asked[apart[0]])}; {why}give another folder"
            )
        if asked["cases"] < known["cases"]:
            raise CampaignError(
                f"{folder} holds a campaign of {known['cases']} cases, and {asked['cases']} are asked for; "
                "ask for as many or more, or give another folder"
            )
        return known if asked["cases"] == known["cases"] else asked

    def place(self, shard: int) -> Path:
        """Return where the table of a shard is."""
        return self.folder / f"shard-{shard:05d}.{self.suffix}"

    def write(self, shard: int, columns: Columns) -> None:
        """Keep a shard."""
        place = self.place(shard)
        write_beside(place, lambda path: _write(path, columns, self.suffix))
        entry = entry_of(self.identity, int(columns["case"][0]), len(columns["case"]), _hash(place))
        _put_text(place.with_suffix(".json"), json.dumps(entry) + "\n")

    def begun(self) -> list[int]:
        """Return the shards that the ledger knows, in their order; all others are `MISSING`."""
        count = -(-self.identity["cases"] // self.identity["shard"])
        names = [path.stem.removeprefix("shard-") for path in self.folder.glob("shard-*.json")]
        numbers = sorted(int(name) for name in names if name.isdecimal() and name == f"{int(name):05d}")
        return [number for number in numbers if number < count]

    def state(self, shard: int) -> str:
        """Return `WHOLE`, `MISSING`, `SHORT`, or why the table of a shard cannot be trusted."""
        place = self.place(shard)
        entry = place.with_suffix(".json")
        if not entry.exists():
            return MISSING
        try:
            told, found = read_entry(entry), _hash(place)
        except CampaignError as error:
            return str(error)
        except OSError as error:
            return f"{place.name} cannot be read: {error.strerror or error}"
        if told["sha256"] != found:
            return f"{place.name} is not what was written: its hash differs"
        size, cases = self.identity["shard"], told["cases"]
        if told["campaign"] != name_of(self.identity) or told["first"] != shard * size:
            return f"{place.name} holds other cases: it was copied from another campaign, or renamed"
        return WHOLE if cases == min(size, self.identity["cases"] - shard * size) else SHORT

    def read(self, shard: int, names: list[str] | None = None) -> Columns:
        """Return the columns of a shard, all or those named; raise `CampaignError` where it is no such table."""
        place = self.place(shard)
        try:
            found = _read(place, names)
            cases = read_entry(place.with_suffix(".json"))["cases"]
            if any(len(column) != cases for column in found.values()):
                raise ValueError("it has other rows than the ledger says")
            if any(column.dtype.kind not in "biuf" for name, column in found.items() if name != "refused"):
                raise ValueError("it has words in the place of numbers")
            return found
        except (OSError, ValueError, KeyError, zipfile.BadZipFile) as error:
            raise CampaignError(
                f"{place} is no table of this campaign; delete it and run the campaign again"
            ) from error


def shards(identity: dict[str, Any]) -> Iterator[tuple[int, int, int]]:
    """Yield number, first and last case (exclusive) of each shard."""
    cases, size = identity["cases"], identity["shard"]
    for number, first in enumerate(range(0, cases, size)):
        yield number, first, min(first + size, cases)


def keep_texts(folder: Path, texts: dict[str, str]) -> None:
    """Write what the mission was read from."""
    for name, text in texts.items():
        place = folder / name
        place.parent.mkdir(parents=True, exist_ok=True)
        if not place.exists() or place.read_bytes() != text.encode():
            _put_text(place, text)


def _put_text(place: Path, text: str) -> None:
    write_beside(place, lambda path: path.write_text(text, encoding="utf-8"))


def _hash(place: Path) -> str:
    return hashlib.sha256(place.read_bytes()).hexdigest()


def _write(place: Path, columns: Columns, suffix: str) -> None:
    if suffix == "npz":
        with place.open("wb") as file:
            np.savez(file, **columns)  # type: ignore[arg-type]
        return
    import pyarrow as pa
    import pyarrow.parquet as pq

    table = pa.table({name: pa.array(column, from_pandas=True) for name, column in columns.items()})
    pq.write_table(table, place, compression="zstd")


def _read(place: Path, names: list[str] | None) -> Columns:
    if place.suffix == ".npz":
        with np.load(place) as found:
            return {name: found[name] for name in names or found.files}
    import pyarrow.parquet as pq

    table = pq.read_table(place, columns=names)
    return {name: _numpy(table.column(name)) for name in table.column_names}


def _numpy(column: Any) -> np.ndarray:
    array = column.to_numpy()
    return np.array([value or "" for value in array], dtype=object) if array.dtype == object else array
