/* SPDX-License-Identifier: MIT-0
 *
 * gnc_allocate_obstacle.c - how far the way to the goal of a Newton step is clear, and going it.
 *
 * Each inequality has some room: a free actuator to its bounds, the multiplier of a bound, the weight of an active
 * vertex and the slack of another one to zero. The first that is used up is the obstacle.
 */
#include "gnc_allocate_internal.h"

#define OPENING (real)0.01 /* room that open_up gives, of the box, the largest gradient, the worst q_v */
#define SMALL (real)0.01   /* of the tolerance: a multiplier or slack this wrong does not show in the gap */
#ifdef GNC_ALLOC_REAL_FLOAT
#define SLIP 1e-4F /* of the box: a force this far outside is clipped, not bound; its gap is the square */
#else
#define SLIP 1e-8
#endif

/* Keep the weights on the simplex, which the certificate asks for, against rounding. */
void NAME(normalise)(real *lambda)
{
    int v;
    real sum = 0;
    for (v = 0; v < V; ++v) {
        sum += lambda[v];
    }
    if (!GNC_ASSERT(sum > 0)) {
        return; /* off the simplex: no certificate */
    }
    sum = 1 / sum;
    for (v = 0; v < V; ++v) {
        lambda[v] *= sum;
    }
}

/* How far actuator i is from an obstacle, and would be at the goal: its multiplier when bound, else its room. */
static void room_of_actuator(real *from, real *to, int i, const goal_t *goal, const workspace_t *work,
                             const command_t *command, real small)
{
    const real width = command->upper[i] - command->lower[i];
    *from = 0;
    *to = 0;
    if (work->side[i] != 0) {
        const real multiplier = -goal->bound[i] * (real)work->side[i];
        *from = -work->bound[i] * (real)work->side[i];
        *to = multiplier * width < -small && command->dead[i] == 0 ? multiplier : 0;
    } else if (goal->force[i] < command->lower[i] - SLIP * width) {
        *from = work->force[i] - command->lower[i];
        *to = goal->force[i] - command->lower[i];
    } else if (goal->force[i] > command->upper[i] + SLIP * width) {
        *from = command->upper[i] - work->force[i];
        *to = command->upper[i] - goal->force[i];
    } else {
        *from = 0; /* nothing in the way */
    }
}

/* The same of vertex v: its weight when active, else its slack. Copies never are in the way. */
static void room_of_vertex(real *from, real *to, int v, const goal_t *goal, const workspace_t *work,
                           const data_t *data, real small)
{
    *from = work->active[v] != 0 ? work->lambda[v] : work->slack[v];
    *to = work->active[v] != 0 ? goal->lambda[v] + 16 * EPS : goal->slack[v] + small;
    if (data->original[v] != v) {
        *to = 0;
    }
}

/* The first obstacle on the way to the goal, and the fraction of the way that is clear. */
int NAME(first_obstacle)(real *clear, const goal_t *goal, const workspace_t *work, const data_t *data,
                          const command_t *command, const point_t *point)
{
    int i, obstacle = NOTHING;
    const real small = SMALL * data->tolerance * point->phi; /* what the gap does not notice */
    *clear = 1;
    for (i = 0; i < N + V; ++i) {
        real from, to; /* an obstacle where this crosses zero from above */
        if (i < N) {
            room_of_actuator(&from, &to, i, goal, work, command, small);
        } else {
            room_of_vertex(&from, &to, i - N, goal, work, data, small);
        }
        if (to < 0 && from < *clear * (from - to)) {
            *clear = larger(0, from) / (from - to);
            obstacle = i;
        }
    }
    return obstacle;
}

/* Go to the goal, or a fraction of the way. */
void NAME(move)(workspace_t *work, const goal_t *goal, const command_t *command, real clear, int full)
{
    int i, v;
    if (!GNC_ASSERT(clear >= 0)) {
        return; /* stuck, until the iterations end */
    }
    for (i = 0; i < N; ++i) {
        work->force[i] += clear * (goal->force[i] - work->force[i]);
        if (full != 0) {
            work->force[i] = larger(command->lower[i], smaller(command->upper[i], goal->force[i]));
        }
        work->bound[i] += clear * (goal->bound[i] - work->bound[i]);
    }
    for (v = 0; v < V; ++v) {
        if (work->active[v] != 0) {
            work->lambda[v] = larger(0, work->lambda[v] + clear * (goal->lambda[v] - work->lambda[v]));
        } else {
            work->slack[v] = larger(0, work->slack[v] + clear * (goal->slack[v] - work->slack[v]));
        }
    }
    NAME(normalise)(work->lambda);
}

/* Give every inequality some room: free actuators off their bounds, multipliers and slacks off zero. The
 * path may start from any such point, and from one where much is zero at once it may turn in circles. */
void NAME(open_up)(workspace_t *work, const command_t *command, const point_t *point)
{
    int i, v;
    real largest = 0;
    for (i = 0; i < N; ++i) {
        largest = larger(largest, size_of(point->g[i]));
    }
    for (i = 0; i < N; ++i) {
        const real room = OPENING * (command->upper[i] - command->lower[i]);
        if (work->side[i] == 0) {
            work->force[i] = smaller(command->upper[i] - room, work->force[i]);
            work->force[i] = larger(command->lower[i] + room, work->force[i]);
        } else {
            const real least = OPENING * largest;
            work->bound[i] = -work->bound[i] * (real)work->side[i] < least ? -least * (real)work->side[i] : work->bound[i];
        }
    }
    for (v = 0; v < V; ++v) {
        if (work->active[v] != 0) {
            work->lambda[v] = larger(work->lambda[v], OPENING / (real)(int)V);
        } else {
            work->slack[v] = larger(work->slack[v], OPENING * point->worst);
        }
    }
    NAME(normalise)(work->lambda);
}
