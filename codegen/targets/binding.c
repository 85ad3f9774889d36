/* SPDX-License-Identifier: MIT-0
 *
 * A package behind plain arrays, for hosts that load it as a shared library.
 */
#include "replay.h"

long binding_size(int which);
int binding_init(void *params);
void binding_reset(void *state);
void binding_replay(void *state, const void *params, long steps, const replay_word *inputs, replay_word *outputs);

/* Bytes of state (0), parameters (1) and a word (2); words of a sample in (3) and out (4). */
long binding_size(int which)
{
    const long sizes[5] = {(long)sizeof(replay_state), (long)sizeof(replay_params), (long)sizeof(replay_word),
                           REPLAY_INPUTS, REPLAY_OUTPUTS};
    return sizes[which];
}

int binding_init(void *params) { return (int)replay_init((replay_params *)params); }

void binding_reset(void *state) { replay_reset((replay_state *)state); }

void binding_replay(void *state, const void *params, long steps, const replay_word *inputs, replay_word *outputs)
{
    long k;
    for (k = 0; k < steps; k++) {
        replay_input input;
        replay_output output;
        replay_take(inputs + k * REPLAY_INPUTS, &input);
        (void)replay_step((replay_state *)state, (const replay_params *)params, &input, &output);
        replay_store(&output, outputs + k * REPLAY_OUTPUTS);
    }
}
