/* SPDX-License-Identifier: MIT-0
 *
 * gnc_allocate_point.c - everything about one point: residuals, objective, gradient, certificate; and
 * the matrix of Newton's method that both solvers share.
 *
 * The certificate is computed from F, lambda and the problem data alone: it does not trust a solver.
 */
#include "gnc_allocate_internal.h"

/* A number as the sum of two, the second what the first lost in rounding; or a factor in two halves. */
typedef struct {
    real high, low;
} pair_t;

/* The halves of a number, so short that products of them are exact. */
static pair_t halves(real a)
{
    const real large = (real)SPLITTER * a;
    pair_t half;
    half.high = large - (large - a);
    half.low = a - half.high;
    return half;
}

/* sum + a * b with about twice the digits, given the halves of b (T. J. Dekker, 1971, doi:10.1007/BF01397083). */
static pair_t plus_product(pair_t sum, real a, real b, pair_t half_b)
{
    const pair_t half = halves(a);
    const real product = a * b;
    const real lost = half.low * half_b.low -
                      (((product - half.high * half_b.high) - half.low * half_b.high) - half.high * half_b.low);
    pair_t total;
    real part;
    total.high = sum.high + product;
    part = total.high - sum.high;
    total.low = sum.low + lost + ((sum.high - (total.high - part)) + (product - part));
    return total;
}

/* r, and y, where torque and forces cancel in all digits that one number has. */
static void careful_residuals(const data_t *data, const command_t *command, const real *force, point_t *point)
{
    int i, k, a, j, v;
    pair_t y[K], half[K];
    for (k = 0; k < K; ++k) {
        y[k].high = 0;
        y[k].low = 0;
    }
    for (i = 0; i < N; ++i) {
        const pair_t half_F = halves(force[i]);
        for (k = 0; k < K; ++k) {
            y[k] = plus_product(y[k], data->St[i][k], force[i], half_F);
        }
    }
    for (k = 0; k < K; ++k) {
        point->y[k] = y[k].high + y[k].low;
        half[k] = halves(y[k].high);
    }
    for (a = 0; a < R; ++a) {
        const pair_t one = {1, 0};
        const pair_t middle = plus_product(y[a], -command->b[a], 1, one);
        for (v = 0; v < V; ++v) {
            pair_t r = middle;
            for (j = 0; j < P; ++j) {
                r = plus_product(r, data->D[a][j][v], y[R + j].high, half[R + j]);
                r.low += data->D[a][j][v] * y[R + j].low;
            }
            point->r[a][v] = r.high + r.low;
        }
    }
}

static void plain_residuals(const data_t *data, const command_t *command, const real *force, point_t *point)
{
    int i, k, a, j, v;
    real y[K];
    set_zero(y);
    for (i = 0; i < N; ++i) {
        UNROLLED
        for (k = 0; k < K; ++k) {
            y[k] += data->St[i][k] * force[i];
        }
    }
    (void)memcpy(point->y, y, sizeof y);
    for (a = 0; a < R; ++a) {
        for (v = 0; v < V; ++v) {
            real r = y[a] - command->b[a];
            UNROLLED
            for (j = 0; j < P; ++j) {
                r += data->D[a][j][v] * y[R + j];
            }
            point->r[a][v] = r;
        }
    }
}

void NAME(residuals)(const data_t *data, const command_t *command, const real *force, point_t *point)
{
    int a, v;
    if (command->careful != 0) {
        careful_residuals(data, command, force, point);
    } else {
        plain_residuals(data, command, force, point);
    }
    UNROLLED
    for (v = 0; v < V; ++v) {
        point->q[v] = 0;
    }
    for (a = 0; a < R; ++a) {
        UNROLLED
        for (v = 0; v < V; ++v) {
            point->q[v] += (real)0.5 * point->r[a][v] * point->r[a][v];
        }
    }
    point->worst = point->q[0];
    for (v = 1; v < V; ++v) {
        point->worst = larger(point->worst, point->q[v]);
    }
}

/* g = q F + c + S' sum_v lambda_v z_v */
static void gradient(const data_t *data, const command_t *command, const real *force,
                     const real *lambda, point_t *point)
{
    int i, k, a, j, v;
    real zbar[K];
    set_zero(zbar);
    for (v = 0; v < V; ++v) {
        if (lambda[v] > 0) {
            for (a = 0; a < R; ++a) {
                const real r = lambda[v] * point->r[a][v];
                zbar[a] += r;
                UNROLLED
                for (j = 0; j < P; ++j) {
                    zbar[R + j] += data->Dv[v][a][j] * r;
                }
            }
        }
    }
    for (i = 0; i < N; ++i) {
        real g = data->q[i] * force[i] + command->c[i];
        UNROLLED
        for (k = 0; k < K; ++k) {
            g += data->St[i][k] * zbar[k];
        }
        point->g[i] = g;
    }
}

/* For any F in the box and any lambda on the simplex, the lambda-weighted function lies below phi, is
 * short of it at F by sum lambda (max q - q_v), has gradient g there and curvature at least diag(q).
 * Minimising that quadratic over the box, actuator by actuator, bounds min phi from below. */
static void certify(const data_t *data, const command_t *command, const real *force,
                    const real *lambda, point_t *point)
{
    int i, v;
    real gap = 0, weights = 0;
    for (v = 0; v < V; ++v) {
        gap += lambda[v] * (point->worst - point->q[v]);
    }
    for (i = 0; i < N; ++i) {
        const real down = command->lower[i] - force[i], up = command->upper[i] - force[i];
        const real g = point->g[i], q = data->q[i];
        const real newton = q > 0 ? -g * data->inv_q[i] : g > 0 ? down : up;
        const real d = larger(down, smaller(up, newton));
        const real effort = force[i] - data->preferred[i], change = force[i] - command->previous[i];
        gap += larger(0, -(g + (real)0.5 * q * d) * d);
        weights += data->m1[i] * effort * effort + data->m2[i] * change * change;
    }
    point->gap = gap;
    point->phi = (real)0.5 * weights + point->worst;
}

void NAME(evaluate)(const data_t *data, const command_t *command, const real *force,
                    const real *lambda, point_t *point)
{
    NAME(residuals)(data, command, force, point);
    gradient(data, command, force, lambda, point);
    certify(data, command, force, lambda, point);
}

/* The gap that rounding explains: some EPS of the size of phi over the box. */
real NAME(floor_of)(const data_t *data, const command_t *command)
{
    int i, a;
    real box = 0, corner = 0, weights = 0;
    for (a = 0; a < R; ++a) {
        corner += command->b[a] * command->b[a];
    }
    for (i = 0; i < N; ++i) {
        const real width = command->upper[i] - command->lower[i];
        const real effort = size_of(command->lower[i] - data->preferred[i]) + width;
        const real change = size_of(command->lower[i] - command->previous[i]) + width;
        weights += data->m1[i] * effort * effort + data->m2[i] * change * change;
        box += data->column[i] * width * width;
        corner += data->column[i] * command->lower[i] * command->lower[i];
    }
    return (real)ROUNDING_FLOOR * (weights + larger(corner, box));
}

/* W = sum lambda_v [I D_v]'[I D_v], the curvature of the lambda-weighted function in y. */
int NAME(curvature_in_y)(const data_t *data, const real *lambda, real (*W)[K])
{
    int k, l, v, e = 0;
    real sum = 0, packed[GNC_ALLOC_AT_LEAST_1(PT)] = {0};
    for (k = 0; k < K; ++k) {
        set_zero(W[k]);
    }
    for (v = 0; v < V; ++v) {
        if (lambda[v] > 0) {
            sum += lambda[v];
            for (k = 0; k < P; ++k) {
                UNROLLED
                for (l = 0; l < R; ++l) {
                    W[R + k][l] += lambda[v] * data->Dv[v][l][k];
                }
            }
            UNROLLED
            for (l = 0; l < PT; ++l) {
                packed[l] += lambda[v] * data->DD[v][l];
            }
        }
    }
    for (k = 0; k < P; ++k) {
        for (l = 0; l <= k; ++l) {
            W[R + k][R + l] = packed[e];
            ++e;
        }
    }
    for (k = 0; k < R; ++k) {
        W[k][k] = sum;
    }
    for (k = 0; k < K; ++k) {
        for (l = 0; l < k; ++l) {
            W[l][k] = W[k][l];
        }
    }
    return GNC_ASSERT(sum > 0);
}

/* The lower triangle of C = I + L' W L. With L L' = S diag(1/d) S' it carries the whole Newton system, and its
 * eigenvalues are 1 or more: safe to factor whatever the data. */
void NAME(inner_matrix)(real (*L)[K], real (*W)[K], real (*C)[K])
{
    int i, k, l;
    for (k = 0; k < K; ++k) {
        real row[K];
        set_zero(row);
        for (i = 0; i < K; ++i) {
            UNROLLED
            for (l = 0; l < K; ++l) { /* beyond its triangle L is zero */
                row[l] += W[k][i] * L[i][l];
            }
        }
        (void)memcpy(C[k], row, sizeof row);
    }
    for (k = 0; k < K; ++k) { /* from W L in place: row k asks for the rows from k on */
        real row[K];
        set_zero(row);
        row[k] = 1;
        for (i = k; i < K; ++i) {
            UNROLLED
            for (l = 0; l < K; ++l) {
                row[l] += L[i][k] * C[i][l];
            }
        }
        (void)memcpy(C[k], row, sizeof row);
    }
}

/* A = L L' in place. A pivot lost in rounding becomes a zero column: S may have dependent rows
 * (wheels), and few actuators may be free. */
int NAME(factor)(real (*matrix)[K], real *inverse, real lost)
{
    int i, j, k, sound = 1;
    for (j = 0; j < K; ++j) {
        real *row = matrix[j];
        real pivot = row[j];
        const real smallest = lost * pivot;
        for (k = 0; k < j; ++k) {
            pivot -= row[k] * row[k];
        }
        sound &= GNC_ASSERT(is_finite(pivot));
        /* sqrt(p) and 1/p do not wait for each other, as 1/sqrt(p) would */
        row[j] = pivot > smallest ? SQUARE_ROOT(pivot) : 0;
        inverse[j] = pivot > smallest ? row[j] * (1 / pivot) : 0;
        for (i = j + 1; i < K; ++i) {
            real entry = matrix[i][j];
            UNROLLED
            for (k = 0; k < j; ++k) {
                entry -= matrix[i][k] * row[k];
            }
            matrix[i][j] = entry * inverse[j];
            row[i] = 0;
        }
    }
    return sound;
}

/* L L' = S diag(weight) S', an outer product at a time. */
int NAME(factor_forces)(real (*L)[K], real *inverse, const data_t *data, const real *weight, real lost)
{
    int i, k, l, e = 0;
    real packed[KT] = {0};
    for (i = 0; i < N; ++i) {
        if (weight[i] > 0) {
            for (k = 0; k < KT; ++k) {
                packed[k] += data->SS[i][k] * weight[i];
            }
        }
    }
    for (k = 0; k < K; ++k) {
        for (l = 0; l <= k; ++l) {
            L[k][l] = packed[e];
            ++e;
        }
    }
    return NAME(factor)(L, inverse, lost);
}
