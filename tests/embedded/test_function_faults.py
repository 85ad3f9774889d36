"""What the package of a function does with faults, step by step as by hand; its state as octets; what is refused."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from packages import C99, STRICT, run

import casadi_gnc as gnc
from casadi_gnc.embedded.controller import Options
from casadi_gnc.embedded.faults import LATCHED, SAFE_MODE, STALE, Faults
from casadi_gnc.embedded.flight_function import FlightFunction, flight_function, from_text, to_text
from casadi_gnc.embedded.function_machine import FunctionMachine
from casadi_gnc.embedded.function_source import function_files
from casadi_gnc.embedded.package import put
from casadi_gnc.errors import FaultHandlingError, GncError

NAN = float("nan")
ALL = gnc.FaultHandling(
    failures=["INPUT_REFUSED"], count=True, latch_first=True, measurement_age_s=0.02, safe_output=[9.5], safe_after=4,
    release_after=2, state_image=True,
)  # fmt: skip
#: Input, output and status of each step: outputs are held for two steps, then old; two good steps end safe mode.
STEPS = [
    (1.0, 1.0, 0),
    (NAN, 1.0, 1 | LATCHED),
    (NAN, 1.0, 1 | LATCHED),
    (NAN, 9.5, 1 | STALE | SAFE_MODE | LATCHED),
    (2.0, 9.5, SAFE_MODE | LATCHED),  # u = 3 beneath
    (3.0, 9.5, SAFE_MODE | LATCHED),  # u = 6
    (4.0, 10.0, LATCHED),
    (NAN, 10.0, 1 | LATCHED),
    (5.0, 15.0, LATCHED),
]


def summed(name: str = "summed") -> ca.Function:
    """Return a function that adds up what it was given."""
    x, i = ca.SX.sym("x"), ca.SX.sym("i")
    return ca.Function(name, [x, i], [x + i, i + x], ["x", "i"], ["u", "i_next"])


def handled(asked: gnc.FaultHandling = ALL, rate: float | None = 100.0) -> FlightFunction:
    own = flight_function(summed(), state={"i": "i_next"}, rate=rate)
    return replace(own, faults=asked.of_function(own))


CALLER = r"""
#include <math.h>
#include <string.h>
#include "summed.h"
static summed_state state, other;
static summed_output output;
static const summed_input given[] = {%(given)s};
static const double told[] = {%(told)s};
static const uint32_t said[] = {%(said)s};
int main(void)
{
    uint8_t image[SUMMED_IMAGE_OCTETS], again[SUMMED_IMAGE_OCTETS];
    summed_input next = {7.0};
    int k, i;
    if (summed_export(&state, image) != 1 || summed_init(&state) != 0) return 1;
    for (k = 0; k < %(count)d; ++k) {
        if (summed_step(&state, &given[k], &output) != said[k] || output.u != told[k]) return 10 + k;
    }
    if (state.health.samples != 9u || state.health.refused != 4u || state.failure.sample != 2u) return 2;
    if (state.failure.status != 1u || state.in_a_row.input_refused != 0u || state.held.outputs != 0u) return 3;
    if (summed_export(&state, image) != 0 || summed_export(&state, 0) != 1) return 4;
    for (i = 0; i < 8 * SUMMED_IMAGE_OCTETS; ++i) {
        image[i / 8] = (uint8_t)(image[i / 8] ^ (1u << (i %% 8)));
        if (summed_import(&other, image) != 2 || other.ready != 0u) return 5;
        image[i / 8] = (uint8_t)(image[i / 8] ^ (1u << (i %% 8)));
    }
    if (summed_import(&other, image) != 0 || summed_export(&other, again) != 0) return 6;
    if (memcmp(image, again, sizeof image) != 0) return 9;
    if (summed_step(&other, &next, &output) != %(latched)du || output.u != 22.0) return 7;
    summed_acknowledge(&other);
    return summed_step(&other, &next, &output) == 0u && output.u == 29.0 ? 0 : 8;
}
"""


def test_each_step_says_and_does_what_it_must_and_the_state_goes_over_as_octets(tmp_path):
    about = {
        "given": ", ".join("{NAN}" if np.isnan(x) else f"{{{x}}}" for x, _, _ in STEPS),
        "told": ", ".join(f"{u}" for _, u, _ in STEPS),
        "said": ", ".join(f"{status}u" for _, _, status in STEPS),
        "count": len(STEPS),
        "latched": LATCHED,
    }
    put(tmp_path, {**function_files(handled(), Options("summed")), "main.c": CALLER % about})
    for check in ("0", "1"):
        command = ["gcc", *C99, *STRICT, f"-DSUMMED_CHECK_STATE={check}", "-o", tmp_path / "run"]
        build = run(*command, tmp_path / "main.c", tmp_path / "summed.c", "-lm")
        assert build.returncode == 0, build.stderr
        assert run(tmp_path / "run").returncode == 0


def test_the_machine_does_the_same():
    found = FunctionMachine(handled()).replay(np.array([[x] for x, _, _ in STEPS]))
    assert found[:, 0].tolist() == [u for _, u, _ in STEPS]
    assert found[:, -1].astype(int).tolist() == [status for _, _, status in STEPS]


def test_options_are_kept_with_the_function_and_cost_nothing_where_they_are_off():
    assert from_text(to_text(handled())).faults == handled().faults
    plain = flight_function(summed(), state={"i": "i_next"}, rate=100.0)
    off = replace(plain, faults=Faults())
    files = [function_files(own, Options("summed")) for own in (plain, off)]
    assert files[0]["summed.c"] == files[1]["summed.c"]


@pytest.mark.slow
@pytest.mark.parametrize("real", ["float64", "float32"])
def test_a_package_with_everything_is_sound(tmp_path, real):
    rows = np.resize([[x] for x, _, _ in STEPS], (90, 1))
    rows[40:60] = NAN
    given = {"state": {"i": "i_next"}, "rate": 100.0, "vectors": rows, "real": real, "frame": "xtce"}
    gnc.generate(summed(), tmp_path / "summed", **given, fault_handling=ALL)
    assert gnc.verify(tmp_path / "summed")["is_sound"]
    assert "FAILURE_LATCHED" in (tmp_path / "summed" / "README.md").read_text()
    assert '"health.refused"' in (tmp_path / "summed" / "dictionary.json").read_text()


@pytest.mark.parametrize(("asked", "rate", "sentence"), [
    ({"gain_change_s": 1.0}, 100.0, "gain_change_s is for gains of a mission that can change; leave it out"),
    ({"measurement_age_s": {"x": 1.0}}, 100.0, "measurement_age_s names signals; a refused step holds all outputs"),
    ({"measurement_age_s": 1.0}, None, "measurement_age_s needs the period of the function; give its rate"),
    ({"measurement_age_s": 0.001}, 100.0, "measurement_age_s is 0.001 s, expected at least one sample period, 0.01 s"),
    ({"safe_output": "hold", "safe_after": 2}, None, 'safe_output is "hold", which refused steps do anyway'),
    ({"safe_output": [1.0, 2.0], "safe_after": 2}, None, "safe_output has 2 numbers, expected a finite one"),
    ({"latch_first": True, "failures": ["EFFORT_SHORT"]}, None, "failures has 'EFFORT_SHORT', which is no bit"),
    ({"latch_first": True, "failures": ["TIME_SHIFTED"]}, None, "failures has 'TIME_SHIFTED', which is no bit"),
])  # fmt: skip
def test_what_a_function_has_not_is_told(asked, rate, sentence):
    with pytest.raises(FaultHandlingError) as told:
        handled(gnc.FaultHandling(**asked), rate)
    assert str(told.value).startswith(sentence)


def test_a_mission_has_a_table_of_its_own(tmp_path):
    with pytest.raises(GncError, match="fault_handling is not for a mission"):
        gnc.generate("huang2020/slew", tmp_path / "out", fault_handling=ALL)
