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
 * Two shortcuts save pieces. On a steady slew the step from the last sample is repeated in proportion
 * to the command first, so that the Newton step only corrects. Without a previous answer, and when only
 * one vertex exists, a few steps that do change all offenders at once come first, at fixed lambda.
 */
#include "gnc_allocate_internal.h"


enum {
    MAX_ITERATIONS = 28 + N,
    BLOCK_STEPS = 6, /* steps that change all offenders at once */
    MAX_STUCK = 6,   /* pieces of no length in a row: many obstacles at one point */
    NOTHING = -1     /* no obstacle; otherwise actuator i is i and vertex v is N + v */
};
#define OPENING (real)0.01 /* room that open_up gives, of the box, the largest gradient, the worst q_v */
#define SMALL (real)0.01   /* of the tolerance: a multiplier or slack this wrong does not show in the gap */
#ifdef GNC_ALLOC_REAL_FLOAT
#define SLIP 1e-4F /* of the box: a force this far outside is clipped, not bound; its gap is the square */
#else
#define SLIP 1e-8
#endif

/* ---- where to start --------------------------------------------------------------------------- */

/* No previous answer: previous forces in the box, all free, equal weights of the vertices. */
static void start_cold(workspace_t *work, const data_t *data, const command_t *command)
{
    int i, v;
    for (i = 0; i < N; ++i) {
        work->force[i] = larger(command->lower[i], smaller(command->upper[i], command->previous[i]));
        work->side[i] = 0;
        work->bound[i] = 0;
    }
    for (v = 0; v < V; ++v) {
        work->active[v] = (int8_t)(data->original[v] == v);
        work->lambda[v] = work->active[v] ? 1 / (real)data->distinct : 0;
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
    sum = 1 / sum;
    for (v = 0; v < V; ++v) {
        lambda[v] *= sum;
    }
}

/* If the last change of the command went smoothly, repeat the change of the answer that it caused, as
 * far as today's change of the command points the same way. */
static void predict(workspace_t *work, const command_t *command)
{
    int i, v, a;
    real along = 0, length = 0, ratio;
    for (a = 0; a < R; ++a) {
        const real change = command->b[a] - work->command[a];
        along += change * work->command_change[a];
        length += work->command_change[a] * work->command_change[a];
        work->command_change[a] = change;
        work->command[a] = command->b[a];
    }
    if (work->smooth && size_of(along) < 2 * length) {
        ratio = along / length;
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
        if (!work->side[i]) {
            work->force[i] = smaller(command->upper[i] - room, work->force[i]);
            work->force[i] = larger(command->lower[i] + room, work->force[i]);
        } else if (-work->bound[i] * (real)work->side[i] < OPENING * largest) {
            work->bound[i] = -OPENING * largest * (real)work->side[i];
        }
    }
    for (v = 0; v < V; ++v) {
        if (work->active[v]) {
            work->lambda[v] = larger(work->lambda[v], OPENING / (real)(int)V);
        } else {
            work->slack[v] = larger(work->slack[v], OPENING * point->worst);
        }
    }
    normalise(work->lambda);
}

/* ---- changing sets ---------------------------------------------------------------------------- */

/* The first obstacle on the way to the goal, and the fraction of the way that is clear. */
static int first_obstacle(real *clear, const goal_t *goal, const workspace_t *work, const data_t *data,
                          const command_t *command, const point_t *point)
{
    int i, v, obstacle = NOTHING;
    const real small = SMALL * data->tolerance * point->phi; /* what the gap does not notice */
    *clear = 1;
    for (i = 0; i < N + V; ++i) {
        const real width = i < N ? command->upper[i] - command->lower[i] : 0;
        real from = 0, to = 0; /* an obstacle where this crosses zero from above */
        if (i >= N) {
            v = i - N;
            from = work->active[v] ? work->lambda[v] : work->slack[v];
            to = work->active[v] ? goal->lambda[v] + 16 * EPS : goal->slack[v] + small;
            to = data->original[v] == v ? to : 0;
        } else if (work->side[i]) {
            from = -work->bound[i] * (real)work->side[i];
            to = -goal->bound[i] * (real)work->side[i];
            to = to * width < -small && !command->dead[i] ? to : 0;
        } else if (goal->force[i] < command->lower[i] - SLIP * width) {
            from = work->force[i] - command->lower[i];
            to = goal->force[i] - command->lower[i];
        } else if (goal->force[i] > command->upper[i] + SLIP * width) {
            from = command->upper[i] - work->force[i];
            to = command->upper[i] - goal->force[i];
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
    for (i = 0; i < N; ++i) {
        work->force[i] += clear * (goal->force[i] - work->force[i]);
        if (full) {
            work->force[i] = larger(command->lower[i], smaller(command->upper[i], goal->force[i]));
        }
        work->bound[i] += clear * (goal->bound[i] - work->bound[i]);
    }
    for (v = 0; v < V; ++v) {
        if (work->active[v]) {
            work->lambda[v] = larger(0, work->lambda[v] + clear * (goal->lambda[v] - work->lambda[v]));
        } else {
            work->slack[v] = larger(0, work->slack[v] + clear * (goal->slack[v] - work->slack[v]));
        }
    }
    normalise(work->lambda);
}

/* Move an actuator or a vertex from one set to the other. */
static void change_set(workspace_t *work, int which, int upwards)
{
    if (which < N) {
        work->side[which] = (int8_t)(work->side[which] ? 0 : upwards ? 1 : -1);
        work->bound[which] = 0;
    } else {
        work->active[which - N] = (int8_t)!work->active[which - N];
        work->lambda[which - N] = 0;
        work->slack[which - N] = 0;
    }
}

/* Go to the goal and bind or free every actuator that offends there; return whether any did. */
static int change_all_bounds(workspace_t *work, const goal_t *goal, const command_t *command)
{
    int i, changed = 0;
    move(work, goal, command, 1, 1);
    for (i = 0; i < N; ++i) {
        if (!work->side[i]) {
            const int above = goal->force[i] > command->upper[i];
            const int below = goal->force[i] < command->lower[i];
            work->side[i] = (int8_t)(above - below);
            changed |= above | below;
        } else if (goal->bound[i] * (real)work->side[i] > 0 && !command->dead[i]) {
            change_set(work, i, 0);
            changed = 1;
        }
    }
    return changed;
}

/* The vertex at place `last` of the list depends on those before it: some mixture n of vertex weights,
 * sum n = 0, changes nothing for the free actuators. Shift weight along n, the way that the newcomer to
 * the sets wants, until another weight or a bound multiplier is used up, and drop that one. Return what
 * was dropped, NOTHING if rounding hides it. */
static int exchange(workspace_t *work, const vertices_t *vert, const data_t *data,
                    const command_t *command, point_t *point, int last, int newcomer)
{
    int a, b, i, k, way, drop[2] = {NOTHING, NOTHING};
    real n[A], rate[N], zeta[K] = {0}, reach[2] = {0, 0}, step;
    n[0] = 0;
    n[last] = 1;
    for (b = last - 1; b >= 1; --b) {
        n[b] = -vert->G[last][b];
        for (a = b + 1; a < last; ++a) {
            n[b] -= vert->G[a][b] * n[a];
        }
    }
    for (a = 1; a <= last; ++a) {
        n[0] -= n[a];
    }
    for (a = 0; a <= last; ++a) {
        for (k = 0; k < K; ++k) {
            zeta[k] += n[a] * vert->z[a][k];
        }
    }
    for (i = 0; i < N; ++i) {
        rate[i] = 0;
        for (k = 0; k < K && work->side[i] && !command->dead[i]; ++k) {
            rate[i] += data->St[i][k] * zeta[k];
        }
    }
    for (way = 0; way < 2; ++way) {
        const real sign = way ? -1 : 1;
        for (k = 0; k <= last + N; ++k) {
            const int which = k < N ? k : N + vert->list[k - N];
            const real stock = k < N ? larger(0, -work->bound[k] * (real)work->side[k])
                                     : work->lambda[which - N];
            const real use = sign * (k < N ? rate[k] * (real)work->side[k] : -n[k - N]);
            if (use > 0 && which != newcomer && (drop[way] < 0 || stock < reach[way] * use)) {
                reach[way] = stock / use;
                drop[way] = which;
            }
        }
    }
    way = reach[1] < reach[0];
    if (newcomer >= 0 && newcomer < N) {
        way = rate[newcomer] * (real)work->side[newcomer] > 0;
    }
    for (a = 0; a <= last; ++a) {
        way = N + vert->list[a] == newcomer ? n[a] < 0 : way;
    }
    if (drop[way] < 0) {
        return NOTHING;
    }
    step = way ? -reach[way] : reach[way];
    for (a = 0; a <= last; ++a) {
        work->lambda[vert->list[a]] = larger(0, work->lambda[vert->list[a]] + step * n[a]);
    }
    for (i = 0; i < N; ++i) {
        work->bound[i] += step * rate[i];
        point->g[i] += step * rate[i];
    }
    change_set(work, drop[way], 0);
    return drop[way];
}

/* Factors for the present sets, after exchanging vertices until the active ones are independent. */
static int independent_vertices(vertices_t *vert, workspace_t *work, const data_t *data,
                                const command_t *command, point_t *point, int newcomer, int always)
{
    int k;
    NAME(refresh_factors)(work, data, always);
    for (k = 0; k <= V; ++k) {
        const int dependent = NAME(factor_vertices)(vert, work, data, point);
        int dropped;
        if (!dependent) {
            return 1;
        }
        dropped = exchange(work, vert, data, command, point, dependent, newcomer);
        if (dropped < 0) {
            return 0;
        }
        if (dropped < N) {
            NAME(refresh_factors)(work, data, 0); /* an actuator came free */
        }
    }
    return 0;
}

/* ---- the path --------------------------------------------------------------------------------- */

/* Remember what this sample's change of the command did. */
static int arrive(workspace_t *work, const real *force, const real *lambda, int smooth)
{
    int i, v;
    for (i = 0; i < N; ++i) {
        work->force_change[i] = work->force[i] - force[i];
    }
    for (v = 0; v < V; ++v) {
        work->lambda_change[v] = work->lambda[v] - lambda[v];
    }
    work->smooth = smooth;
    return 1;
}

int NAME(active_set)(workspace_t *work, const data_t *data, command_t *command, point_t *point,
                     int32_t *iterations)
{
    int i, k, newcomer = NOTHING, smooth = work->warm, stuck = 0;
    int block_steps = work->warm && data->distinct > 1 ? 0 : BLOCK_STEPS;
    real last_gap = -1; /* gap before the last step if that was a full one */
    real force[N], lambda[V];
    vertices_t vert;
    goal_t goal;
    if (!work->warm) {
        start_cold(work, data, command);
    }
    memcpy(force, work->force, sizeof force);
    memcpy(lambda, work->lambda, sizeof lambda);
    predict(work, command);
    for (i = 0; i < N; ++i) {
        if (command->dead[i]) {
            work->side[i] = -1;
            work->force[i] = command->lower[i];
        }
    }
    for (k = 0; k <= MAX_ITERATIONS; ++k) {
        int inside = 1, obstacle;
        real clear;
        NAME(evaluate)(data, command, work->force, work->lambda, point);
        for (i = 0; i < N; ++i) {
            inside &= work->force[i] >= command->lower[i] && work->force[i] <= command->upper[i];
        }
        *iterations = k;
        if (inside && is_optimal(data, point)) {
            return arrive(work, force, lambda, smooth);
        }
        if (inside && last_gap > 0 && point->gap > (real)0.9 * last_gap) { /* is it rounding? */
            command->floor = NAME(floor_of)(data, command);
            if (point->gap <= command->floor) {
                return arrive(work, force, lambda, smooth);
            }
        }
        if (k == MAX_ITERATIONS || !is_finite(point->gap)) {
            break;
        }
        if (k < block_steps) {
            NAME(refresh_factors)(work, data, 0);
            vert.count = 0;
            NAME(newton_goal)(&goal, &vert, work, data, command, point);
            if (change_all_bounds(work, &goal, command)) {
                smooth = 0;
            } else {
                block_steps = 0;
            }
            continue;
        }
        if (!independent_vertices(&vert, work, data, command, point, newcomer,
                                  last_gap > 0 && point->gap > (real)0.01 * last_gap)) {
            break;
        }
        NAME(newton_goal)(&goal, &vert, work, data, command, point);
        obstacle = first_obstacle(&clear, &goal, work, data, command, point);
        move(work, &goal, command, clear, obstacle < 0);
        last_gap = obstacle < 0 ? point->gap : -1;
        stuck = clear > (real)1e-6 ? 0 : stuck + 1;
        newcomer = NOTHING;
        if (obstacle >= 0) {
            smooth = 0;
            if (obstacle < N ? !work->side[obstacle] : !work->active[obstacle - N]) {
                newcomer = obstacle;
            }
            change_set(work, obstacle, obstacle < N && goal.force[obstacle] > command->upper[obstacle]);
        }
        if (stuck == MAX_STUCK) {
            open_up(work, command, point);
            stuck = 0;
        }
    }
    work->smooth = 0;
    return 0;
}
