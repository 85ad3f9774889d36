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
 * Three shortcuts save pieces. On a steady slew the step from the last sample is repeated in proportion
 * to the command first, so that the Newton step only corrects. Without a previous answer, and when only
 * one vertex exists, a few steps that do change all offenders at once come first, at fixed lambda; then
 * the path begins with the vertices that are worst there and not with all of them.
 */
#include "gnc_allocate_internal.h"

enum {
    MAX_PIECES = 16 + N, /* pieces and exchanges in all */
    MAX_BLOCK_STEPS = 6, /* steps that change all offenders at once */
    FEW = 2,
    MANY = 5,        /* vertices that the path begins with after a cold start */
    MAX_STUCK = 6    /* pieces of no length in a row: many obstacles at one point */
};
#define OPENING (real)0.01 /* room that open_up gives, of the box, the largest gradient, the worst q_v */
#define SMALL (real)0.01   /* of the tolerance: a multiplier or slack this wrong does not show in the gap */
#ifdef GNC_ALLOC_REAL_FLOAT
#define SLIP 1e-4F /* of the box: a force this far outside is clipped, not bound; its gap is the square */
#else
#define SLIP 1e-8
#endif

/* Where on the path we are. */
typedef struct {
    int newcomer;    /* what joined a set at the last stop: an actuator, a vertex (from N on) or NOTHING */
    int smooth;      /* 1: no set has changed */
    int stuck;       /* pieces of no length so far in a row */
    int budget;      /* what is left of it */
    int exchanges;   /* of dependent vertices in a row, without a move */
    int dropped;     /* what the last of them dropped: an actuator came free, or a vertex (from N on) left */
    real last_gap;   /* gap before the last step if that was a full one, else -1 */
} path_t;

/* ---- where to start --------------------------------------------------------------------------- */

/* No previous answer: previous forces in the box, all free, equal weights of the vertices. */
static void start_cold(workspace_t *work, const data_t *data, const command_t *command)
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

/* Keep the weights on the simplex, which the certificate asks for, against rounding. */
static void normalise(real *lambda)
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

/* If the last change of the command went smoothly, repeat the change of the answer that it caused, as
 * far as today's change of the command points the same way. */
static void predict(workspace_t *work, const command_t *command)
{
    int a;
    real along = 0, length = 0;
    for (a = 0; a < R; ++a) {
        const real change = command->b[a] - work->command[a];
        along += change * work->command_change[a];
        length += work->command_change[a] * work->command_change[a];
        work->command_change[a] = change;
        work->command[a] = command->b[a];
    }
    if (work->smooth != 0 && size_of(along) < 2 * length) {
        const real ratio = along / length;
        int i, v;
        for (i = 0; i < N; ++i) {
            work->force[i] += ratio * work->force_change[i];
        }
        for (v = 0; v < V; ++v) {
            work->lambda[v] = larger(0, work->lambda[v] + ratio * work->lambda_change[v]);
        }
        normalise(work->lambda);
    }
}

/* Give every inequality some room: free actuators off their bounds, multipliers and slacks off zero. The
 * path may start from any such point, and from one where much is zero at once it may turn in circles. */
static void open_up(workspace_t *work, const command_t *command, const point_t *point)
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
    normalise(work->lambda);
}

/* ---- changing sets ---------------------------------------------------------------------------- */

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
static int first_obstacle(real *clear, const goal_t *goal, const workspace_t *work, const data_t *data,
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
static void move(workspace_t *work, const goal_t *goal, const command_t *command, real clear, int full)
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
    normalise(work->lambda);
}

/* Go to the goal and bind or free every actuator that offends there; return whether any did. */
static int change_all_bounds(workspace_t *work, const goal_t *goal, const command_t *command)
{
    int i, changed = 0;
    move(work, goal, command, 1, 1);
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

/* ---- the path --------------------------------------------------------------------------------- */

/* Take the state over from the last sample, or start cold, and look ahead. */
static void begin(path_t *path, real *force, real *lambda, workspace_t *work, const data_t *data,
                  const command_t *command, int budget)
{
    int i;
    path->newcomer = NOTHING;
    path->smooth = work->warm;
    path->stuck = 0;
    path->budget = budget;
    path->exchanges = 0;
    path->dropped = NOTHING;
    path->last_gap = -1;
    if (work->warm == 0) {
        start_cold(work, data, command);
    }
    (void)memcpy(force, work->force, sizeof work->force);
    (void)memcpy(lambda, work->lambda, sizeof work->lambda);
    predict(work, command);
    for (i = 0; i < N; ++i) {
        if (command->dead[i] != 0) {
            work->side[i] = -1;
            work->force[i] = command->lower[i];
        }
    }
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

/* Is the point the answer, by its certificate or up to rounding? */
static int is_there(const path_t *path, const workspace_t *work, const data_t *data, const command_t *command,
                    const point_t *point)
{
    int i, inside = 1, is_close = is_optimal(data, point);
    for (i = 0; i < N; ++i) {
        inside = inside && work->force[i] >= command->lower[i] && work->force[i] <= command->upper[i];
    }
    if (inside == 0) {
        return 0;
    }
    if (!is_close && path->last_gap > 0 && point->gap > (real)0.9 * path->last_gap) { /* is it rounding? */
        is_close = point->gap <= command->floor;
    }
    return is_close && on_simplex(work->lambda);
}

/* One step that changes all offenders at once, at fixed vertex weights. Return whether there were any, 0 too where an
 * assertion failed. */
static int block_step(path_t *path, workspace_t *work, const data_t *data, const command_t *command,
                      const point_t *point)
{
    int changed;
    goal_t goal;
    vertices_t vert;
    vert.count = 0;
    if (!NAME(refresh_factors)(work, data, 0) ||
        !NAME(newton_goal)(&goal, &vert, work, data, command, point)) {
        return 0;
    }
    path->budget -= 1;
    changed = change_all_bounds(work, &goal, command);
    path->smooth = changed != 0 ? 0 : path->smooth;
    return changed;
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
 * whether they arrived. */
static int block_steps(path_t *path, workspace_t *work, const data_t *data, const command_t *command, point_t *point,
                       int most, int32_t *iterations)
{
    int k, going = 1, arrived = 0, changed = 1;
    for (k = 0; k <= MAX_BLOCK_STEPS && going; ++k) {
        NAME(evaluate)(data, command, work->force, work->lambda, point);
        arrived = is_there(path, work, data, command, point);
        going = !arrived && changed != 0 && k < most && k < MAX_BLOCK_STEPS && GNC_ASSERT(is_finite(point->gap));
        if (going != 0) {
            changed = block_step(path, work, data, command, point);
            *iterations += 1;
        }
    }
    if (!arrived && data->distinct > MANY) {
        choose_vertices(work, data, point);
    }
    return arrived;
}

/* One piece of the path: to the goal, or to the first obstacle, which changes sets. Where the active vertices depend on
 * each other, exchange one instead, and let the next round look again: each exchange takes a vertex or a bound away. */
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
        path->budget -= 1;
        if (dependent > 0 && path->exchanges <= V) {
            path->dropped = NAME(exchange)(work, &vert, data, command, point, dependent, path->newcomer);
        } else {
            path->dropped = NOTHING;
        }
        return path->dropped != NOTHING;
    }
    path->dropped = NOTHING;
    if (!NAME(newton_goal)(&goal, &vert, work, data, command, point)) {
        return 0;
    }
    obstacle = first_obstacle(&clear, &goal, work, data, command, point);
    move(work, &goal, command, clear, obstacle == NOTHING);
    path->last_gap = obstacle == NOTHING ? point->gap : -1;
    path->stuck = clear > (real)1e-6 ? 0 : path->stuck + 1;
    path->newcomer = NOTHING;
    path->budget -= obstacle == NOTHING ? 1 : clear < (real)0.5 ? WARM_WORK : 2;
    if (obstacle != NOTHING) {
        const int joins = obstacle < N ? work->side[obstacle] == 0 : work->active[obstacle - N] == 0;
        path->smooth = 0;
        path->newcomer = joins ? obstacle : NOTHING;
        NAME(change_set)(work, obstacle, obstacle < N && goal.force[obstacle] > command->upper[obstacle]);
    }
    if (path->stuck == MAX_STUCK) {
        open_up(work, command, point);
        path->stuck = 0;
    }
    return 1;
}

int NAME(active_set)(workspace_t *work, const data_t *data, const command_t *command, point_t *point,
                     int budget, int32_t *iterations)
{
    const int was_warm = work->warm;
    int i, v, k, going, arrived = 0;
    real force[N], lambda[V]; /* where the path began */
    path_t path;
    *iterations = 0;
    begin(&path, force, lambda, work, data, command, budget);
    if (was_warm == 0 || data->distinct == 1) {
        arrived = block_steps(&path, work, data, command, point, budget, iterations);
    }
    going = !arrived;
    for (k = 0; k <= MAX_PIECES && going; ++k) {
        if (path.exchanges == 0) {
            NAME(evaluate)(data, command, work->force, work->lambda, point);
            arrived = is_there(&path, work, data, command, point);
        }
        going = !arrived && path.budget > 0 && GNC_ASSERT(is_finite(point->gap));
        if (going && k < MAX_PIECES && k < budget) { /* a round costs one at least */
            going = piece(&path, work, data, command, point);
            *iterations += 1;
        } else {
            going = 0; /* the end, by one count or the other */
        }
    }
    work->smooth = arrived ? path.smooth : 0;
    for (i = 0; i < N && arrived; ++i) { /* remember what this sample's change of the command did */
        work->force_change[i] = work->force[i] - force[i];
    }
    for (v = 0; v < V && arrived; ++v) {
        work->lambda_change[v] = work->lambda[v] - lambda[v];
    }
    return arrived;
}
