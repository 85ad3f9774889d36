"""What one call of the on-board allocator costs: a jump of the command no more than a cold start."""

import board_counts
import numpy as np
import online_allocator as oa
import pytest

PLAIN = (oa.A0_2020, oa.E_2020, oa.centre_of_mass_vertices([5e-3] * 3), 1, 1, 1e6)
#: Steps that may be spent from the last answer before a cold start (WARM_WORK in gnc_allocate_internal.h).
WARM_STEPS = 5


def jumping(samples, seed=0):
    """Return a slew whose command jumps in every second sample, by a hundredth of the limit to far beyond it."""
    rng, flight = np.random.default_rng(seed), oa.fly("slew", samples)
    jumps = np.arange(1, samples, 2)
    flight["u"][jumps] += rng.normal(size=(len(jumps), 3)) * 10 ** rng.uniform(-5, -2.5, (len(jumps), 1))
    flight["u"][jumps[::9]] = 0
    return [flight[name] for name in ("u", "previous", "lower", "upper")]


def test_after_a_jump_the_path_is_given_up_and_the_answer_is_that_of_a_cold_start():
    """Few steps from the last answer, or else the words of a reset workspace after few steps more."""
    allocator = oa.Allocator(12, 3, 3, 8)
    allocator.setup(*PLAIN)
    commands = jumping(1000)
    _, warm = allocator.sequence(*commands, mode=oa.WARM)
    _, cold = allocator.sequence(*commands, mode=oa.COLD)
    given_up = warm["active_set_iterations"] > WARM_STEPS
    given_up[0] = True
    assert 300 < given_up.sum() < 950  # there and back; some jumps are small enough to follow
    assert np.array_equal(warm["force"][given_up], cold["force"][given_up])
    assert np.array_equal(warm["lam"][given_up], cold["lam"][given_up])
    assert (warm["active_set_iterations"] <= cold["active_set_iterations"] + WARM_STEPS).all()
    assert (warm["status"] == oa.OPTIMAL).all()


@pytest.mark.tools("arm-none-eabi-gcc", "qemu-system-arm")
def test_instructions_of_slew_and_jumps_on_a_board(tmp_path):
    """Counts on a Cortex-M7, exact; the limits are what was measured, rounded up."""
    flight = oa.fly("slew", 1000)
    slew = [flight[name] for name in ("u", "previous", "lower", "upper")]
    cold, warm, text = board_counts.counts(tmp_path, (12, 3, 3, 8), PLAIN, slew)
    usual = np.median(cold["instructions"])
    assert text < 24_000
    assert usual < 100_000
    assert np.median(warm["instructions"]) < 15_000
    assert warm["instructions"][0] <= 1.2 * usual  # the first sample
    assert warm["instructions"].max() <= 1.2 * cold["instructions"].max()
    single_cold, single, _ = board_counts.counts(tmp_path, (12, 3, 3, 8), PLAIN, slew, single=True)
    assert (single["relative_gap"] <= 1e-5).all()
    assert np.median(single["instructions"]) <= 2 * np.median(warm["instructions"])
    assert np.median(single_cold["instructions"]) <= 2 * usual
    cold, warm, _ = board_counts.counts(tmp_path, (12, 3, 3, 8), PLAIN, jumping(1000))
    ratio = warm["instructions"] / cold["instructions"]
    assert np.median(cold["instructions"]) < 100_000
    assert np.quantile(ratio, 0.5) <= 1.2
    assert warm["instructions"].max() <= 1.2 * cold["instructions"].max()
    # Where the ratio is larger, the cold start is one of the short ones.
    assert (warm["instructions"].astype(int) - cold["instructions"]).max() <= 0.55 * usual


@pytest.mark.tools("arm-none-eabi-gcc", "qemu-system-arm")
def test_single_precision_on_a_board_without_doubles(tmp_path):
    """A Cortex-M4F: every sample certified, for less than 40,000 instructions in the median."""
    flight = oa.fly("slew", 300)
    slew = [flight[name] for name in ("u", "previous", "lower", "upper")]
    _, warm, text = board_counts.counts(tmp_path, (12, 3, 3, 8), PLAIN, slew, board="cortex-m4f", single=True)
    assert np.median(warm["instructions"]) < 40_000
    assert (warm["relative_gap"] <= 1e-5).all()
    assert text < 24_000
