/* SPDX-License-Identifier: MIT-0
 *
 * gnc_allocate_setup.c - the set-up: check the problem once, and precompute what stays constant.
 */
#include "gnc_allocate_internal.h"

/* ---- is the problem usable? ------------------------------------------------------------------- */

static int problem_is_sound(const problem_t *problem)
{
    int i, a, j, v, sound;
    real sum = 0; /* adding zero times everything: finite exactly if all of it is */
    sound = GNC_ASSERT(problem->h > 0) && GNC_ASSERT(is_finite(problem->h));
    sound = sound && GNC_ASSERT(problem->tolerance >= 0);
    for (i = 0; i < N; ++i) {
        sound = sound && GNC_ASSERT(problem->m1[i] >= 0) && GNC_ASSERT(problem->m2[i] >= 0);
        sum += 0 * problem->m1[i] + 0 * problem->m2[i] + 0 * problem->preferred[i];
        for (a = 0; a < R; ++a) {
            sum += 0 * problem->A0[a][i];
        }
        for (j = 0; j < P; ++j) {
            sum += 0 * problem->E[j][i];
        }
    }
    for (v = 0; v < V; ++v) {
        for (a = 0; a < R; ++a) {
            for (j = 0; j < P; ++j) {
                sum += 0 * problem->D[v][a][j];
            }
        }
    }
    return sound && GNC_ASSERT(is_finite(sum));
}

/* ---- what stays constant ---------------------------------------------------------------------- */

/* S = sqrt(h) [A0; E] in the arrangements that the solvers read; return the square of its first part's norm. */
static real set_matrices(data_t *data, const problem_t *problem)
{
    int i, k, l, a, j;
    real size_A0 = 0;
    for (i = 0; i < N; ++i) {
        int e = 0;
        for (a = 0; a < R; ++a) {
            data->S[a][i] = data->sqrt_h * problem->A0[a][i];
            data->column[i] += data->S[a][i] * data->S[a][i];
            size_A0 += data->S[a][i] * data->S[a][i];
        }
        for (j = 0; j < P; ++j) {
            data->S[R + j][i] = data->sqrt_h * problem->E[j][i];
        }
        for (k = 0; k < K; ++k) {
            data->St[i][k] = data->S[k][i];
        }
        for (k = 0; k < K; ++k) {
            for (l = 0; l <= k; ++l) {
                data->SS[i][e] = data->S[k][i] * data->S[l][i];
                ++e;
            }
        }
    }
    return size_A0;
}

/* The square root of h, and its inverse. In single precision the power of two that is nearest to it, so that S = sqrt(h)
 * [A0; E] is not rounded, which alone would cost 1e-5 of the objective; what that is off goes to the weights. */
static void set_scale(data_t *data, real h)
{
    real root = SQUARE_ROOT(h);
#ifdef GNC_ALLOC_REAL_FLOAT
    int k;
    real power = 1;
    for (k = 0; k < 75; ++k) { /* from the least number to the largest */
        power *= (real)1.5 * power < root ? 2 : (real)0.75 * power > root ? (real)0.5 : 1;
    }
    root = power;
    data->scale = h / (root * root);
#else
    data->scale = 1;
#endif
    data->sqrt_h = root;
    data->inv_sqrt_h = 1 / root;
}

/* Weights and the curvature of Newton steps; return 0 where the numbers are too large for it. */
static int set_weights(data_t *data, const problem_t *problem, real size_A0)
{
    int i, sound = GNC_ASSERT(is_finite(size_A0));
    real weight_sum = 0;
    for (i = 0; i < N; ++i) {
        weight_sum += problem->m1[i] + problem->m2[i];
    }
    /* Without any weight the forces are not unique; a little of the torque term's curvature makes them so. */
    data->regularised = weight_sum <= 0 && problem->keep_zero_weights == 0;
    for (i = 0; i < N; ++i) {
        real least, sum;
        data->m1[i] = data->regularised != 0 ? (real)ADDED_WEIGHT * size_A0 : problem->m1[i] / data->scale;
        data->m2[i] = problem->m2[i] / data->scale;
        data->preferred[i] = problem->preferred[i];
        sum = data->m1[i] + data->m2[i];
        data->q[i] = is_finite(1 / sum) ? sum : 0; /* subnormal weights bend nothing: no curvature */
        data->inv_q[i] = data->q[i] > 0 ? 1 / data->q[i] : 0;
        /* Zero or vanishing weights: a Newton step needs some curvature to be well defined. Adding it
         * to the step, not to the problem, makes the iteration a proximal-point method. Each actuator has
         * its own, N times the torque term's in its force: of that of the strongest one a weak one would hardly move. */
        least = (data->q[i] > 0 ? (real)CURVATURE_FLOOR : (real)NO_CURVATURE_FLOOR) * (real)(int)N * data->column[i];
        data->curvature[i] = larger(data->q[i], larger(least, TINY));
        data->inv_curvature[i] = 1 / data->curvature[i];
        sound &= GNC_ASSERT(is_finite(data->curvature[i]));
    }
    return sound;
}

/* D_v in both arrangements and D_v'D_v; return 0 where the numbers are too large for it. */
static int set_vertices(data_t *data, const problem_t *problem)
{
    int v, a, j, l, sound = 1;
    for (v = 0; v < V; ++v) {
        int e = 0;
        for (a = 0; a < R; ++a) {
            for (j = 0; j < P; ++j) {
                data->Dv[v][a][j] = problem->D[v][a][j];
                data->D[a][j][v] = data->Dv[v][a][j];
            }
        }
        for (j = 0; j < P; ++j) {
            for (l = 0; l <= j; ++l) {
                for (a = 0; a < R; ++a) {
                    data->DD[v][e] += data->D[a][j][v] * data->D[a][l][v];
                }
                sound &= GNC_ASSERT(is_finite(data->DD[v][e]));
                ++e;
            }
        }
    }
    return sound;
}

/* Do vertices v and w have the same errors? */
static int is_copy(const data_t *data, int v, int w)
{
    int a, j, same = 1;
    for (a = 0; a < R; ++a) {
        for (j = 0; j < P; ++j) {
            same = data->D[a][j][v] == data->D[a][j][w] ? same : 0;
        }
    }
    return same;
}

/* Note which vertices repeat an earlier one (flat box, no uncertainty): a copy adds nothing but a
 * singular system. */
static void find_copies(data_t *data)
{
    int v, w;
    for (v = 0; v < V; ++v) {
        data->original[v] = v;
        for (w = v - 1; w >= 0; --w) { /* the last one found is the first there is */
            data->original[v] = is_copy(data, v, w) ? w : data->original[v];
        }
        data->distinct += data->original[v] == v ? 1 : 0;
    }
}

/* FNV-1a hash, continued over some numbers. */
static uint32_t hash_more(uint32_t hash, const real *numbers, size_t size)
{
    const unsigned char *bytes = (const unsigned char *)numbers;
    uint32_t mixed = hash;
    size_t k;
    if (!GNC_ASSERT(size <= sizeof(data_t))) {
        return 0;
    }
    for (k = 0; k < size; ++k) {
        mixed = (mixed ^ bytes[k]) * 16777619U;
    }
    return mixed;
}

int32_t NAME(setup)(data_t *data, const problem_t *problem)
{
    real size_A0;
    if (!GNC_ASSERT(data != NULL)) {
        return GNC_ALLOC_BAD_PROBLEM;
    }
    (void)memset(data, 0, sizeof *data);
    if (!GNC_ASSERT(ARITHMETIC_FAULTS() == 0U)) { /* no certificate holds in such a build */
        return GNC_ALLOC_BAD_PROBLEM;
    }
    if (!GNC_ASSERT(problem != NULL) || !problem_is_sound(problem)) {
        return GNC_ALLOC_BAD_PROBLEM;
    }
    set_scale(data, problem->h);
    data->tolerance = problem->tolerance > 0 ? problem->tolerance : (real)DEFAULT_TOLERANCE;
    size_A0 = set_matrices(data, problem);
    if (!set_weights(data, problem, size_A0) || !set_vertices(data, problem)) {
        return GNC_ALLOC_BAD_PROBLEM;
    }
    find_copies(data);
    data->stamp = hash_more(2166136261U, &data->S[0][0], sizeof data->S);
    data->stamp = hash_more(data->stamp, data->q, sizeof data->q);
    data->stamp = hash_more(data->stamp, &data->Dv[0][0][0], sizeof data->Dv) | 1U; /* never 0 */
    data->ready = READY;
    return GNC_ALLOC_OPTIMAL;
}
