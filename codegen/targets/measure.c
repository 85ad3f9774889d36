/* SPDX-License-Identifier: MIT-0
 *
 * Replay a package's vectors on a board and write to the host's file `words.bin` the numbers listed
 * in `enum number`, as 64-bit integers, then the instructions of each step, then its output words.
 *
 * `replay.h` of the package says what a step is.
 */
#include <string.h>

#include "replay.h"
#include "target.h"

#define PAINT 0x5au
/* Below the stack pointer a function may use that much without moving it. */
#if defined(__powerpc64__)
#define GAP 512
#else
#define GAP 16
#endif

/* ORDER is 1 and tells the order of octets; stack in bytes, below the caller. */
enum number { ORDER, STEPS, OUTPUTS, EMPTY_INSTRUCTIONS, INIT_INSTRUCTIONS, INIT_STACK, STEP_STACK, STATE_SIZE,
              PARAMS_SIZE, NUMBERS };

static replay_state state;
static replay_params params;
static replay_row rows;
static uint64_t numbers[NUMBERS + REPLAY_STEPS];

static uint32_t nothing(replay_state *s, const replay_params *p, const replay_input *i, replay_output *o)
{
    (void)s, (void)p, (void)i, (void)o;
    return 0u;
}

/* Called through memory, so that neither is inlined and both cost the same call. */
static uint32_t (*volatile empty)(replay_state *, const replay_params *, const replay_input *, replay_output *) = nothing;
static uint32_t (*volatile step)(replay_state *, const replay_params *, const replay_input *,
                                 replay_output *) = replay_step;
static int32_t (*volatile init)(replay_params *) = replay_init;

static unsigned char *stack_pointer(void)
{
    unsigned char *at;
#if defined(__arm__)
    __asm__ volatile("mov %0, sp" : "=r"(at));
#elif defined(__powerpc64__)
    __asm__ volatile("mr %0, 1" : "=r"(at));
#else
    __asm__ volatile("mv %0, sp" : "=r"(at));
#endif
    return at;
}

/* Written and read through volatile pointers: loops in registers, which need no stack themselves. */
__attribute__((noinline)) static void paint(void)
{
    volatile unsigned char *at = target_stack_bottom;
    while (at < stack_pointer() - GAP) *at++ = PAINT;
}

/* Bytes of stack used below the caller since it was painted, if more than GAP. */
__attribute__((noinline)) static uint64_t depth(void)
{
    const volatile unsigned char *at = target_stack_bottom;
    while (at < stack_pointer() && *at == PAINT) at++;
    return (uint64_t)(stack_pointer() - at);
}

int main(void)
{
    const int file = target_open("words.bin");
    static replay_input input;
    static replay_output output;
    uint64_t before;
    long k;
    paint();
    before = target_instructions();
    (void)empty(&state, &params, &input, &output);
    numbers[EMPTY_INSTRUCTIONS] = target_instructions() - before;

    before = target_instructions();
    if (init(&params) != 0) return 5;
    numbers[INIT_INSTRUCTIONS] = target_instructions() - before;
    numbers[INIT_STACK] = depth();
    replay_reset(&state);
    paint();
    for (k = 0; k < REPLAY_STEPS; k++) {
        replay_load(k, &input);
        before = target_instructions();
        (void)step(&state, &params, &input, &output);
        numbers[NUMBERS + k] = target_instructions() - before;
        replay_store(&output, rows[k]);
    }
    numbers[ORDER] = 1;
    numbers[STEPS] = REPLAY_STEPS;
    numbers[OUTPUTS] = REPLAY_OUTPUTS;
    numbers[STEP_STACK] = depth();
    numbers[STATE_SIZE] = sizeof state;
    numbers[PARAMS_SIZE] = sizeof params;
    target_write(file, numbers, sizeof numbers);
    target_write(file, rows, sizeof rows);
    return 0;
}
