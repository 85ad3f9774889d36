/* SPDX-License-Identifier: MIT-0
 *
 * gnc_allocate_cold_start.c - the first steps where there is no last answer, or only one vertex.
 *
 * From the previous forces a few steps change all offending bounds at once, at fixed vertex weights. Alone they would
 * turn in circles with vertices that tie near zero net force; they bring most bounds to where they belong, and the path
 * (gnc_allocate_active_set.c) goes on with the vertices that are worst there and not with all of them.
 */
#include "gnc_allocate_internal.h"

enum {
    MAX_BLOCK_STEPS = 6, /* steps that change all offenders at once */
    FEW = 2,
    MANY = 5 /* vertices that the path begins with */
};

/* No previous answer: previous forces in the box, all free, equal weights of the vertices. */
void NAME(start_cold)(workspace_t *work, const data_t *data, const command_t *command)
{
    int i, v;
    const int distinct = GNC_ASSERT(data->distinct > 0) ? data->distinct : V; /* V: damaged data, no certificate */
    for (i = 0; i < N; ++i) {
        work->force[i] = larger(command->lower[i], smaller(command->upper[i], command->previous[i]));
        work->side[i] = 0;
        work->bound[i] = 0;
    }
    for (v = 0; v < V; ++v) {
        work->active[v] = (int8_t)(data->original[v] == v ? 1 : 0);
        work->lambda[v] = work->active[v] != 0 ? 1 / (real)distinct : 0;
        work->slack[v] = 0;
    }
    work->warm = 1;
}

/* Go to the goal and bind or free every actuator that offends there; return whether any did. */
static int change_all_bounds(workspace_t *work, const goal_t *goal, const command_t *command)
{
    int i, changed = 0;
    NAME(move)(work, goal, command, 1, 1);
    for (i = 0; i < N; ++i) {
        const int bound = work->side[i] != 0;
        const int above = !bound && goal->force[i] > command->upper[i];
        const int below = !bound && goal->force[i] < command->lower[i];
        const int pulled = bound && goal->bound[i] * (real)work->side[i] > 0 && command->dead[i] == 0;
        if (above || below || pulled) {
            NAME(change_set)(work, i, above);
            changed = 1;
        }
    }
    return changed;
}

/* One step that changes all offenders at once, at fixed vertex weights. Return whether there were any, 0 too where an
 * assertion failed. */
static int block_step(workspace_t *work, const data_t *data, const command_t *command, const point_t *point)
{
    goal_t goal;
    vertices_t vert;
    vert.count = 0;
    if (!NAME(refresh_factors)(work, data, 0) ||
        !NAME(newton_goal)(&goal, &vert, work, data, command, point)) {
        return 0;
    }
    return change_all_bounds(work, &goal, command);
}

/* Go on from a cold start with the worst vertices alone, at equal weights: the path adds one that is missing faster than
 * it finds out that all depend on each other. Where most of the error is that of the middle, beyond reach, few tie. */
static void choose_vertices(workspace_t *work, const data_t *data, const point_t *point)
{
    int a, v, w, count;
    real middle = 0;
    for (a = 0; a < R; ++a) {
        real sum = 0;
        for (v = 0; v < V; ++v) {
            sum += point->r[a][v];
        }
        middle += (real)0.5 * sum * sum / ((real)(int)V * (real)(int)V);
    }
    count = middle < (real)0.5 * point->worst ? MANY : FEW;
    for (v = 0; v < V; ++v) {
        int worse = 0; /* how many are */
        for (w = 0; w < v; ++w) {
            worse += data->original[w] == w && point->q[w] >= point->q[v] ? 1 : 0;
        }
        for (w = v + 1; w < V; ++w) {
            worse += data->original[w] == w && point->q[w] > point->q[v] ? 1 : 0;
        }
        work->active[v] = (int8_t)(data->original[v] == v && worse < count ? 1 : 0);
        work->lambda[v] = work->active[v] != 0 ? 1 / (real)count : 0;
        work->slack[v] = work->active[v] != 0 ? 0 : point->worst - point->q[v];
    }
}

/* The first steps, which change all offenders at once: from a cold start, and where one vertex is all there is. Return
 * how many, and whether they arrived. */
int NAME(block_steps)(workspace_t *work, const data_t *data, const command_t *command, point_t *point, int most,
                      int *arrived)
{
    int k, steps = 0, going = 1, changed = 1;
    real last_gap = -1;
    for (k = 0; k <= MAX_BLOCK_STEPS && going; ++k) {
        NAME(evaluate)(data, command, work->force, work->lambda, point);
        *arrived = NAME(is_there)(work, data, command, point, last_gap);
        going = *arrived == 0 && changed != 0 && k < most && k < MAX_BLOCK_STEPS && GNC_ASSERT(is_finite(point->gap));
        if (going != 0) {
            const real gap = point->gap;
            changed = block_step(work, data, command, point);
            last_gap = changed != 0 ? (real)-1 : gap;
            steps += 1;
        }
    }
    if (*arrived == 0 && data->distinct > MANY) {
        choose_vertices(work, data, point);
    }
    return steps;
}
