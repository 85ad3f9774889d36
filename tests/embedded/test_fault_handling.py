"""What a package does with faults beside telling them, each option by what the documentation says of it.

Truth: counts by hand; what the law gives for the same measurement with the old gains and with the new; CRC-32 by zlib;
numbers of a state that Python unpacks from its image.
"""

import dataclasses
import json
import re
import struct
import subprocess
import zlib
from pathlib import Path

import numpy as np
import pytest
from packages import C99, STRICT, needs_target, run

import casadi_gnc
from casadi_gnc.delivery.generating import generate
from casadi_gnc.delivery.vectors import read_vectors
from casadi_gnc.delivery.verifying import verify
from casadi_gnc.embedded import boards, saving, targets
from casadi_gnc.embedded.faults import Faults
from casadi_gnc.errors import FaultHandlingError, PackageError, ProblemError
from casadi_gnc.missions.fault_handling import FaultHandling
from casadi_gnc.missions.onboard import describe
from casadi_gnc.problem_files.document import read

#: All of them: a measurement may be held for two steps, three failures in a row are safe mode, four good steps end it.
ALL = {
    "count": True,
    "latch_first": True,
    "measurement_age_s": 0.2,
    "safe_output": "zero",
    "safe_after": 3,
    "release_after": 4,
    "gain_change_s": 1.0,
    "state_image": True,
}
GAINS = ("attitude_gain", "rate_gain")
REPLACED, STALE, SAFE, LATCHED, FADING, SHIFTED = 1, 1 << 20, 1 << 21, 1 << 22, 1 << 23, 1 << 27


def handled(**options):
    return casadi_gnc.load("huang2020/slew", {f"fault_handling.{key}": value for key, value in options.items()})


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

/* One step; the bits of the limits are not looked at. */
static uint32_t step(int bad)
{
    slew_input given = in;
    now += 0.1;
    given.time = (slew_real)now;
    if (bad) given.mrp[1] = (slew_real)NAN;
    return slew_step(&state, &params, &given, &out) & ~(uint32_t)(SLEW_COMMAND_LIMITED | SLEW_EFFORT_SHORT);
}

static unsigned long moving(void)
{
    unsigned long count = 0;
    int i;
    for (i = 0; i < SLEW_ACTUATORS; i++) count += out.force[i] != 0;
    return count != 0;
}

static void tell(const char *what, const slew_real *numbers)
{
    (void)printf("%s %.17g %.17g %.17g\n", what, (double)numbers[0], (double)numbers[1], (double)numbers[2]);
}

static uint32_t crc_of(const uint8_t *octets, uint32_t count)
{
    uint32_t crc = 0xffffffffu, i, k;
    for (i = 0u; i < count; ++i)
        for (crc ^= octets[i], k = 0u; k < 8u; ++k) crc = (crc & 1u) ? (crc >> 1) ^ 0xedb88320u : crc >> 1;
    return ~crc;
}

static void seal(uint8_t *image)
{
    const uint32_t crc = crc_of(image, SLEW_IMAGE_OCTETS - 4u);
    int i;
    for (i = 0; i < 4; i++) image[SLEW_IMAGE_OCTETS - 4 + i] = (uint8_t)(crc >> (24 - 8 * i));
}

static void faults(void)
{
    int i;
    slew_reset(&state);
    SAY("good", step(0)), SAY("good", step(0)), SAY("moving", moving());
    SAY("bad", step(1)), SAY("held", state.held.mrp), SAY("held", state.held.rate), SAY("moving", moving());
    SAY("first", state.failure.sample), SAY("first", state.failure.status & SLEW_MEASUREMENT_REPLACED);
    SAY("good", step(0)), SAY("held", state.held.mrp);
    SAY("bad", step(1)), SAY("bad", step(1)), SAY("row", state.in_a_row.measurement_replaced), SAY("moving", moving());
    SAY("stale", step(1)), SAY("held", state.held.mrp), SAY("moving", moving());
    for (i = 0; i < 4; i++) SAY("recovering", step(0)), SAY("moving", moving());
    SAY("released", step(0)), SAY("moving", moving());
    SAY("first", state.failure.sample);
    slew_acknowledge(&state);
    SAY("good", step(0));
    now += 3.0, SAY("jump", step(0)), now += 3.0, SAY("jump", step(0)), SAY("moving", moving());
    now += 3.0, SAY("jump", step(0)), SAY("moving", moving());
    SAY("first", state.failure.sample);
    slew_acknowledge(&state);
    SAY("good", step(0)), SAY("moving", moving());
    SAY("samples", state.health.samples), SAY("replaced", state.health.replaced);
    slew_acknowledge(0);
}

static void gains(void)
{
    slew_state other;
    slew_output aside;
    int i;
    slew_reset(&state);
    (void)step(0), (void)step(0);
    tell("old", out.limited);
    params.attitude_gain *= (slew_real)0.5;
    SAY("configure", slew_configure(&params));
    slew_reset(&other);
    (void)slew_step(&other, &params, &in, &aside);
    tell("new", aside.limited);
    for (i = 0; i < 12; i++) SAY("fading", step(0)), tell("effort", out.limited);
    SAY("configure", slew_configure(&params)), SAY("again", step(0));
    state.fading.offset[1] = (slew_real)NAN;
    SAY("damaged", step(0)), tell("effort", out.limited);
}

static void images(void)
{
    uint8_t image[SLEW_IMAGE_OCTETS], kept[SLEW_IMAGE_OCTETS];
    slew_state twin, before;
    unsigned long passed = 0;
    uint32_t k, bit;
    slew_reset(&state);
    (void)step(0), (void)step(1), (void)step(0);
    SAY("export", slew_export(&state, image));
    (void)printf("image ");
    for (k = 0u; k < SLEW_IMAGE_OCTETS; k++) (void)printf("%02x", image[k]);
    (void)printf("\n");
    memset(&twin, 0x5a, sizeof twin);
    SAY("import", slew_import(&twin, image));
    before = twin;
    memcpy(kept, image, sizeof kept);
    for (k = 0u; k < SLEW_IMAGE_OCTETS; k++)
        for (bit = 1u; bit < 256u; bit <<= 1) {
            image[k] ^= (uint8_t)bit;
            passed += slew_import(&twin, image) != 2 || memcmp(&before, &twin, sizeof twin) != 0;
            image[k] ^= (uint8_t)bit;
        }
    SAY("passed", passed);
    image[0] ^= 1u, seal(image), SAY("another", slew_import(&twin, image));
    memcpy(image, kept, sizeof kept);
    memset(&image[4], 0xff, sizeof(slew_real)), seal(image), SAY("nan", slew_import(&twin, image));
    SAY("same", memcmp(&before, &twin, sizeof twin));
    SAY("null", slew_import(0, kept)), SAY("null", slew_import(&twin, 0));
    SAY("null", slew_export(0, image)), SAY("null", slew_export(&state, 0));
    memset(&twin, 0, sizeof twin), SAY("unready", slew_export(&twin, image));
#if SLEW_CHECK_STATE
    twin = state, twin.previous.force[0] += 1;
    SAY("damaged", slew_export(&twin, image));
    slew_acknowledge(&twin), SAY("left", slew_step(&twin, &params, &in, &out));
#endif
    SAY("import", slew_import(&twin, kept));
    for (k = 0u; k < 50u; k++) {
        slew_output aside;
        slew_input given;
        replay_load(k % REPLAY_STEPS, &given);
        now += 0.1, given.time = (slew_real)now;
        memset(&aside, 0, sizeof aside), memset(&out, 0, sizeof out); /* what lies between members */
        (void)slew_step(&state, &params, &given, &out), (void)slew_step(&twin, &params, &given, &aside);
        passed += memcmp(&out, &aside, sizeof out) != 0;
    }
    SAY("differ", passed);
}

int main(void)
{
    int i;
    replay_load(0, &in);
    for (i = 0; i < 3; i++) in.mrp[i] *= (slew_real)0.01; /* so that no limit is met */
    if (slew_init(&params) != 0) return 1;
    faults();
    gains();
    images();
    return 0;
}
"""


def told(folder: Path, place: Path, *macros: str) -> list[tuple[str, str]]:
    """Return the lines of the program, linked with a package: a word and what follows it."""
    (place / "main.c").write_text(PROGRAM)
    include = [f"-I{path}" for path in (folder, folder / "test")]
    flags = [flag for flag in (*C99, *STRICT) if flag != "-Wdouble-promotion"]
    sources = [place / "main.c", folder / "slew.c", folder / "test" / "vectors.c"]
    done = run("gcc", *flags, *macros, *include, "-o", place / "run", *sources, "-lm")
    assert done.returncode == 0, done.stderr[:3000]
    lines = subprocess.run([place / "run"], capture_output=True, text=True, check=True).stdout.splitlines()
    return [(line.split(" ", 1)[0], line.split(" ", 1)[1]) for line in lines]


#: What the first part says: good steps, one and three with a held measurement, four until safe mode is left, jumps.
FAULTS = [
    ("good", 0), ("good", 0), ("moving", 1),
    ("bad", REPLACED | LATCHED), ("held", 1), ("held", 0), ("moving", 1), ("first", 3), ("first", REPLACED),
    ("good", LATCHED), ("held", 0), ("bad", REPLACED | LATCHED), ("bad", REPLACED | LATCHED), ("row", 2), ("moving", 1),
    ("stale", REPLACED | STALE | SAFE | LATCHED), ("held", 3), ("moving", 0),
    *([("recovering", SAFE | LATCHED), ("moving", 0)] * 4), ("released", LATCHED), ("moving", 1), ("first", 3),
    ("good", 0), ("jump", SHIFTED | LATCHED), ("jump", SHIFTED | LATCHED), ("moving", 1),
    ("jump", SHIFTED | SAFE | LATCHED), ("moving", 0), ("first", 14), ("good", 0), ("moving", 1),
    ("samples", 17), ("replaced", 4),
]  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("real", ["float64", "float32"])
def test_each_option_does_what_is_said_of_it(real, tmp_path):
    folder = tmp_path / "slew"
    generate(handled(**ALL), folder, scheme="pd_pinv", real=real, tunable=GAINS, steps=64)
    lines = told(folder, tmp_path)
    count = len(FAULTS)
    assert [(word, int(value)) for word, value in lines[:count]] == FAULTS

    names = [word for word, _ in lines[count:]]
    numbers = [np.array(value.split(), dtype=float) for word, value in lines[count:] if word != "image"]
    rows = dict(zip(names[:3], numbers[:3], strict=True))
    unit = 2.0 ** (-50 if real == "float64" else -21) * np.abs(rows["old"]).max()
    assert np.abs(rows["old"] - rows["new"]).max() > 1e3 * unit
    assert names[3:27] == ["fading", "effort"] * 12
    for k in range(12):
        share = max(10 - k, 0) / 10
        assert numbers[3 + 2 * k][0] == (FADING if share else 0)
        assert np.abs(numbers[4 + 2 * k] - (rows["new"] + share * (rows["old"] - rows["new"]))).max() <= unit
    assert (numbers[24] == rows["new"]).all()
    assert [(word, number[0]) for word, number in zip(names[27:30], numbers[27:30], strict=True)] == [
        ("configure", 0), ("again", FADING), ("damaged", FADING)
    ]  # fmt: skip
    assert np.isfinite(numbers[30]).all()

    rest = [(word, int(value)) for word, value in lines[count + 31 :] if word != "image"]
    expected = [
        ("export", 0),
        ("import", 0),
        ("passed", 0),
        ("another", 1),
        ("nan", 1),
        ("same", 0),
        *[("null", 1)] * 4,
    ]
    assert rest == [*expected, ("unready", 1), ("import", 0), ("differ", 0)]
    _look_at_image(folder, bytes.fromhex(dict(lines)["image"]), real)

    checked = told(folder, tmp_path, "-DSLEW_CHECK_STATE=1")
    assert [(word, int(value)) for word, value in checked[:count]] == FAULTS
    assert [line for line in checked if line[0] in ("damaged", "left")][1:] == [
        ("damaged", "1"),
        ("left", str(1 << 26)),
    ]
    assert verify(folder)["is_sound"]


def _look_at_image(folder, image, real):
    """The image is an identity, the state of the dictionary in its order, and a CRC-32, high octets first."""
    about = json.loads((folder / "dictionary.json").read_text())
    assert f"IMAGE_OCTETS {len(image)}" in (folder / "slew.h").read_text()
    assert int.from_bytes(image[-4:], "big") == zlib.crc32(image[:-4])
    code = "".join(
        {"real": "d" if real == "float64" else "f"}.get(one["type"], "I") * one["size"] for one in about["state"]
    )
    numbers = iter(struct.unpack(f">{code}", image[4:-4]))
    state = {one["place"]: [next(numbers) for _ in range(one["size"])] for one in about["state"]}
    inputs, _ = read_vectors(folder, real)
    first = inputs[0].view(np.float64 if real == "float64" else np.float32)
    assert state["good.mrp"] == pytest.approx((first[1:4] * 0.01).tolist(), rel=1e-6)
    assert (state["health.samples"], state["health.replaced"], state["failure.sample"]) == ([3], [1], [2])
    assert state["failure.status"][0] & REPLACED


@pytest.mark.slow
@needs_target("cortex-m7")
def test_options_give_the_same_words_on_a_target_and_cost_little(tmp_path):
    """With the allocator of the slew: no word differs on a Cortex-M7; `docs/flight_c.md` has the instructions."""
    found = {}
    for name, options in (("off", {}), ("on", {**ALL, "safe_after": 2, "release_after": 1})):
        mission = handled(**options) if options else casadi_gnc.load("huang2020/slew")
        generate(mission, tmp_path / name, scheme="funnel_pinv", tunable=("rate_gain",), steps=100, name="slew")
        found[name] = targets.measure(tmp_path / name, "slew", boards.find("cortex-m7"), float_only=False)
        _, expected = read_vectors(tmp_path / name, "float64")
        assert int((found[name].outputs != expected).sum()) == 0
        assert bool((expected[:, -1] & SAFE).any()) == (name == "on")
    more = np.median(found["on"].instructions) - np.median(found["off"].instructions)
    assert 0 < more <= 300  # of 1751


def test_a_package_without_options_has_nothing_of_them():
    """The controller, so its text, is that of a mission that never heard of them."""
    plain = describe(casadi_gnc.load("huang2020/slew"), "pd_pinv", GAINS)
    bare = describe(dataclasses.replace(casadi_gnc.load("huang2020/slew"), fault_handling=None), "pd_pinv", GAINS)
    assert plain.faults is None
    assert saving.to_text(plain) == saving.to_text(bare)
    assert not {"SAFE_MODE", "MEASUREMENT_STALE"} & {name for name, _ in plain.raised.values()}


def test_a_saved_controller_keeps_its_options():
    made = describe(handled(**{**ALL, "safe_output": "hold"}), "pd_pinv", GAINS)
    assert saving.from_text(saving.to_text(made)).faults == made.faults
    failures = REPLACED | 256 | STALE | SHIFTED  # 256: COMMAND_REPLACED
    held = (("mrp", 2), ("rate", 2))
    assert made.faults == Faults(failures, True, True, held, (), 3, release_after=4, fade=10, image=True)
    # Without a gain that can change there is nothing to move between.
    assert describe(handled(gain_change_s=1.0), "pd_pinv").faults == Faults(REPLACED | 256 | SHIFTED)
    asked = handled(latch_first=True, failures=["EFFORT_SHORT", "ALLOCATION_FAILED"])
    assert describe(asked, "pd_pinv").faults == Faults(8, latch=True)


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"safe_after": 3}, "safe_after needs safe_output, which says what the actuators are told"),
        ({"release_after": 3}, "release_after needs safe_output"),
        ({"safe_output": "zero"}, "safe_output needs safe_after or measurement_age_s, which say when it is used"),
        ({"safe_output": "off", "safe_after": 1}, 'safe_output is \'off\', expected "zero", "hold" or a number'),
        ({"failures": ["FUNNEL_LEFT"]}, "failures needs latch_first or safe_after"),
        ({"safe_output": "zero", "safe_after": -1}, "safe_after is -1, expected from 1 to"),
    ],
)
def test_options_that_need_others_are_refused(options, told):
    with pytest.raises(FaultHandlingError, match=re.escape(told)):
        FaultHandling(**options)


def test_options_that_do_not_fit_a_scheme_are_refused_with_their_line(tmp_path):
    text = read("huang2020/slew").text

    def refused(table: str) -> str:
        (tmp_path / "slew.toml").write_text(f"{text}\n[fault_handling]\n{table}\n")
        with pytest.raises(ProblemError) as error:
            casadi_gnc.load(tmp_path / "slew.toml")
        return str(error.value)

    last = len(text.splitlines()) + 3
    assert f"line {last}" in refused("measurement_age_s = 0.05")
    assert "measurement_age_s is 0.05 s, expected at least one sample period, 0.1 s" in refused(
        "measurement_age_s = 0.05"
    )
    assert "has 'speed', which is not measured" in refused("measurement_age_s = { speed = 1.0 }")
    assert "has 2 numbers, expected one for each of 12" in refused("safe_after = 2\nsafe_output = [0.0, 0.0]")
    assert "tells actuator 3 1, outside its bounds, 0 to 0.00375" in refused(
        "safe_after = 2\nsafe_output = [0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]"
    )
    assert "has 'FUNEL_LEFT', which is no bit of a status" in refused('latch_first = true\nfailures = ["FUNEL_LEFT"]')
    assert "has no bit that scheme" in refused('latch_first = true\nfailures = ["KEEP_OUT_ENTERED"]')
    assert "needs measurement_age_s" in refused('latch_first = true\nfailures = ["MEASUREMENT_STALE"]')
    assert "safe_after needs safe_output" in refused("safe_after = 2")


def test_a_change_of_gains_needs_gains(tmp_path):
    with pytest.raises(PackageError, match="gain_change_s needs gains that can change; name them by --tunable"):
        generate(handled(gain_change_s=1.0), tmp_path / "slew", scheme="pd_pinv")
    with pytest.raises(PackageError, match="gain_change_s needs gains that can change"):
        casadi_gnc.generate_fmu(handled(gain_change_s=1.0), tmp_path / "slew.fmu", scheme="pd_pinv")
