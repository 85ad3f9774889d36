"""Misuse of a package is told and not flown: no init, no reset, null pointers, times and tables that cannot be.

Truth: what the header promises; CRC-32 by zlib; words of a flight that nobody misused.
"""

import hashlib
import struct
import subprocess
import zlib

import pytest
from packages import C99, STRICT, made, run

PROGRAM = r"""
#include <math.h>
#include <stdio.h>
#include <string.h>
#include "replay.h"

#define SAY(what, value) (void)printf("%s %lu\n", what, (unsigned long)(value))

static slew_params params;
static slew_state state;
static slew_input in;
static slew_output out;
static double now;

static uint32_t step(double advance)
{
    now += advance;
    in.time = (slew_real)now;
    return slew_step(&state, &params, &in, &out) & ~(uint32_t)(SLEW_COMMAND_LIMITED | SLEW_EFFORT_SHORT);
}

static unsigned long nonzero(void)
{
    unsigned long count = 0;
    int i;
    for (i = 0; i < SLEW_ACTUATORS; i++) count += out.force[i] != 0;
    return count;
}

#if SLEW_CHECK_STATE
/* Bits of the state that can be changed between two steps without being told. */
static unsigned long missed(void)
{
    unsigned long count = 0;
    const slew_state kept = state;
    uint32_t k, bit, word, status = 0;
    for (k = 0; k < sizeof state; k += 4u) {
        for (bit = 1u; bit != 0u; bit <<= 1) {
            memcpy(&word, (char *)&state + k, 4);
            word ^= bit;
            memcpy((char *)&state + k, &word, 4);
            status = slew_step(&state, &params, &in, &out);
            count += status != (uint32_t)(state.ready == kept.ready ? SLEW_STATE_DAMAGED : SLEW_NOT_INITIALISED);
            count += nonzero();
            state = kept;
        }
    }
    return count;
}
#endif

int main(void)
{
    slew_params damaged;
    slew_table table;
    replay_load(0, &in);
    memset(&out, 0x55, sizeof out);
    SAY("nothing", step(0.1));
    SAY("nonzero", nonzero());
    slew_reset(&state);
    SAY("no_init", step(0.1));
    (void)slew_configure(&params);
    SAY("configured_alone", step(0.1));
    SAY("init", slew_init(&params));
#if SLEW_CONFIGURE_FIRST
    SAY("defaults", step(0.1));
    SAY("configure", slew_configure(&params));
#endif
    memset(&state, 0, sizeof state);
    SAY("no_reset", step(0.1));
    SAY("nonzero", nonzero());
    slew_reset(&state);
    SAY("first", step(0.1));
    SAY("moving", nonzero() > 0);
    SAY("next", step(0.1));
    SAY("stands", step(0.0));
    SAY("after", step(0.1));
    SAY("back", step(-5.0));
    SAY("after", step(0.1));
    SAY("jump", step(1.0));
    SAY("late", step(0.14));
    SAY("nan", (in.time = (slew_real)NAN, slew_step(&state, &params, &in, &out)) & SLEW_TIME_SHIFTED);
    SAY("null_state", slew_step(0, &params, &in, &out));
    SAY("null_params", slew_step(&state, 0, &in, &out));
    SAY("null_input", slew_step(&state, &params, 0, &out));
    SAY("null_output", slew_step(&state, &params, &in, 0));
    damaged = params;
    damaged.configured ^= 4u;
    SAY("damaged", slew_step(&state, &damaged, &in, &out));
    SAY("told", out.status);
#if SLEW_CHECK_STATE
    SAY("missed", missed());
    SAY("whole", step(0.1));
#endif

    table.rate_gain = (slew_real)1.25;
    table.attitude_gain = (slew_real)2.5;
    table.checksum = slew_checksum(&table);
    SAY("checksum", table.checksum);
    SAY("load", slew_load(&params, &table));
    SAY("taken", params.rate_gain == (slew_real)1.25 && params.attitude_gain == (slew_real)2.5);
    damaged = params;
    table.rate_gain = (slew_real)1.5;
    SAY("corrupted", slew_load(&params, &table));
    SAY("same", memcmp(&damaged, &params, sizeof params));
    table.rate_gain = (slew_real)-1.0;
    table.checksum = slew_checksum(&table);
    SAY("range", slew_load(&params, &table));
    SAY("same", memcmp(&damaged, &params, sizeof params));
    table.rate_gain = (slew_real)NAN;
    table.checksum = slew_checksum(&table);
    SAY("range", slew_load(&params, &table));
    SAY("same", memcmp(&damaged, &params, sizeof params));
    slew_reset(0);
    SAY("null_init", slew_init(0));
    SAY("null_configure", slew_configure(0));
    SAY("null_checksum", slew_checksum(0));
    SAY("null_table", slew_load(&params, 0));
    SAY("null_load", slew_load(0, &table));
    SAY("same", memcmp(&damaged, &params, sizeof params));
    return 0;
}
"""
SHIFTED, UNINITIALISED, UNCONFIGURED = 1 << 27, 1 << 28, 1 << 25


@pytest.mark.slow
@pytest.mark.parametrize("real", ["float64", "float32"])
def test_misuse_is_told(real, tmp_path):
    folder = made("huang2020/slew", "pd_pinv", real, ("attitude_gain", "rate_gain"), steps=64)
    source = hashlib.sha256((folder / "slew.c").read_bytes()).hexdigest()
    numbers = {"float64": "double", "float32": "float"}[real]
    assert f'#define SLEW_IDENTITY "slew {source[:16]} {numbers}"' in (folder / "slew.h").read_text()
    (tmp_path / "main.c").write_text(PROGRAM)
    include = [f"-I{path}" for path in (folder, folder / "test")]
    sources = [tmp_path / "main.c", folder / "slew.c", folder / "test" / "vectors.c"]
    flags = [flag for flag in (*C99, *STRICT) if flag != "-Wdouble-promotion"]

    def told(*macros: str) -> list[tuple[str, int]]:
        done = run("gcc", *flags, *macros, *include, "-o", tmp_path / "run", *sources, "-lm")
        assert done.returncode == 0, done.stderr[:3000]
        lines = subprocess.run([tmp_path / "run"], capture_output=True, text=True, check=True).stdout.splitlines()
        return [(line.split()[0], int(line.split()[1])) for line in lines]

    values = struct.pack(">dd" if real == "float64" else ">ff", 2.5, 1.25)
    expected = [
        ("nothing", UNINITIALISED), ("nonzero", 0), ("no_init", UNINITIALISED), ("configured_alone", UNINITIALISED),
        ("init", 0), ("no_reset", UNINITIALISED), ("nonzero", 0), ("first", 0), ("moving", 1), ("next", 0),
        ("stands", SHIFTED), ("after", 0), ("back", SHIFTED), ("after", 0), ("jump", SHIFTED), ("late", 0),
        ("nan", SHIFTED), ("null_state", UNINITIALISED), ("null_params", UNINITIALISED),
        ("null_input", UNINITIALISED), ("null_output", UNINITIALISED), ("damaged", UNINITIALISED),
        ("told", UNINITIALISED), ("checksum", zlib.crc32(values)), ("load", 0), ("taken", 1),
        ("corrupted", 2), ("same", 0), ("range", 1), ("same", 0), ("range", 1), ("same", 0),
        ("null_init", 1), ("null_configure", 1), ("null_checksum", 0), ("null_table", 2), ("null_load", 2), ("same", 0),
    ]  # fmt: skip
    assert told() == expected
    asked = [*expected[:5], ("defaults", UNCONFIGURED), ("configure", 0), *expected[5:23]]
    asked += [("missed", 0), ("whole", 0), *expected[23:]]
    assert told("-DSLEW_CHECK_STATE=1", "-DSLEW_CONFIGURE_FIRST=1") == asked
