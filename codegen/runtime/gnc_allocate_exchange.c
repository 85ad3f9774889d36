/* SPDX-License-Identifier: MIT-0
 *
 * gnc_allocate_exchange.c - the sets of bounded actuators and active vertices, and which vertices may be active.
 *
 * More vertices can tie than the free actuators can tell apart. Then some mixture n of vertex weights,
 * sum n = 0, changes nothing for the free actuators, the Newton system is singular, and weight is shifted
 * along n until one vertex can leave.
 */
#include "gnc_allocate_internal.h"

/* Move an actuator or a vertex from one set to the other. */
void NAME(change_set)(workspace_t *work, int which, int upwards)
{
    if (!GNC_ASSERT(is_within(which, 0, N + V - 1))) {
        return;
    }
    if (which < N) {
        int8_t side = -1;
        if (work->side[which] != 0) {
            side = 0;
        } else if (upwards != 0) {
            side = 1;
        } else {
            side = -1;
        }
        work->side[which] = side;
        work->bound[which] = 0;
    } else {
        const int v = which - N;
        if (work->active[v] != 0) {
            work->lambda[v] = 0; /* one that joins keeps the trace of weight that it may have */
        }
        work->active[v] = (int8_t)(work->active[v] != 0 ? 0 : 1);
        work->slack[v] = 0;
    }
}

/* The mixture n that makes the vertex at place `last` of the list of those before it, and the pull
 * zeta = sum n z that it changes. */
static void find_mixture(real *n, real *zeta, const vertices_t *vert, int last)
{
    int a, b, k;
    if (!GNC_ASSERT(is_within(last, 1, A - 1))) {
        return;
    }
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
}

/* How far the shift may go one way until a weight or a bound multiplier is used up, and which one that is. */
static int first_used_up(real *reach, real way, const real *n, const real *rate, const workspace_t *work,
                         const vertices_t *vert, int last, int newcomer)
{
    int k, drop = NOTHING;
    *reach = 0;
    if (!GNC_ASSERT(is_within(last, 1, A - 1))) {
        return NOTHING;
    }
    for (k = 0; k <= last + N; ++k) {
        const int which = k < N ? k : N + vert->list[k - N];
        const real stock = k < N ? larger(0, -work->bound[k] * (real)work->side[k]) : work->lambda[which - N];
        const real use = way * (k < N ? rate[k] * (real)work->side[k] : -n[k - N]);
        if (use > 0 && which != newcomer && (drop == NOTHING || stock < *reach * use)) {
            *reach = stock / use;
            drop = which;
        }
    }
    return drop;
}

/* Does the newcomer to the sets want the shift to go backwards? Without one, the shorter way. */
static int goes_backwards(const real *n, const real *rate, const workspace_t *work, const vertices_t *vert,
                          int last, int newcomer, int shorter)
{
    int a, backwards = shorter;
    if (!GNC_ASSERT(is_within(last, 1, A - 1))) {
        return shorter;
    }
    if (newcomer >= 0 && newcomer < N) {
        backwards = rate[newcomer] * (real)work->side[newcomer] > 0;
    }
    for (a = 0; a <= last; ++a) {
        backwards = N + vert->list[a] == newcomer ? n[a] < 0 : backwards;
    }
    return backwards;
}

/* The vertex at place `last` of the list depends on those before it: shift weight along the mixture, the way that the
 * newcomer wants, and drop what is used up, a vertex or a bound. Return that, NOTHING if rounding hides it. */
int NAME(exchange)(workspace_t *work, const vertices_t *vert, const data_t *data,
                   const command_t *command, point_t *point, int last, int newcomer)
{
    int a, i, k, back, drop, drop_back;
    real n[A], rate[N], zeta[K] = {0}, reach, reach_back, step;
    if (!GNC_ASSERT(is_within(last, 1, A - 1))) {
        return NOTHING;
    }
    find_mixture(n, zeta, vert, last);
    for (i = 0; i < N; ++i) {
        rate[i] = 0;
        for (k = 0; k < K && work->side[i] != 0 && command->dead[i] == 0; ++k) {
            rate[i] += data->St[i][k] * zeta[k];
        }
    }
    drop = first_used_up(&reach, 1, n, rate, work, vert, last, newcomer);
    drop_back = first_used_up(&reach_back, -1, n, rate, work, vert, last, newcomer);
    back = goes_backwards(n, rate, work, vert, last, newcomer, reach_back < reach);
    drop = back ? drop_back : drop;
    if (drop == NOTHING) {
        return NOTHING;
    }
    step = back ? -reach_back : reach;
    for (a = 0; a <= last; ++a) {
        work->lambda[vert->list[a]] = larger(0, work->lambda[vert->list[a]] + step * n[a]);
    }
    for (i = 0; i < N; ++i) {
        work->bound[i] += step * rate[i];
        point->g[i] += step * rate[i];
    }
    NAME(change_set)(work, drop, 0);
    return drop;
}
