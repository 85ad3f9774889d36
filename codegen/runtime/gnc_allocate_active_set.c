/* SPDX-License-Identifier: MIT-0
 *
 * gnc_allocate_active_set.c - the fast path: follow the solution from the last sample to this one.
 *
 * The last answer (F, lambda, bound multipliers mu, slacks) does not solve today's problem, but it
 * does solve one that differs from today's only by right-hand sides: the residuals of the optimality
 * conditions. Fade these out, from all of them to none, and the solution moves continuously. As long
 * as the sets of bounded actuators and of active vertices stay the same, it moves along the Newton
 * step for these sets (gnc_allocate_direction.c). That step either reaches today's answer, or meets an
 * obstacle on the way: a free actuator meets its bound, a bound multiplier or a vertex weight falls to
 * zero, or another vertex becomes as bad as the worst. Go as far as that, move the obstacle from one
 * set to the other, and continue with what is left of the residuals.
 *
 * Each piece starts from an optimal point of some problem, so nothing is guessed, and a strictly convex
 * problem has finitely many pieces. (The usual active-set Newton changes all offenders at once; with
 * vertices that tie near zero net force it cycles.) The residuals are evaluated anew at each stop,
 * which makes it Newton's method for the curvature of q_v as well.
 *
 * The path pays while it is short. Work that starts from the last answer has a budget (WARM_WORK): after a jump of the
 * command most pieces of a long path would lie ahead, and starting anew costs less than walking it.
 *
 * Two shortcuts save pieces: the prediction (gnc_allocate_prediction.c), and, without a previous answer and when only
 * one vertex exists, a few steps that do change all offenders at once (gnc_allocate_cold_start.c).
 */
#include "gnc_allocate_internal.h"

enum {
    MAX_PIECES = 10 + N, /* pieces and exchanges in all */
    MAX_STUCK = 6        /* pieces of no length in a row: many obstacles at one point */
};

/* Where on the path we are. */
typedef struct {
    int newcomer;  /* what joined a set at the last stop: an actuator, a vertex (from N on) or NOTHING */
    int stuck;     /* pieces of no length so far in a row */
    int exchanges; /* of dependent vertices in a row, without a move */
    int dropped;   /* what the last of them dropped: an actuator came free, or a vertex (from N on) left */
    real last_gap; /* gap before the last step if that was a full one, else -1 */
} path_t;

static void begin(path_t *path)
{
    path->newcomer = NOTHING;
    path->stuck = 0;
    path->exchanges = 0;
    path->dropped = NOTHING;
    path->last_gap = -1;
}

/* The certificate asks for weights on the simplex. No step leaves it, but damaged memory may. */
static int on_simplex(const real *lambda)
{
    int v;
    real sum = 0, least = 0;
    for (v = 0; v < V; ++v) {
        sum += lambda[v];
        least = smaller(least, lambda[v]);
    }
    return GNC_ASSERT(least >= 0 && size_of(sum - 1) <= OFF_SIMPLEX);
}

/* Is the point the answer, by its certificate or up to rounding? The gap before a full step that led here, else -1. */
int NAME(is_there)(const workspace_t *work, const data_t *data, const command_t *command, const point_t *point,
                   real last_gap)
{
    int i, inside = 1, is_close = is_optimal(data, point);
    for (i = 0; i < N; ++i) {
        inside = inside && work->force[i] >= command->lower[i] && work->force[i] <= command->upper[i];
    }
    if (inside == 0) {
        return 0;
    }
    if (!is_close && last_gap > 0 && point->gap > (real)0.9 * last_gap) { /* is it rounding? */
        is_close = point->gap <= NAME(floor_of)(data, command);
    }
    return is_close && on_simplex(work->lambda);
}

/* One piece of the path: to the goal, or to the first obstacle, which changes sets. Where the active vertices depend on
 * each other, exchange one instead, and let the next round look again: each exchange takes a vertex or a bound away.
 * Return the work, or 0 where there is no way on. */
static int piece(path_t *path, workspace_t *work, const data_t *data, const command_t *command, point_t *point)
{
    goal_t goal;
    vertices_t vert;
    real clear;
    int obstacle, dependent;
    const int slow = path->exchanges == 0 && path->last_gap > 0 && point->gap > (real)0.01 * path->last_gap;
    if (path->dropped < N && !NAME(refresh_factors)(work, data, slow)) {
        return 0;
    }
    dependent = NAME(factor_vertices)(&vert, work, data, point);
    path->exchanges = dependent != 0 ? path->exchanges + 1 : 0;
    if (path->exchanges != 0) {
        if (dependent > 0 && path->exchanges <= V) {
            path->dropped = NAME(exchange)(work, &vert, data, command, point, dependent, path->newcomer);
        } else {
            path->dropped = NOTHING;
        }
        return path->dropped != NOTHING ? 1 : 0;
    }
    path->dropped = NOTHING;
    if (!NAME(newton_goal)(&goal, &vert, work, data, command, point)) {
        return 0;
    }
    obstacle = NAME(first_obstacle)(&clear, &goal, work, data, command, point);
    NAME(move)(work, &goal, command, clear, obstacle == NOTHING);
    path->last_gap = obstacle == NOTHING ? point->gap : -1;
    path->stuck = clear > (real)1e-6 ? 0 : path->stuck + 1;
    path->newcomer = NOTHING;
    if (obstacle != NOTHING) {
        const int joins = obstacle < N ? work->side[obstacle] == 0 : work->active[obstacle - N] == 0;
        path->newcomer = joins ? obstacle : NOTHING;
        NAME(change_set)(work, obstacle, obstacle < N && goal.force[obstacle] > command->upper[obstacle]);
    }
    if (path->stuck == MAX_STUCK) {
        NAME(open_up)(work, command, point);
        path->stuck = 0;
    }
    return obstacle == NOTHING ? 1 : clear < (real)0.5 ? WARM_WORK : 2;
}

/* Follow the path for so many rounds at most; return how many it took. */
static int follow(workspace_t *work, const data_t *data, const command_t *command, point_t *point, int budget,
                  int *arrived)
{
    int k, spent = 1, left = budget, rounds = 0;
    path_t path;
    begin(&path);
    for (k = 0; k <= MAX_PIECES && spent > 0; ++k) {
        if (path.exchanges == 0) {
            NAME(evaluate)(data, command, work->force, work->lambda, point);
            *arrived = NAME(is_there)(work, data, command, point, path.last_gap);
        }
        spent = 0;
        if (*arrived == 0 && left > 0 && k < MAX_PIECES && k < budget && /* a round costs one at least */
            GNC_ASSERT(is_finite(point->gap))) {
            spent = piece(&path, work, data, command, point);
            left -= spent;
            rounds += 1;
        }
    }
    return rounds;
}

/* Dead actuators are where they are. */
static void place_dead(workspace_t *work, const command_t *command)
{
    int i;
    for (i = 0; i < N; ++i) {
        if (command->dead[i] != 0) {
            work->side[i] = -1;
            work->force[i] = command->lower[i];
        }
    }
}

int NAME(from_last)(workspace_t *work, const data_t *data, const command_t *command, point_t *point,
                    int32_t *iterations)
{
    int arrived = 0;
    place_dead(work, command);
    if (data->distinct == 1) { /* one vertex: there is no path to follow unless bounds turn in circles */
        *iterations += NAME(block_steps)(work, data, command, point, WARM_WORK, &arrived);
    } else {
        *iterations += follow(work, data, command, point, WARM_WORK, &arrived);
    }
    return arrived;
}

int NAME(from_cold)(workspace_t *work, const data_t *data, const command_t *command, point_t *point,
                    int32_t *iterations)
{
    int steps, arrived = 0;
    NAME(start_cold)(work, data, command);
    place_dead(work, command);
    steps = NAME(block_steps)(work, data, command, point, COLD_WORK, &arrived);
    if (!arrived) {
        steps += follow(work, data, command, point, COLD_WORK, &arrived);
    }
    *iterations += steps;
    return arrived;
}
