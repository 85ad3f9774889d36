"""Lay the numbers of a package out in space packets (CCSDS 133.0-B): a packet for each of its structs.

A packet has a primary header of six octets and no secondary one; its data are the members of the struct one after the
other, high octet first: reals as IEEE 754, integers in two's complement, of a status each bit for itself.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from casadi_gnc.embedded.dictionary import Dictionary, Entry
from casadi_gnc.errors import PackageError

#: Application process identifier of the first packet.
FIRST_APID = 256
HEADER_OCTETS, MOST_OCTETS = 6, 65536
_BITS = 32
#: What a packet holds, by its struct.
_HOLDS = {
    "input": "what the last step was given",
    "output": "what the last step gave",
    "state": "what is remembered",
    "params": "the parameters",
}


@dataclass(frozen=True)
class Field:
    """Describe a field: a number of a member, or bits of a status.

    Parameters
    ----------
    name : in the packet's definition; elements from 1 on after two underscores.
    type : of the definition, made of kind, size and unit.
    note : for people.
    """

    name: str
    type: str
    note: str


@dataclass(frozen=True)
class Packet:
    """Describe the packet of a struct; `octets` with its header."""

    struct: str
    apid: int
    octets: int
    holds: str
    members: tuple[Entry, ...]
    fields: tuple[Field, ...]


@dataclass(frozen=True)
class FieldType:
    """Describe a type of fields: "float", "integer", "unsigned" or "boolean", with bits and unit."""

    name: str
    kind: str
    bits: int
    unit: str


def layout(about: Dictionary) -> tuple[list[Packet], list[FieldType]]:
    """Return the packets of a package, and the types of their fields.

    Raises
    ------
    PackageError
        For a struct that is larger than a packet.
    """
    types: dict[tuple[str, int, str], FieldType] = {}
    width = 64 if about.real == "float64" else 32

    def typed(kind: str, bits: int, unit: str = "") -> str:
        return types.setdefault((kind, bits, unit), FieldType(f"{kind}_{len(types)}", kind, bits, unit)).name

    packets = []
    for number, (struct, members) in enumerate(about.groups.items()):
        octets = HEADER_OCTETS + sum(one.size * (width // 8 if one.type == "real" else 4) for one in members)
        if octets - HEADER_OCTETS > MOST_OCTETS:
            raise PackageError(
                f"the {struct} of {about.name} has {octets - HEADER_OCTETS} octets, a space packet takes "
                f"{MOST_OCTETS}; leave out --format xtce"
            )
        fields: list[Field] = []
        for one in members:
            if struct == "output" and one.name == "status":
                fields += _bits_of(about.status, typed)
                continue
            kind = {"real": "float", "int32": "integer", "uint32": "unsigned"}[one.type]
            kind = typed(kind, width if one.type == "real" else _BITS, one.unit.strip("-"))
            name = f"{struct}__{one.place.replace('.', '__')}"
            places = [name] if one.size == 1 else [f"{name}__{i + 1}" for i in range(one.size)]
            fields += [Field(place, kind, one.note) for place in places]
        packets.append(Packet(struct, FIRST_APID + number, octets, _HOLDS[struct], members, tuple(fields)))
    return packets, list(types.values())


def _bits_of(status: Sequence[Mapping[str, Any]], typed: Any) -> list[Field]:
    """Return the bits of a status, the highest first, with what lies between them."""
    known = {int(one["value"]).bit_length() - 1: one for one in status}
    fields, spare, at = [], 0, _BITS - 1

    def pad() -> list[Field]:
        return [Field(f"status__spare__{at + 1}", typed("unsigned", spare), "zero")] if spare else []

    while at >= 0:
        if at in known:
            fields += pad()
            fields.append(Field(f"status__{known[at]['name']}", typed("boolean", 1), known[at]["meaning"]))
            spare = 0
        else:
            spare += 1
        at -= 1
    return fields + pad()
