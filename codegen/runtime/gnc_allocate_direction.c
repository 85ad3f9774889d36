/* SPDX-License-Identifier: MIT-0
 *
 * gnc_allocate_direction.c - the Newton step for given sets of bounded actuators and active vertices.
 *
 *     free i:     q_i dF_i + s_i'(W dy + sum dlambda_v z_v) = -g_i           gradient to zero
 *     bounded i:  dF_i = bound - F_i                                         follow the box
 *     active v:   z_v'dy - dt = t - q_v,      sum dlambda_v = 0              ties stay ties
 *
 * The linear algebra is that of the interior point with 1/d = 1/q on free and 0 on bounded actuators:
 *
 *     S_free diag(1/q) S_free' = L L',    I + L' W L = C C',    T = C^-1 L',    J = T Z
 *     dy = y_b - T' eps,    eps = T W y_b + J dlambda - C^-1 L^-1 y_f
 *
 * with y_b what bounded and y_f what free actuators change of y by their own steps, to the bound and to gradient zero
 * without what y feeds back. These are far larger than dy, so dy is no difference of the two: it would lose the digits
 * that single precision needs.
 *
 * L depends on the free set alone, T also on lambda, but slowly: both are kept from sample to sample,
 * and most steps need no factorisation larger than that of the vertex weights.
 */
#include "gnc_allocate_internal.h"

#define LAMBDA_DRIFT (real)0.1 /* change of the vertex weights that asks for a new T */
#ifdef GNC_ALLOC_REAL_FLOAT
#define DEPENDENT 1e-5F  /* pivot of a vertex that adds no new direction */
#else
#define DEPENDENT 1e-11
#endif

/* L L' = S_free diag(1/q) S_free' */
static int factor_free_set(workspace_t *work, const data_t *data)
{
    int i;
    real weight[N];
    for (i = 0; i < N; ++i) {
        weight[i] = work->side[i] == 0 ? data->inv_curvature[i] : 0;
    }
    return NAME(factor_forces)(work->L, work->inv_L, data, weight, 4 * EPS);
}

/* T = C^-1 L' */
static void solve_for_T(workspace_t *work)
{
    int i, k, l;
    for (k = 0; k < K; ++k) {
        real row[K];
        UNROLLED
        for (l = 0; l < K; ++l) {
            row[l] = work->L[l][k];
        }
        for (i = 0; i < k; ++i) {
            UNROLLED
            for (l = 0; l < K; ++l) {
                row[l] -= work->C[k][i] * work->T[i][l];
            }
        }
        UNROLLED
        for (l = 0; l < K; ++l) {
            work->T[k][l] = row[l] * work->inv_C[k];
            work->Tt[l][k] = work->T[k][l];
        }
    }
}

/* Bring L, W and T up to date with the free set and the vertex weights. */
int NAME(refresh_factors)(workspace_t *work, const data_t *data, int always)
{
    int i, v, known, same_set, same_weights, sound = 1;
    NAME(set) free_set = 0, bit = 1;
    real drift = 0;
    for (i = 0; i < N; ++i) {
        free_set |= work->side[i] != 0 ? (NAME(set))0 : bit;
        bit <<= 1;
    }
    for (v = 0; v < V; ++v) {
        drift += size_of(work->lambda[v] - work->lambda_W[v]);
    }
    if (!GNC_ASSERT(is_finite(drift))) {
        return 0;
    }
    known = work->stamp == data->stamp;
    same_set = known && work->free_set == free_set;
    same_weights = known && drift <= LAMBDA_DRIFT && always == 0;
    if (same_set && same_weights) {
        return 1;
    }
    if (!same_set) {
        sound = factor_free_set(work, data);
        work->stamp = data->stamp;
        work->free_set = free_set;
    }
    if (!same_weights) { /* or else keep W: two sets compared on one path should see the same curvature */
        (void)memcpy(work->lambda_W, work->lambda, sizeof work->lambda);
        sound &= NAME(curvature_in_y)(data, work->lambda_W, work->W);
    }
    NAME(inner_matrix)(work->L, work->W, work->C);
    sound &= NAME(factor)(work->C, work->inv_C, 0);
    solve_for_T(work);
    if (!sound) {
        work->stamp = 0; /* never to be used again */
    }
    return sound;
}

/* out = A in, A given by its columns: one multiplication and addition for all rows at once */
static void multiply(real (*column)[K], const real *in, real *out)
{
    int k, l;
    real sum[K];
    set_zero(sum);
    for (l = 0; l < K; ++l) {
        UNROLLED
        for (k = 0; k < K; ++k) {
            sum[k] += column[l][k] * in[l];
        }
    }
    (void)memcpy(out, sum, sizeof sum);
}

/* Inner product in two halves, which do not wait for each other. */
static real product(const real *a, const real *b)
{
    real even = 0, odd = 0;
    int k;
    UNROLLED
    for (k = 0; k + 1 < K; k += 2) {
        even += a[k] * b[k];
        odd += a[k + 1] * b[k + 1];
    }
#if GNC_ALLOC_K % 2 == 1
    return even + odd + a[K - 1] * b[K - 1];
#else
    return even + odd;
#endif
}

/* The active vertices, the heaviest first, and their gradients z; return how many. */
static int list_vertices(vertices_t *vert, const workspace_t *work, const data_t *data, const point_t *point)
{
    int a, k, j, v, count = 0;
    for (v = 0; v < V && count < A; ++v) {
        if (work->active[v] != 0) {
            vert->list[count] = v;
            if (work->lambda[v] > work->lambda[vert->list[0]]) {
                vert->list[count] = vert->list[0];
                vert->list[0] = v;
            }
            ++count;
        }
    }
    vert->count = count;
    for (a = 0; a < A && a < count; ++a) {
        real z[K];
        set_zero(z);
        v = vert->list[a];
        for (k = 0; k < R; ++k) {
            z[k] = point->r[k][v];
            UNROLLED
            for (j = 0; j < P; ++j) {
                z[R + j] += data->Dv[v][k][j] * z[k];
            }
        }
        (void)memcpy(vert->z[a], z, sizeof z);
    }
    return count;
}

/* List the active vertices and factor their system. Return 0, or the place in the list of the first
 * vertex that depends on those before it, or -1 where an assertion failed. */
int NAME(factor_vertices)(vertices_t *vert, workspace_t *work, const data_t *data, const point_t *point)
{
    int a, b, k;
    const int n = list_vertices(vert, work, data, point);
    if (!GNC_ASSERT(is_within(n, 1, A))) {
        return -1;
    }
    for (a = 0; a < n; ++a) {
        multiply(work->Tt, vert->z[a], vert->J[a]);
    }
    for (a = 1; a < n; ++a) {
        real diagonal, pivot, raw[A];
        for (k = 0; k < K; ++k) {
            vert->J[a][k] -= vert->J[0][k];
        }
        diagonal = product(vert->J[a], vert->J[a]);
        pivot = diagonal;
        for (b = 1; b < a; ++b) {
            real entry = product(vert->J[a], vert->J[b]);
            for (k = 1; k < b; ++k) {
                entry -= raw[k] * vert->G[b][k];
            }
            raw[b] = entry;
            vert->G[a][b] = entry * vert->inv_G[b];
            pivot -= entry * vert->G[a][b];
        }
        if (!GNC_ASSERT(is_finite(pivot))) {
            return -1;
        }
        if (pivot <= DEPENDENT * diagonal + TINY) {
            return a;
        }
        vert->inv_G[a] = 1 / pivot;
    }
    return 0;
}

/* What the n vertex weights gain by the step; return the rise dt of the worst error. What each tie lacks
 * compared with the first, through the factors of G. Adds to eps what they add to the step. */
static real weigh_vertices(const vertices_t *vert, int n, const point_t *point, const real *d0, real *eps,
                           real *dlambda)
{
    int k, a, b;
    real dt;
    dlambda[0] = 0;
    if (n == 0 || !GNC_ASSERT(is_within(n, 1, A))) {
        return 0;
    }
    dt = product(vert->z[0], d0) - product(vert->J[0], eps);
    for (a = 1; a < n; ++a) {
        dlambda[a] = point->q[vert->list[a]] - point->q[vert->list[0]] - product(vert->J[a], eps);
        for (k = 0; k < K; ++k) {
            dlambda[a] += (vert->z[a][k] - vert->z[0][k]) * d0[k];
        }
        for (b = 1; b < a; ++b) {
            dlambda[a] -= vert->G[a][b] * dlambda[b];
        }
    }
    for (a = 1; a < n; ++a) {
        dlambda[a] *= vert->inv_G[a];
    }
    for (a = n - 1; a >= 1; --a) {
        for (b = 1; b < a; ++b) {
            dlambda[b] -= vert->G[a][b] * dlambda[a];
        }
        dlambda[0] -= dlambda[a];
        dt -= product(vert->J[0], vert->J[a]) * dlambda[a];
        UNROLLED
        for (k = 0; k < K; ++k) {
            eps[k] += vert->J[a][k] * dlambda[a];
        }
    }
    return dt;
}

/* Slack of every vertex where the step leads: the worst error there, t, less its own. */
static void slack_at(goal_t *goal, const data_t *data, const point_t *point, const real *dy, real t)
{
    int a, j, v;
    for (v = 0; v < V; ++v) {
        goal->slack[v] = t - point->q[v];
    }
    for (a = 0; a < R; ++a) {
        for (v = 0; v < V; ++v) {
            real move = dy[a];
            UNROLLED
            for (j = 0; j < P; ++j) {
                move += data->D[a][j][v] * dy[R + j];
            }
            goal->slack[v] -= move * point->r[a][v];
        }
    }
}

/* The steps without what y feeds back, into the goal's forces, and the parts of y that bounded and free actuators make. */
static void steps_apart(goal_t *goal, real *bounded, real *loose, const workspace_t *work, const data_t *data,
                        const command_t *command, const point_t *point)
{
    int i, k;
    set_zero(bounded);
    set_zero(loose);
    for (i = 0; i < N; ++i) {
        real *into = loose;
        real d = -data->inv_curvature[i] * point->g[i];
        if (work->side[i] != 0) {
            into = bounded;
            d = (work->side[i] < 0 ? command->lower[i] : command->upper[i]) - work->force[i];
        }
        goal->force[i] = d;
        UNROLLED
        for (k = 0; k < K; ++k) {
            into[k] += data->St[i][k] * d;
        }
    }
}

/* The full step. An empty list of vertices means: hold the vertex weights as they are. */
int NAME(newton_goal)(goal_t *goal, const vertices_t *vert, workspace_t *work, const data_t *data,
                      const command_t *command, const point_t *point)
{
    int i, k, a;
    const int n = vert->count;
    real bounded[K], loose[K], eps[K], dy[K], nu[K], dlambda[A], t, dt;
    if (!GNC_ASSERT(is_within(n, 0, A))) {
        return 0;
    }
    t = n > 0 ? point->q[vert->list[0]] : point->worst;
    steps_apart(goal, bounded, loose, work, data, command, point);
    forward(work->L, work->inv_L, loose);
    forward(work->C, work->inv_C, loose);
    multiply(work->W, bounded, nu);
    multiply(work->Tt, nu, eps);
    for (k = 0; k < K; ++k) {
        eps[k] -= loose[k];
    }
    dt = weigh_vertices(vert, n, point, bounded, eps, dlambda);
    multiply(work->T, eps, dy); /* T' eps */
    for (k = 0; k < K; ++k) {
        dy[k] = bounded[k] - dy[k];
    }
    multiply(work->W, dy, nu);
    (void)memcpy(goal->lambda, work->lambda, sizeof goal->lambda);
    for (a = 0; a < n; ++a) {
        UNROLLED
        for (k = 0; k < K; ++k) {
            nu[k] += vert->z[a][k] * dlambda[a];
        }
        goal->lambda[vert->list[a]] += dlambda[a];
    }
    for (i = 0; i < N; ++i) {
        real g = point->g[i];
        UNROLLED
        for (k = 0; k < K; ++k) {
            g += data->St[i][k] * nu[k];
        }
        goal->bound[i] = work->side[i] != 0 ? g + data->q[i] * goal->force[i] : 0;
        goal->force[i] = work->force[i] + (work->side[i] != 0 ? goal->force[i] : -g * data->inv_curvature[i]);
    }
    slack_at(goal, data, point, dy, t + dt);
    return GNC_ASSERT(is_finite(dt));
}
