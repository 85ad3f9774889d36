"""Packages under abuse: many threads, two of them in one image, and a million samples of rubbish."""

import numpy as np
import pytest
from packages import C99, made, run, units

import casadi_gnc
import casadi_gnc.laws
from casadi_gnc.delivery.vectors import CompiledPlant
from casadi_gnc.delivery.verifying import read_vectors
from casadi_gnc.embedded.compare import as_numbers, as_words
from casadi_gnc.embedded.host import HostPackage
from casadi_gnc.missions.onboard import describe, sampled
from casadi_gnc.status import StepStatus

THREADS = r"""
#define _POSIX_C_SOURCE 200809L
#include <pthread.h>
#include <stdio.h>
#include <string.h>
#include "a/slew.h"
#include "b/other.h"
#define STEPS 200
/* A hash of the outputs of a flight over its own measurements: a ramp that depends on the seed. */
#define FLIGHT(name, NAME)                                                                          \
    static unsigned long long name##_flight(double seed, int yield)                                 \
    {                                                                                               \
        unsigned long long hash = 14695981039346656037ull;                                          \
        name##_params params;                                                                       \
        name##_state state;                                                                         \
        int k;                                                                                      \
        size_t i;                                                                                   \
        (void)name##_init(&params);                                                                 \
        name##_reset(&state);                                                                       \
        for (k = 0; k < STEPS; k++) {                                                               \
            name##_input in;                                                                        \
            name##_output out;                                                                      \
            memset(&out, 0, sizeof out);                                                            \
            in.time = (name##_real)(0.1 * k);                                                       \
            for (i = 0; i < 3; i++) {                                                               \
                in.mrp[i] = (name##_real)(seed * 0.001 * (double)(k % 97) * (double)(i + 1));       \
                in.rate[i] = (name##_real)(seed * 0.0001 * (double)(k % 13));                       \
            }                                                                                       \
            (void)name##_step(&state, &params, &in, &out);                                          \
            for (i = 0; i < sizeof out; i++) hash = (hash ^ ((unsigned char *)&out)[i]) * 1099511628211ull; \
            if (yield && k % 7 == 0) sched_yield();                                                 \
        }                                                                                           \
        return hash;                                                                                \
    }
#include <sched.h>
FLIGHT(slew, SLEW)
FLIGHT(other, OTHER)
typedef struct { int which; double seed; unsigned long long hash; } job;
static void *work(void *given)
{
    job *const mine = (job *)given;
    mine->hash = mine->which ? other_flight(mine->seed, 1) : slew_flight(mine->seed, 1);
    return NULL;
}
int main(void)
{
    job jobs[8];
    pthread_t threads[8];
    int i, wrong = 0;
    for (i = 0; i < 8; i++) {
        jobs[i].which = i % 2;
        jobs[i].seed = 1.0 + i / 2;
        if (pthread_create(&threads[i], NULL, work, &jobs[i]) != 0) return 2;
    }
    for (i = 0; i < 8; i++) (void)pthread_join(threads[i], NULL);
    for (i = 0; i < 8; i++) {
        const unsigned long long alone = (i % 2) ? other_flight(jobs[i].seed, 0) : slew_flight(jobs[i].seed, 0);
        wrong += alone != jobs[i].hash;
    }
    /* Different flights must have different hashes, or the comparison says nothing. */
    wrong += jobs[0].hash == jobs[1].hash || jobs[0].hash == jobs[2].hash;
    printf("%d flights differ\n", wrong);
    return wrong;
}
"""


@pytest.mark.slow
def test_two_controllers_four_threads_each(tmp_path):
    """One image, two packages with allocators of their own: the words of each as if it were alone."""
    a = made("huang2020/slew", "funnel_robust", "float64")
    b = made("huang2020/detumble", "observer_robust", "float32", name="other")
    (tmp_path / "a").symlink_to(a)
    (tmp_path / "b").symlink_to(b)
    (tmp_path / "main.c").write_text(THREADS)
    command = ["gcc", *C99, "-O2", "-fsanitize=thread", "-g", "-pthread", "-I", tmp_path]
    objects = []
    for folder in (a, b):
        for source in units(folder):
            objects.append(tmp_path / f"{source.stem}.o")
            done = run(*command, "-c", source, "-o", objects[-1])
            assert done.returncode == 0, done.stderr
    done = run(*command, tmp_path / "main.c", *objects, "-lm", "-o", tmp_path / "threads")
    assert done.returncode == 0, done.stderr
    done = run(tmp_path / "threads")
    assert done.returncode == 0, done.stdout + done.stderr[:3000]
    assert done.stdout == "0 flights differ\n"


FUZZ = r"""
#include <stdio.h>
#include <stdlib.h>
#include "replay.h"
/* xorshift64*, a fixed seed. */
static unsigned long long next(unsigned long long *s)
{
    *s ^= *s >> 12, *s ^= *s << 25, *s ^= *s >> 27;
    return *s * 2685821657736338717ull;
}
static int finite(double x) { return x - x == 0; }
static const double LOWER[] = {@LOWER@}, UPPER[] = {@UPPER@};
int main(int count, char **values)
{
    static replay_params params;
    static replay_state state;
    const long steps = (count > 1) ? atol(values[1]) : 1000;
    unsigned long long seed = 88172645463325252ull;
    replay_word words[REPLAY_INPUTS], found[REPLAY_OUTPUTS];
    long k, bad = 0, unseen = 0;
    int i;
    (void)replay_init(&params);
    replay_reset(&state);
    for (k = 0; k < steps; k++) {
        replay_input in;
        replay_output out;
        int broken = 0, at = (int)(next(&seed) % REPLAY_INPUTS);
        replay_load(k % 900, &in);
        memcpy(words, replay_inputs[k % 900], sizeof words);
        switch (next(&seed) % 10) {
        case 0: words[at] = (replay_word)next(&seed); break;              /* any bits */
        case 1: words[at] = replay_bits((slew_real)NAN_); broken = at > 0; break;
        case 2: words[at] = replay_bits((slew_real)INF_); broken = at > 0; break;
        case 3: words[at] = replay_bits((slew_real)-INF_); broken = at > 0; break;
        case 4: words[at] = (replay_word)(next(&seed) % 4096); break;     /* subnormal numbers */
        case 5: words[at] = replay_bits((slew_real)1e30); broken = at > 0; break;
        case 6: for (i = 0; i < REPLAY_INPUTS; i++) words[i] = (replay_word)next(&seed); break;
        default: break;                                                   /* a good sample */
        }
        replay_take(words, &in);
        if (next(&seed) % 50 == 0) { /* memory hit by radiation */
            unsigned char *const byte = (unsigned char *)&state + next(&seed) % @MEMORY@;
            *byte ^= (unsigned char)(1u << (next(&seed) % 8));
        }
        (void)replay_step(&state, &params, &in, &out);
        replay_store(&out, found);
        for (i = 0; i + 1 < REPLAY_OUTPUTS; i++) {
            const double x = (double)replay_number(found[i]);
            const int inside = i >= @ACTUATORS@ || (x >= LOWER[i] && x <= UPPER[i]);
            if (finite(x) && inside) continue;
            if (bad++ < 3) printf("step %ld, output %d: %g\n", k, i, x);
        }
        if (broken && !(out.status & @REPLACED@u) && unseen++ < 3) printf("step %ld, input %d unseen\n", k, at);
    }
    for (k = 0; k < 3; k++) { /* good samples again: nothing is replaced */
        replay_input in;
        replay_output out;
        replay_load(k, &in);
        (void)replay_step(&state, &params, &in, &out);
        unseen += (out.status & @REPLACED@u) != 0u;
    }
    printf("bad %ld unseen %ld\n", bad, unseen);
    return bad != 0 || unseen != 0;
}
"""

#: Laws by a scheme whose allocation is cheap, and the robust allocator with fewer samples; steps under sanitizers.
LAWS = [
    ("huang2020/slew", "funnel_pinv", "float64", 1_000_000),
    ("huang2020/slew", "funnel_pinv", "float32", 1_000_000),
    ("huang2020/slew", "pd_pinv", "float64", 1_000_000),
    ("huang2020/detumble", "observer_pinv", "float64", 1_000_000),
    ("huang2020/detumble", "damping_pinv", "float64", 1_000_000),
    ("huang2019/nominal", "observers_pinv", "float64", 1_000_000),
    ("huang2019/nominal", "finite_time_pinv", "float64", 1_000_000),
    ("shi2020/docking", "iobc", "float64", 1_000_000),
    ("shi2020/docking_as_printed", "dobc", "float64", 1_000_000),
    ("sun2018/circular_orbit", "tracking", "float64", 1_000_000),
    ("tao2019/case1", "funnels", "float64", 1_000_000),
    ("huang2020/slew", "funnel_robust", "float64", 20_000),
    ("huang2020/slew", "funnel_robust", "float32", 5_000),
    ("satellites/earth_pointing", "mrp", "float64", 100_000),
    ("satellites/slew_and_track", "eigenaxis", "float64", 100_000),
    ("satellites/detumble_bdot", "bdot", "float64", 100_000),
    ("satellites/safe_mode", "modes", "float64", 100_000),
]
#: Parts of the steps: a twentieth is fast, but where it takes long to compile.
RUNS = [
    pytest.param(law, part, marks=pytest.mark.slow if part == 1 else (), id="-".join(law[:3]) + f"-1/{part}")
    for law in LAWS
    for part in (1, 20)
    if part == 1 or not (law[1] == "funnel_robust" or law[0].startswith("satellites/"))
]


def test_every_law_is_fuzzed():
    """A new law is added to the list, or this fails."""
    flown = {type(casadi_gnc.load(problem).scheme(scheme).law) for problem, scheme, *_ in LAWS}
    assert flown == {casadi_gnc.laws.REGISTRY.find(name) for name in casadi_gnc.laws.REGISTRY.shipped()}


@pytest.mark.parametrize(("case", "part"), RUNS)
def test_rubbish_in_never_rubbish_out(case, part, tmp_path):
    """Any bits on any input, and bits flipped in the memory: finite outputs inside the bounds, the right status, and
    no undefined behaviour."""
    problem, scheme, real, steps = case
    folder = made(problem, scheme, real)
    controller = describe(casadi_gnc.load(problem), scheme)
    name = problem.split("/")[1]
    size = 8 if real == "float64" else 4
    memory = size * (controller.memory.size + controller.measured.size + controller.actuators.size)
    text = FUZZ.replace("slew_", f"{name}_")
    for mark, value in {
        "@LOWER@": ", ".join(map(repr, rounded(controller.lower, real))),
        "@UPPER@": ", ".join(map(repr, rounded(controller.upper, real))),
        "@ACTUATORS@": controller.actuators.size,
        "@MEMORY@": memory,
        "@REPLACED@": int(StepStatus.MEASUREMENT_REPLACED),
        "NAN_": "(0.0 / zero)",
        "INF_": "(1.0 / zero)",
    }.items():
        text = text.replace(mark, str(value))
    text = text.replace("static int finite", "static volatile double zero = 0.0;\nstatic int finite", 1)
    (tmp_path / "fuzz.c").write_text(text)
    sanitizers = "-fsanitize=address,undefined,float-cast-overflow"
    flags = [*C99, "-O2", "-g", sanitizers, "-fno-sanitize-recover=all", f"-I{folder}", f"-I{folder / 'test'}"]
    sources = [*units(folder), folder / "test" / "vectors.c", tmp_path / "fuzz.c"]
    done = run("gcc", *flags, *sources, "-lm", "-o", tmp_path / "fuzz")
    assert done.returncode == 0, done.stderr
    done = run(tmp_path / "fuzz", steps // part)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[:2000]
    assert done.stdout == "bad 0 unseen 0\n"


def rounded(bounds, real):
    """Return bounds as the type rounds them."""
    return [float(np.float32(bound)) if real == "float32" else bound for bound in bounds]


@pytest.mark.parametrize(
    ("problem", "scheme", "seconds"),
    [
        ("huang2020/slew", "funnel_pinv", 200.0),
        ("huang2020/detumble", "observer_pinv", 200.0),
        ("shi2020/docking", "iobc", 60.0),
        ("sun2018/circular_orbit", "tracking", 30.0),
    ],
)
def test_recovers_after_bad_input(problem, scheme, seconds):
    """Half a second of bad sensors in the middle of a closed loop: the flight ends where it ends without."""
    mission = sampled(casadi_gnc.load(problem))
    controller = describe(mission, scheme)
    folder, chosen = made(problem, scheme, "float64"), mission.scheme(scheme)
    ends, seen = [], 0
    for spoiled in (False, True):
        plant, host = CompiledPlant(mission, chosen), HostPackage(folder, problem.split("/")[1])
        samples = round(seconds / mission.timing.sample_period)
        burst = range(samples // 3, samples // 3 + max(5, round(0.5 / mission.timing.sample_period)))
        for k in range(samples):
            row = plant.measure(k)
            if spoiled and k in burst:
                row[1 + k % (len(row) - 1)] = (np.nan, np.inf, -1e300)[k % 3]
            words = host.replay(as_words(row, host.word)[None, :], controller.outputs.size + 1)[0]
            if k in burst:
                seen += bool(int(words[-1]) & StepStatus.MEASUREMENT_REPLACED)
            plant.advance(k, as_numbers(words[: controller.actuators.size]))
        assert int(words[-1]) & StepStatus.MEASUREMENT_REPLACED == 0
        ends.append(plant.x)
    assert seen == len(burst)
    scale = np.abs(np.array(mission.start)).max()
    # What half a second of stale measurements left is forgotten: within 1 % of the start of the manoeuvre.
    assert np.abs(ends[0] - ends[1]).max() <= 0.01 * scale, (ends, scale)


def test_memory_starts_at_the_first_good_measurement():
    """Bad sensors at power-up leave no trace: the first good sample is answered as if it were the first of all."""
    folder = made("huang2020/detumble", "observer_pinv", "float64")
    inputs, _ = read_vectors(folder, "float64")
    host = HostPackage(folder, "detumble")
    fresh = host.replay(inputs[5:8], 19)
    bad = as_numbers(inputs[2:5].copy())
    bad[:, 4:] = np.nan, np.inf, -1e300
    host.reset()
    first = host.replay(as_words(bad, host.word), 19)
    assert (first[:, -1] & StepStatus.MEASUREMENT_REPLACED.value).all()
    assert np.isfinite(as_numbers(np.ascontiguousarray(first[:, :-1]))).all()
    assert (host.replay(inputs[5:8], 19) == fresh).all()
    # A later bad sample does not start anything anew.
    host.replay(as_words(bad, host.word), 19)
    assert (host.replay(inputs[5:8], 19) != fresh).any()
