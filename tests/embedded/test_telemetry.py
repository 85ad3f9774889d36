"""Packets that a package's C packs say to somebody else's reader of XTCE what the package's words were.

Truth: space-packet-parser and the schema of XTCE that it has; words of the package's own vectors.
"""

import io
import json
import struct
import subprocess

import numpy as np
import pytest
from packages import C99, STRICT, run

from casadi_gnc.delivery.generating import generate
from casadi_gnc.delivery.verifying import read_vectors, verify
from casadi_gnc.embedded import packets
from casadi_gnc.embedded.dictionary import STATUS, Dictionary, Entry
from casadi_gnc.errors import PackageError
from casadi_gnc.problem_files.loading import load

PROGRAM = r"""
#include <stdio.h>
#include "replay.h"
#include "sat_telemetry.h"

int main(void)
{
    static sat_state state;
    static sat_params params;
    long k;
    if (sat_init(&params) != 0) return 1;
    sat_reset(&state);
    for (k = 0; k < REPLAY_STEPS; k++) {
        sat_input in;
        sat_output out;
        uint8_t a[SAT_INPUT_OCTETS], b[SAT_OUTPUT_OCTETS], c[SAT_STATE_OCTETS], d[SAT_PARAMS_OCTETS];
        replay_load(k, &in);
        (void)sat_step(&state, &params, &in, &out);
        sat_pack_input(&in, (uint16_t)k, a);
        sat_pack_output(&out, (uint16_t)k, b);
        sat_pack_state(&state, (uint16_t)k, c);
        sat_pack_params(&params, (uint16_t)k, d);
        (void)fwrite(a, 1, sizeof a, stdout), (void)fwrite(b, 1, sizeof b, stdout);
        (void)fwrite(c, 1, sizeof c, stdout), (void)fwrite(d, 1, sizeof d, stdout);
    }
    return 0;
}
"""


def dictionary(**changes):
    whole = {
        "name": "one", "title": "one", "scheme": "", "real": "float64", "period_s": 0.0, "calls": {}, "objects": (),
        "inputs": (Entry("x", "x", 2, unit="m"),), "outputs": (STATUS,), "state": (),
        "status": ({"value": 1, "name": "A", "meaning": "a"}, {"value": 8, "name": "B", "meaning": "b"}),
    }  # fmt: skip
    return Dictionary(**{**whole, **changes})


def test_bits_of_a_status_fill_a_word():
    """From the highest bit: 28 spare, B, 2 spare, A."""
    found, types = packets.layout(dictionary())
    assert [(one.struct, one.apid, one.octets) for one in found] == [("input", 256, 22), ("output", 257, 10)]
    assert [one.name for one in found[0].fields] == ["input__x__1", "input__x__2"]
    names = [one.name for one in found[1].fields]
    assert names == ["status__spare__4", "status__B", "status__spare__1", "status__A"]
    sizes = {one.name: one.bits for one in types}
    assert [sizes[one.type] for one in found[1].fields] == [28, 1, 2, 1]
    every = tuple({"value": 1 << i, "name": f"B{i}", "meaning": "."} for i in range(32))
    fields = packets.layout(dictionary(status=every))[0][1].fields
    assert [one.name for one in fields] == [f"status__B{i}" for i in reversed(range(32))]


def test_what_does_not_fit_into_a_packet_is_refused():
    packets.layout(dictionary(inputs=(Entry("x", "x", 8192),)))
    with pytest.raises(PackageError, match="the input of one has 65544 octets, a space packet takes 65536"):
        packets.layout(dictionary(inputs=(Entry("x", "x", 8193),)))


@pytest.mark.slow
@pytest.mark.packages("space_packet_parser")
@pytest.mark.parametrize("real", ["float64", "float32"])
def test_another_reader_finds_the_words(real, tmp_path):
    import space_packet_parser

    folder = tmp_path / "sat"
    gains = {"scheme": "funnel_robust", "tunable": ("rate_gain",)}
    mission = load("huang2020/slew", {"fault_handling.count": True, "fault_handling.latch_first": True})
    generate(mission, folder, name="sat", steps=64, frame="xtce", real=real, **gains)
    definition = folder / "xtce" / "sat.xml"
    assert space_packet_parser.validate_xtce(definition).valid
    (tmp_path / "main.c").write_text(PROGRAM)
    include = [f"-I{path}" for path in (folder, folder / "test", folder / "xtce")]
    units = [*folder.glob("sat*.c"), folder / "test" / "vectors.c", folder / "xtce" / "sat_telemetry.c"]
    done = run("gcc", *C99, *STRICT, *include, "-o", tmp_path / "run", tmp_path / "main.c", *units, "-lm")
    assert done.returncode == 0, done.stderr[:3000]
    sent = subprocess.run([tmp_path / "run"], capture_output=True, check=True).stdout

    xtce = space_packet_parser.load_xtce(definition)
    found = [xtce.parse_bytes(one) for one in space_packet_parser.ccsds_generator(io.BytesIO(sent))]
    assert [int(one["PKT_APID"]) for one in found] == [256, 257, 258, 259] * 64
    assert [int(one["SRC_SEQ_CTR"]) for one in found[::4]] == list(range(64))
    about = json.loads((folder / "dictionary.json").read_text())
    number, word = ("<d", "<Q") if real == "float64" else ("<f", "<I")

    def words(packet, group, entries):
        values = []
        for one in entries:
            name = f"{group}__{one['place'].replace('.', '__')}"
            names = [name] if one["size"] == 1 else [f"{name}__{i + 1}" for i in range(one["size"])]
            values += [struct.unpack(word, struct.pack(number, float(packet[each])))[0] for each in names]
        return values

    def status(packet):
        return sum(bit["value"] for bit in about["status"] if bool(packet[f"status__{bit['name']}"]))

    inputs, outputs = read_vectors(folder, real)
    rows = [words(one, "input", about["inputs"]) for one in found[::4]]
    assert _same(np.array(rows, inputs.dtype), inputs)
    rows = [[*words(one, "output", about["outputs"][:-1]), status(one)] for one in found[1::4]]
    assert (np.array(rows, outputs.dtype) == outputs).all()
    assert outputs[:, -1].any()  # bits were raised
    good = [one for one in about["state"] if one["place"].startswith("good.")]
    assert [one["place"] for one in good] == ["good.mrp", "good.rate"]
    assert words(found[2], "state", good) == inputs[0, 1:].tolist()  # the first measurement was good
    assert int(found[2]["state__started"]) == 1
    assert [int(one["state__health__samples"]) for one in found[2::4]] == list(range(1, 65))
    replaced = (outputs[:, -1] & 1).astype(int)
    assert [int(one["state__health__replaced"]) for one in found[2::4]] == np.cumsum(replaced).tolist()
    first = int(found[-2]["state__failure__sample"])
    assert outputs[first - 1, -1] & 1
    latched = [bool(one["status__FAILURE_LATCHED"]) for one in found[1::4]]
    assert latched == [k + 1 >= first for k in range(64)]
    assert float(found[3]["params__rate_gain"]) == pytest.approx(about["parameters"][0]["default"][0])
    assert verify(folder)["is_sound"]


def _same(found, given):
    """Words, but for the payload of numbers that are none, of which Python's conversion keeps no more than the kind."""
    reals = (
        found.view(np.float64 if found.dtype == np.uint64 else np.float32),
        given.view(np.float64 if found.dtype == np.uint64 else np.float32),
    )
    return ((found == given) | (np.isnan(reals[0]) & np.isnan(reals[1]))).all()
