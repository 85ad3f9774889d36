"""What a folder says of its campaign is looked at before it is used: what is wrong is named, and flown again."""

from __future__ import annotations

import hashlib
import json

import pytest
from tumbling import flown

from casadi_gnc.campaigns.ledger import entry_of, read_entry, read_identity
from casadi_gnc.campaigns.result import Campaign
from casadi_gnc.errors import CampaignError, OutputError

IDENTITY = {
    "format": 1,
    "mission": "slew",
    "problem_sha256": "0" * 64,
    "changes": {},
    "scheme": "mrp",
    "mode": "sampled",
    "maths": "gnc",
    "seed": 0,
    "plan": "Independent(1)",
    "plan_name": "independent",
    "parameters": ["truth.inertia_factor"],
    "dispersions": [],
    "distributions": [],
    "cases": 100,
    "shard": 16,
    "table": "parquet",
}


def written(folder, value):
    (folder / "campaign.json").write_text(value if isinstance(value, str) else json.dumps(value))
    return folder


def test_a_sound_identity_is_read(tmp_path):
    assert read_identity(written(tmp_path, IDENTITY)) == IDENTITY


def wrong():
    """Return (name, value) that no campaign has; ... for a name that is left out."""
    free = {"changes": None, "plan_name": None, "dispersions": None}  # what was made in Python has none
    for name, right in IDENTITY.items():
        if name in ("format", "table"):
            continue
        for value in (-1, 1.5, True, 10**30, "", [], {}, None, ...):
            may_be = type(value) is type(right) and value not in (-1, 10**30)
            if not may_be and not (name in free and value is None):
                yield name, value


def test_what_no_campaign_is_told_by_is_one_sentence(tmp_path):
    tried = list(wrong())
    assert len(tried) == 14 * 9 - 11 - 3  # less those of the right kind, and None where it may be
    for name, value in tried:
        told = {**IDENTITY, name: value}
        if value is ...:
            del told[name]
        with pytest.raises(CampaignError, match=f"campaign.json is damaged: its {name} is ") as error:
            read_identity(written(tmp_path, told))
        assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "cannot be read: Expecting value"),
        ("\x00", "cannot be read"),
        ("[" * 100_000, "cannot be read"),
        ("null", "is no campaign of format 1"),
        ("[]", "is no campaign of format 1"),
        ('{"format": 2}', "is no campaign of format 1"),
    ],
)
def test_a_text_that_is_no_identity_is_one_sentence(tmp_path, text, told):
    with pytest.raises(CampaignError, match=told) as error:
        read_identity(written(tmp_path, text))
    assert "\n" not in str(error.value)
    with pytest.raises(CampaignError, match="holds no campaign: it has no campaign.json"):
        read_identity(tmp_path / "campaign.json")
    place = tmp_path / "shard-00000.json"
    place.write_text(text)
    with pytest.raises(CampaignError, match=r"shard-00000\.json (cannot be read|does not say)"):
        read_entry(place)


def test_an_entry_is_of_a_campaign_however_far_it_has_grown():
    here, grown, other = (entry_of({**IDENTITY, **more}, 0, 16, "") for more in ({}, {"cases": 200}, {"seed": 1}))
    assert here == grown
    assert here["campaign"] != other["campaign"]


@pytest.mark.slow
def test_files_of_another_campaign_or_place_are_named_and_flown_again(tmp_path, small_shards):
    """Whoever puts folders together by hand may take one of another seed, or rename a shard."""
    here, other = tmp_path / "here", tmp_path / "other"
    cases = flown(out=here).cases
    flown(out=other, seed=1)
    kept = {path.name: path.read_bytes() for path in here.iterdir()}
    (table,) = [name for name in kept if name.startswith("shard-00000") and not name.endswith(".json")]
    suffix = table.rpartition(".")[2]

    def put(shard, entry, rows):
        (here / f"shard-0000{shard}.json").write_bytes(entry)
        (here / f"shard-0000{shard}.{suffix}").write_bytes(rows)

    put(0, (other / "shard-00000.json").read_bytes(), (other / table).read_bytes())
    put(1, kept["shard-00002.json"], kept[f"shard-00002.{suffix}"])
    put(3, b"[" * 100_000, kept[f"shard-00003.{suffix}"])
    put(4, b'{"first": 64, "cases": Infinity}', kept[f"shard-00004.{suffix}"])
    put(5, kept["shard-00005.json"], kept[f"shard-00005.{suffix}"][:99])
    found = Campaign(here, cases)
    elsewhere = "holds other cases: it was copied from another campaign, or renamed"
    assert [sentence.partition(": maximum")[0] for sentence in found.damaged] == [
        f"shard-00000.{suffix} {elsewhere}",
        f"shard-00001.{suffix} {elsewhere}",
        "shard-00003.json cannot be read",
        "shard-00004.json does not say what its file holds",
        f"shard-00005.{suffix} is not what was written: its hash differs",
    ]
    assert len(found) == 16 + 4
    with pytest.raises(CampaignError, match=rf"case 17 is not kept: shard-00001\.{suffix} {elsewhere}; run the camp"):
        found.case(17)
    with pytest.raises(CampaignError, match="case 100 is not kept: there are cases 0 to 99"):
        found.case(100)
    told = []
    flown(out=here, said=told.append)
    assert told[:5] == [f"{sentence}; it is flown again" for sentence in found.damaged]
    assert {path.name: path.read_bytes() for path in here.iterdir()} == kept


@pytest.mark.slow
def test_a_table_that_is_none_is_told_in_a_sentence(tmp_path):
    """One whose hash was made to fit: no table, one of fewer rows, one of words."""
    import pyarrow.parquet as pq

    made = flown(out=tmp_path)
    (table,) = tmp_path.glob("shard-*.parquet")
    entry, whole, metric = table.with_suffix(".json"), pq.read_table(table), "metric.final_rate"
    words = whole.set_column(whole.column_names.index(metric), metric, [["x"] * whole.num_rows])

    def changed(to):
        pq.write_table(to, tmp_path / "other")
        return (tmp_path / "other").read_bytes()

    for text in (b"", b"none", b"PK\x03\x04" + bytes(40), changed(whole.slice(0, 3)), changed(words)):
        table.write_bytes(text)
        told = {**json.loads(entry.read_text()), "sha256": hashlib.sha256(text).hexdigest()}
        entry.write_text(json.dumps(told))
        with pytest.raises(CampaignError, match="is no table of this campaign; delete it and run the campaign again"):
            Campaign(tmp_path, made.cases).column(metric)


@pytest.mark.slow
def test_a_folder_that_may_only_be_read_is_enough_to_look_at(tmp_path, monkeypatch):
    """That of a colleague, or of an archive; whoever is root may write everywhere, so writing is refused here."""

    def refused(folder):
        raise OutputError(f"cannot write to the output folder {str(folder)!r}")

    found = flown(out=tmp_path)
    kept = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    monkeypatch.setattr("casadi_gnc.campaigns.store.prepare_folder", refused)
    again = Campaign(tmp_path, found.cases)
    assert again.summary() == found.summary()
    assert again.worst("final_rate").number == found.worst("final_rate").number
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == kept
    with pytest.raises(OutputError, match="cannot write to the output folder"):
        flown(out=tmp_path)
