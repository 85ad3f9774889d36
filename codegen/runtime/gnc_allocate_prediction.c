/* SPDX-License-Identifier: MIT-0
 *
 * gnc_allocate_prediction.c - what the last two samples tell of this one.
 *
 * On a steady slew the answer goes on as it went: the change from the sample before is repeated in proportion to the
 * command, so that the Newton step only corrects. That holds while the sets stay the same, whichever way led to the
 * answers: two cold starts that end with the same sets are as good as a path without obstacles.
 */
#include "gnc_allocate_internal.h"

/* If the last change of the command went smoothly, repeat the change of the answer that it caused, as
 * far as today's change of the command points the same way. The sets are kept to compare with, and the last answer
 * where its changes will be, with its sign turned. */
void NAME(predict)(workspace_t *work, last_t *last, const command_t *command)
{
    int a, i, v, goes_on;
    real along = 0, length = 0, ratio;
    last->known = work->warm;
    (void)memcpy(last->side, work->side, sizeof last->side);
    (void)memcpy(last->active, work->active, sizeof last->active);
    for (a = 0; a < R; ++a) {
        const real change = command->b[a] - work->command[a];
        along += change * work->command_change[a];
        length += work->command_change[a] * work->command_change[a];
        work->command_change[a] = change;
        work->command[a] = command->b[a];
    }
    goes_on = work->smooth != 0 && size_of(along) < 2 * length;
    ratio = goes_on ? along / length : 0;
    for (i = 0; i < N; ++i) {
        const real force = work->force[i];
        work->force[i] = goes_on ? force + ratio * work->force_change[i] : force;
        work->force_change[i] = -force;
    }
    for (v = 0; v < V; ++v) {
        const real lambda = work->lambda[v];
        work->lambda[v] = goes_on ? larger(0, lambda + ratio * work->lambda_change[v]) : lambda;
        work->lambda_change[v] = -lambda;
    }
    if (goes_on != 0) {
        NAME(normalise)(work->lambda);
    }
}

/* Remember what has changed since, and whether the sets stayed the same. */
void NAME(remember)(workspace_t *work, const last_t *last)
{
    int i, v, same = last->known;
    for (i = 0; i < N; ++i) {
        same = last->side[i] == work->side[i] ? same : 0;
        work->force_change[i] += work->force[i];
    }
    for (v = 0; v < V; ++v) {
        same = last->active[v] == work->active[v] ? same : 0;
        work->lambda_change[v] += work->lambda[v];
    }
    work->smooth = same;
}
