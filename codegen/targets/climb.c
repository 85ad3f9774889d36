/* SPDX-License-Identifier: MIT-0
 *
 * Search for the dearest step of a package on a board: from samples of its flight on, measurements are changed at random
 * and a change is kept where the step takes as many instructions or more. Writes to the host's file `climb.bin` the most
 * that was found and how many steps were tried, as 64-bit integers after a 1,
 * which tells the order of octets.
 */
#include <string.h>

#include "replay.h"
#include "target.h"

enum { STARTS = 20, TRIES = 60 };

static replay_params params;
static uint64_t drawn = 88172645463325252u;

static uint32_t (*volatile step)(replay_state *, const replay_params *, const replay_input *, replay_output *) = replay_step;

/* Xorshift (Marsaglia, 2003). */
static uint32_t draw(void)
{
    drawn ^= drawn << 13;
    drawn ^= drawn >> 7;
    drawn ^= drawn << 17;
    return (uint32_t)(drawn >> 32);
}

/* Change one to three words: another sample's, the other sign, a size, a small part. */
static void change(replay_word *words)
{
    uint32_t k;
    for (k = 0; k < 1u + draw() % 3u; k++) {
        const uint32_t place = draw() % (uint32_t)REPLAY_INPUTS, way = draw() % 5u;
        const replay_word bit = (replay_word)1 << (8u * sizeof(replay_word) - 1u);
        const replay_word exponent = bit >> (sizeof(replay_word) == 8 ? 11 : 8);
        if (way == 0u) words[place] = replay_inputs[draw() % (uint32_t)REPLAY_STEPS][place];
        if (way == 1u) words[place] ^= bit;
        if (way == 2u) words[place] += exponent;
        if (way == 3u) words[place] -= exponent;
        if (way == 4u) words[place] ^= (replay_word)draw() << (sizeof(replay_word) == 8 ? draw() % 20u : 0u);
    }
}

/* Instructions of the second of two steps; 0 where the counter began anew meanwhile. */
static uint64_t cost(const replay_word *first, const replay_word *second)
{
    static replay_state state;
    static replay_input input;
    static replay_output output;
    uint64_t before, after;
    replay_reset(&state);
    replay_take(first, &input);
    (void)step(&state, &params, &input, &output);
    replay_take(second, &input);
    before = target_instructions();
    (void)step(&state, &params, &input, &output);
    after = target_instructions();
    return after > before ? after - before : 0;
}

int main(void)
{
    const int file = target_open("climb.bin");
    uint64_t found[3] = {1, 0, 0};
    int start, k;
    if (replay_init(&params) != 0) return 5;
    for (start = 0; start < STARTS; start++) {
        replay_word best[2][REPLAY_INPUTS], now[2][REPLAY_INPUTS];
        uint64_t most = 0;
        memcpy(best[0], replay_inputs[draw() % (uint32_t)REPLAY_STEPS], sizeof best[0]);
        memcpy(best[1], replay_inputs[draw() % (uint32_t)REPLAY_STEPS], sizeof best[1]);
        for (k = 0; k < TRIES; k++) {
            uint64_t spent;
            memcpy(now, best, sizeof now);
            if (k > 0) change(now[draw() % 2u]);
            spent = cost(now[0], now[1]);
            if (spent >= most) {
                most = spent;
                memcpy(best, now, sizeof best);
            }
            found[2]++;
        }
        found[1] = most > found[1] ? most : found[1];
    }
    target_write(file, found, sizeof found);
    return 0;
}
