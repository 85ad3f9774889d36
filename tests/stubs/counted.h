/* What the tasks of the tests do with a package: steps from its vectors, and differing words counted. */
#include "replay.h"

void sat_take(sat_input *input);
void sat_give(const sat_output *output);

static long k, shifted, wrong;

void sat_take(sat_input *input) { replay_load(k, input); }

/* Count the words of step k that differ, but for the bit that follows a missed period, and go on to the next. */
static void count(const sat_output *output)
{
    replay_word found[REPLAY_OUTPUTS];
    int i;
    replay_store(output, found);
    shifted += (found[REPLAY_OUTPUTS - 1] & SAT_TIME_SHIFTED) != 0;
    found[REPLAY_OUTPUTS - 1] &= ~(replay_word)SAT_TIME_SHIFTED;
    for (i = 0; i < REPLAY_OUTPUTS; i++) wrong += found[i] != replay_outputs[k][i];
    k++;
}
