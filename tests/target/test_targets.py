"""The same words on every target as on the host, over a closed loop, and what a step costs there."""

import dataclasses

import casadi as ca
import numpy as np
import pytest
from other_truths import with_plant
from packages import copied, made, needs_target

import casadi_gnc
from casadi_gnc.allocation.in_flight import Direct
from casadi_gnc.delivery.vectors import fly_package
from casadi_gnc.delivery.verifying import read_vectors
from casadi_gnc.embedded import boards, package, targets
from casadi_gnc.embedded.controller import Options
from casadi_gnc.embedded.host import HostPackage
from casadi_gnc.errors import TargetError
from casadi_gnc.missions.onboard import describe

#: One mission of each paper, by the scheme that is its own.
MISSIONS = [
    ("huang2020/slew", "funnel_pinv"),
    ("huang2020/slew", "funnel_robust"),
    ("huang2019/nominal", "observers_robust"),
    ("shi2020/docking", "iobc"),
    ("sun2018/circular_orbit", "tracking"),
    ("tao2019/case1", "funnels"),
]
HARDWARE = [
    pytest.param(mission, real, name, marks=needs_target(name), id=f"{mission[0]}-{mission[1]}-{real}-{name}")
    for real, name in [
        ("float64", "cortex-m7"),
        ("float64", "rv64"),
        ("float64", "ppc64"),
        ("float32", "cortex-m4f"),
        ("float32", "cortex-m7"),
        ("float32", "rv64"),
        ("float32", "ppc64"),
    ]
    for mission in (MISSIONS if name != "ppc64" else MISSIONS[1:2])
]


@needs_target("cortex-m7")
def test_filter_law_and_unloading_of_a_satellite_are_small():
    """Gyro, star tracker, Kalman filter, feedback, coils, wheels: no word differs, at most 6000 instructions a step."""
    name = "earth_pointing_day"
    folder = made(f"satellites/{name}", "mrp", "float64")
    _, expected = read_vectors(folder, "float64")
    found = targets.measure(folder, name, boards.find("cortex-m7"), float_only=False)
    assert int((found.outputs != expected).sum()) == 0
    assert found.instructions.max() <= 6000


@pytest.mark.parametrize(("mission", "real", "name"), HARDWARE)
def test_no_word_differs(mission, real, name):
    """1000 samples in closed loop, allocator included, then 24 with bad measurements."""
    target = boards.find(name)
    folder = made(*mission, real)
    _, expected = read_vectors(folder, real)
    found = targets.measure(folder, mission[0].split("/")[1], target, float_only=real == "float32")
    assert found.outputs.shape == expected.shape
    assert len(expected) >= 1000
    assert int((found.outputs != expected).sum()) == 0
    assert found.data == 0 or name == "ppc64"  # descriptors of functions, and addresses, count as data there
    assert found.bss == 0


@needs_target("cortex-m4f")
@pytest.mark.parametrize("mission", MISSIONS, ids=lambda mission: mission[0])
def test_no_word_differs_where_double_is_software(mission):
    """The same with every operation on doubles done by the compiler's library, over 200 samples."""
    target = boards.find("cortex-m4f")
    folder = made(*mission, "float64", steps=224)
    _, expected = read_vectors(folder, "float64")
    found = targets.measure(folder, mission[0].split("/")[1], target)
    assert len(expected) >= 200
    assert int((found.outputs != expected).sum()) == 0


@needs_target("cortex-m7")
@pytest.mark.parametrize("optimise", ["-O0", "-O1", "-O3", "-Os"])
def test_no_word_differs_whatever_the_optimiser(optimise):
    target = boards.find("cortex-m7")
    folder = made("huang2020/slew", "funnel_robust", "float64")
    _, expected = read_vectors(folder, "float64")
    assert int((targets.measure(folder, "slew", target, optimise=optimise).outputs != expected).sum()) == 0


def without_allocation(real: str, folder, steps: int = 300):
    """Write the slew's controller with its torque as the actuator: the law alone, nothing to allocate."""
    mission = casadi_gnc.load("huang2020/slew")
    told = mission.scheme("funnel_pinv").actuation
    direct = dataclasses.replace(
        told, effectiveness=ca.DM.eye(3), lower=told.limit_below, upper=told.limit_above, allocator=Direct()
    )
    scheme = dataclasses.replace(mission.scheme("funnel_pinv"), actuation=direct)
    mission = with_plant(mission, dataclasses.replace(mission.truth, effectiveness=ca.DM.eye(3)), schemes=[scheme])
    controller, options = describe(mission), Options("slew", real)
    header = package.replay_header(controller, options, steps)
    package.put(folder, {**package.flight_files(controller, options), "test/replay.h": header})
    host, outputs = HostPackage(folder, "slew"), controller.outputs.size + 1
    flown = fly_package(mission, mission.scheme(), host, outputs, steps)
    package.put(folder, package.replay_files(controller, options, *flown, 0))
    return flown[1]


@pytest.mark.parametrize(
    ("real", "name", "instructions", "text"),
    [
        pytest.param("float", "cortex-m4f", 1500, 6400, marks=needs_target("cortex-m4f")),
        pytest.param("double", "cortex-m7", 1700, None, marks=needs_target("cortex-m7")),
    ],
)
def test_the_slew_law_is_cheap(real, name, instructions, text, tmp_path):
    target = boards.find(name)
    expected = without_allocation(real, tmp_path)
    found = targets.measure(tmp_path, "slew", target, float_only=real == "float")
    assert int((found.outputs != expected).sum()) == 0
    assert found.instructions.max() <= instructions
    assert text is None or found.text <= text


@needs_target("cortex-m7")
def test_the_robust_allocator_keeps_its_budget():
    """Cold: the first sample; warm: the median. The last 24 samples have jumps."""
    target = boards.find("cortex-m7")
    found = targets.measure(made("huang2020/slew", "funnel_robust", "float64"), "slew", target)
    assert found.instructions[0] <= 150_000
    assert np.median(found.instructions) <= 20_000
    assert found.instructions.max() <= 400_000


@needs_target("cortex-m4f")
def test_a_double_in_a_float_package_is_refused(tmp_path):
    target = boards.find("cortex-m4f")
    folder = copied(made("huang2020/slew", "pd_pinv", "float32"), tmp_path)
    source = folder / "slew.c"
    text = source.read_text()
    changed = text.replace("status = (uint32_t)now.flags;", "status = (uint32_t)((double)now.flags * 1.5);")
    assert changed != text
    source.write_text(changed)
    with pytest.raises(TargetError, match="calls double arithmetic on cortex-m4f: __aeabi_"):
        targets.measure(folder, "slew", target, float_only=True)
    assert len(targets.measure(folder, "slew", target).outputs) == 1024


COUNTING = """
#include <stdint.h>
typedef double slew_real;
typedef struct { uint32_t none; } slew_params;
typedef struct { uint32_t none; } slew_state;
typedef struct { slew_real time; } slew_input;
typedef struct { slew_real out; uint32_t status; } slew_output;
int32_t slew_init(slew_params *params);
void slew_reset(slew_state *state);
uint32_t slew_step(slew_state *state, const slew_params *params, const slew_input *input, slew_output *output);
"""
COUNTED = """
#include "slew.h"
int32_t slew_init(slew_params *params) { params->none = 0u; return 0; }
void slew_reset(slew_state *state) { state->none = 0u; }
uint32_t slew_step(slew_state *state, const slew_params *params, const slew_input *input, slew_output *output)
{
    volatile unsigned char room[3000];
    room[0] = 1u;
    (void)state, (void)params;
    output->out = input->time;
    output->status = room[0];
    __asm__ volatile(".rept 1000\\nnop\\n.endr");
    return 0u;
}
"""


@pytest.mark.parametrize("name", [pytest.param(name, marks=needs_target(name)) for name in boards.names()])
def test_counts_and_stack_are_true(name, tmp_path):
    """A step of 1000 no-operations and a few more, with 3000 bytes of locals: known beforehand."""
    target = boards.find(name)
    source = made("huang2020/slew", "pd_pinv")
    replay = (source / "test" / "replay.h").read_text()
    start, end = replay.index("static inline void replay_take"), replay.index("static inline void replay_load")
    replay = replay[:start] + (
        "static inline void replay_take(const replay_word *words, replay_input *input)\n"
        "{\n    input->time = replay_number(words[0]);\n}\n"
    ) + replay[end:]  # fmt: skip
    start = replay.index("static inline void replay_store")
    replay = replay[:start] + (
        "static inline void replay_store(const replay_output *output, replay_word *words)\n"
        "{\n    words[0] = replay_bits(output->out);\n}\n#endif\n"
    )  # fmt: skip
    files = {"slew.h": COUNTING, "slew.c": COUNTED, "test/replay.h": replay}
    files["test/vectors.c"] = (source / "test" / "vectors.c").read_text()
    package.put(tmp_path, files)
    found = targets.measure(tmp_path, "slew", target)
    assert set(found.instructions - found.instructions[0]) <= {-1, 0, 1}
    assert 1000 < found.instructions[0] < 1040
    assert 3000 <= found.step_stack < 3100
    assert 3000 <= found.step_bound.bytes <= found.step_stack + 64
    assert found.step_bound.way[0] == "slew_step"
    assert found.text > 2000
