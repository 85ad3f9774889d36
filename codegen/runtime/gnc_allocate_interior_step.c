/* SPDX-License-Identifier: MIT-0
 *
 * gnc_allocate_interior_step.c - the linear algebra of the interior point, in K = R + P numbers.
 *
 * All curvature besides a diagonal lies in y = S F, so a Newton step needs one K x K system for y and
 * one V x V system for lambda:
 *
 *     d_i = q_i + zl/(F-lo) + zu/(hi-F)         S diag(1/d) S' = L L'
 *     W   = sum lambda_v [I D_v]'[I D_v]        I + L' W L = C C'         (eigenvalues >= 1)
 *     J   = C^-1 L' Z                           B = J'J + diag(s/lambda)
 *
 * Eliminating lambda first would leave a single K x K matrix, W + sum (lambda/s) z z', and half the
 * work; but its condition grows with 1/s and the iteration breaks down near a gap of 1e-9.
 */
#include "gnc_allocate_internal.h"

/* z_v = [r_v; D_v' r_v] */
static void vertex_gradients(real (*z)[V], const data_t *data, const point_t *point)
{
    int a, j, v;
    (void)memcpy(z, point->r, sizeof point->r);
    for (j = 0; j < P; ++j) {
        for (v = 0; v < V; ++v) {
            real sum = 0;
            UNROLLED
            for (a = 0; a < R; ++a) {
                sum += data->D[a][j][v] * point->r[a][v];
            }
            z[R + j][v] = sum;
        }
    }
}

/* The triangle U of B = diag(s/lambda) + J'J = U'U by Householder reflections of the stacked matrix
 * [sqrt(diag); J]. Forming J'J would lose the diagonal in its rounding: with more vertices than rows of
 * J, or with tied ones, the diagonal alone decides how weight is shared among them. */
static int factor_B(factors_t *fac, const iterate_t *it)
{
    int j, k, l, sound = 1;
    real left[K][V];
    (void)memcpy(left, fac->J, sizeof left);
    for (j = 0; j < V; ++j) {
        const real d2 = it->s[j] / it->lambda[j], d = SQUARE_ROOT(d2);
        real column[K], w[V] = {0}, norm = d2, inverse;
        for (k = 0; k < K; ++k) {
            column[k] = left[k][j];
            norm += column[k] * column[k];
            UNROLLED
            for (l = 0; l < V; ++l) {
                w[l] += column[k] * left[k][l];
            }
        }
        sound &= GNC_ASSERT(d2 > 0);
        sound &= GNC_ASSERT(is_finite(norm));
        norm = SQUARE_ROOT(norm);
        inverse = 1 / norm;
        fac->inv_U[j] = inverse;
        UNROLLED
        for (l = 0; l < V; ++l) {
            fac->U[j][l] = w[l] * inverse; /* needed for l > j only */
        }
        inverse = 1 / (d + norm);
        for (k = 0; k < K; ++k) {
            UNROLLED
            for (l = 0; l < V; ++l) {
                left[k][l] -= fac->U[j][l] * inverse * column[k];
            }
        }
    }
    return sound;
}

/* x <- B^-1 x */
static void solve_B(const factors_t *fac, real *x)
{
    int j, l;
    for (j = 0; j < V; ++j) {
        x[j] *= fac->inv_U[j];
        for (l = j + 1; l < V; ++l) {
            x[l] -= fac->U[j][l] * x[j];
        }
    }
    for (j = V - 1; j >= 0; --j) {
        for (l = j + 1; l < V; ++l) {
            x[j] -= fac->U[j][l] * x[l];
        }
        x[j] *= fac->inv_U[j];
    }
}

/* L L' = S diag(1/d) S' */
static int factor_actuators(factors_t *fac, const data_t *data, const command_t *command, const iterate_t *it)
{
    int i;
    for (i = 0; i < N; ++i) {
        /* Without weights the barrier bends enough; more would slow the last digits down to those of a gradient step. */
        const real bend = larger(data->q[i], (real)CURVATURE_FLOOR * (real)(int)N * data->column[i] + TINY);
        const real d = bend + it->zl[i] / it->down[i] + it->zu[i] / it->up[i];
        fac->invd[i] = command->dead[i] != 0 ? 0 : 1 / d;
    }
    return NAME(factor_forces)(fac->L, fac->inv_L, data, fac->invd, 2 * EPS);
}

/* J = C^-1 L' Z */
static void project_vertices(factors_t *fac)
{
    int i, k, l, v;
    for (k = 0; k < K; ++k) {
        UNROLLED
        for (v = 0; v < V; ++v) {
            fac->J[k][v] = 0;
        }
        for (i = k; i < K; ++i) {
            UNROLLED
            for (v = 0; v < V; ++v) {
                fac->J[k][v] += fac->L[i][k] * fac->z[i][v];
            }
        }
        for (l = 0; l < k; ++l) {
            UNROLLED
            for (v = 0; v < V; ++v) {
                fac->J[k][v] -= fac->C[k][l] * fac->J[l][v];
            }
        }
        for (v = 0; v < V; ++v) {
            fac->J[k][v] *= fac->inv_C[k];
        }
    }
}

int NAME(interior_factors)(factors_t *fac, const data_t *data, const command_t *command,
                           const iterate_t *it, const point_t *point)
{
    int v, sound;
    vertex_gradients(fac->z, data, point);
    sound = factor_actuators(fac, data, command, it);
    sound &= NAME(curvature_in_y)(data, it->lambda, fac->W);
    NAME(inner_matrix)(fac->L, fac->W, fac->C);
    sound &= NAME(factor)(fac->C, fac->inv_C, 0);
    project_vertices(fac);
    sound &= factor_B(fac, it);
    for (v = 0; v < V; ++v) {
        fac->B1[v] = 1;
    }
    solve_B(fac, fac->B1);
    fac->sum_B1 = 0;
    for (v = 0; v < V; ++v) {
        fac->sum_B1 += fac->B1[v];
    }
    return sound & GNC_ASSERT(fac->sum_B1 > 0);
}

/* The vertex weights of the direction, and what they leave of eps for the forces. */
static void vertex_direction(direction_t *dir, const factors_t *fac, const iterate_t *it, real *eps)
{
    int k, v;
    real excess = -1;
    for (v = 0; v < V; ++v) {
        dir->lambda[v] = dir->lambda[v] / it->lambda[v] - it->s[v] + dir->bend[v];
        excess += it->lambda[v];
    }
    for (k = 0; k < K; ++k) {
        UNROLLED
        for (v = 0; v < V; ++v) {
            dir->lambda[v] += fac->J[k][v] * eps[k];
        }
    }
    solve_B(fac, dir->lambda);
    for (v = 0; v < V; ++v) {
        excess += dir->lambda[v];
    }
    dir->t = excess / fac->sum_B1;
    for (v = 0; v < V; ++v) {
        dir->lambda[v] -= fac->B1[v] * dir->t;
    }
    for (k = 0; k < K; ++k) {
        UNROLLED
        for (v = 0; v < V; ++v) {
            eps[k] -= fac->J[k][v] * dir->lambda[v];
        }
    }
}

/* nu = W L eps + Z dlambda, what pulls at the forces */
static void pull_on_forces(real *nu, const direction_t *dir, const factors_t *fac, const real *eps)
{
    int i, k, v;
    real dy[K] = {0};
    for (k = 0; k < K; ++k) {
        for (i = 0; i <= k; ++i) {
            dy[k] += fac->L[k][i] * eps[i];
        }
    }
    for (k = 0; k < K; ++k) {
        nu[k] = 0;
        UNROLLED
        for (i = 0; i < K; ++i) {
            nu[k] += fac->W[k][i] * dy[i];
        }
        UNROLLED
        for (v = 0; v < V; ++v) {
            nu[k] += fac->z[k][v] * dir->lambda[v];
        }
    }
}

/* How the slacks change along the direction dy. */
static void slack_along(direction_t *dir, const factors_t *fac, const data_t *data, const real *dy)
{
    int a, j, k, v;
    UNROLLED
    for (v = 0; v < V; ++v) {
        dir->rise[v] = dir->t;
        dir->bend[v] = 0;
    }
    for (k = 0; k < K; ++k) {
        UNROLLED
        for (v = 0; v < V; ++v) {
            dir->rise[v] -= fac->z[k][v] * dy[k];
        }
    }
    for (a = 0; a < R; ++a) {
        for (v = 0; v < V; ++v) {
            real move = dy[a];
            UNROLLED
            for (j = 0; j < P; ++j) {
                move += data->D[a][j][v] * dy[R + j];
            }
            dir->bend[v] += (real)0.5 * move * move;
        }
    }
}

/* The direction towards the products that it holds:
 *     d dF + S'(W dy + Z dlambda) = rho,   (s/lambda) dlambda + dt - Z'dy = beta,   sum lambda = 1 */
int NAME(interior_direction)(direction_t *dir, factors_t *fac, const data_t *data, const iterate_t *it,
                             const point_t *point)
{
    int i, k;
    real rho[N], eps[K] = {0}, dy[K] = {0}, nu[K];
    for (i = 0; i < N; ++i) {
        rho[i] = -point->g[i] + dir->zl[i] / it->down[i] - dir->zu[i] / it->up[i];
        UNROLLED
        for (k = 0; k < K; ++k) {
            eps[k] += data->St[i][k] * (rho[i] * fac->invd[i]);
        }
    }
    forward(fac->L, fac->inv_L, eps);
    forward(fac->C, fac->inv_C, eps);
    vertex_direction(dir, fac, it, eps);
    backward(fac->C, fac->inv_C, eps);
    pull_on_forces(nu, dir, fac, eps);
    for (i = 0; i < N; ++i) {
        UNROLLED
        for (k = 0; k < K; ++k) {
            rho[i] -= data->S[k][i] * nu[k];
        }
        dir->F[i] = rho[i] * fac->invd[i];
        dir->zl[i] = (dir->zl[i] - it->zl[i] * dir->F[i]) / it->down[i] - it->zl[i];
        dir->zu[i] = (dir->zu[i] + it->zu[i] * dir->F[i]) / it->up[i] - it->zu[i];
        UNROLLED
        for (k = 0; k < K; ++k) {
            dy[k] += data->St[i][k] * dir->F[i]; /* S dF: closer to the truth than L eps */
        }
    }
    slack_along(dir, fac, data, dy);
    return GNC_ASSERT(is_finite(dir->t));
}
