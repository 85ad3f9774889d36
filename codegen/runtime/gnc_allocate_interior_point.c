/* SPDX-License-Identifier: MIT-0
 *
 * gnc_allocate_interior_point.c - the base method: primal-dual interior point in K = R + P numbers.
 *
 *     minimise  sum (q_i F_i^2/2 + c_i F_i) + t    subject to  lo <= F <= hi,  s_v = t - q_v(y) >= 0
 *
 * with multipliers zl, zu of the box and lambda of the vertices; a predictor and a corrector step per
 * iteration (Mehrotra), one step length for all unknowns. The linear algebra is in
 * gnc_allocate_interior_step.c.
 *
 * The slack is never an unknown of its own: s_v = t - q_v is recomputed from F, and because it is an
 * exact quadratic along a step, the step to its boundary is exact too.
 */
#include "gnc_allocate_internal.h"

enum {
    MAX_STEPS = 34,     /* from the middle of the box */
    MAX_STEPS_NEAR = 26 /* from where the path ended */
};
#define INSIDE (real)0.05 /* of the box: so far from its bounds the iteration begins */
#define NEAR_ROUNDING (real)16 /* of the gap that rounding explains: from there on residuals get twice the digits */
#define SHORT_STEP (real)0.1 /* a step this short did not pay: centre next */
/* go this far towards the nearest boundary: 0.995 throughout loses the way in degenerate problems, but where the
 * predictor takes next to all of the products away, the corrector may follow it */
#define BACK_OFF (real)0.98
#define BACK_OFF_LESS (real)0.999

/* ---- one step ---------------------------------------------------------------------------------- */

/* Longest step, at most 1, that goes this part of the way to where a room or multiplier ends. */
static real step_length(const direction_t *dir, const iterate_t *it, real part)
{
    int i, v;
    real ratio = 0;
    for (i = 0; i < N; ++i) {
        ratio = larger(ratio, larger(-dir->F[i] / it->down[i], dir->F[i] / it->up[i]));
        if (it->zl[i] > 0) {
            ratio = larger(ratio, larger(-dir->zl[i] / it->zl[i], -dir->zu[i] / it->zu[i]));
        }
    }
    for (v = 0; v < V; ++v) {
        const real root = SQUARE_ROOT(dir->rise[v] * dir->rise[v] + 4 * it->s[v] * dir->bend[v]);
        ratio = larger(ratio, larger(-dir->lambda[v] / it->lambda[v], (root - dir->rise[v]) / (2 * it->s[v])));
    }
    return part < ratio ? part / ratio : 1;
}

/* Aim at equal products mu, less the cross terms that the last direction predicts if second_order is 1,
 * and with the loss of slack on a step of that length. */
static void aim(direction_t *dir, const command_t *command, real mu, real step, real second_order)
{
    int i, v;
    for (i = 0; i < N; ++i) {
        const real cross = second_order * dir->zl[i] * dir->F[i];
        const real cross_up = second_order * dir->zu[i] * dir->F[i];
        dir->zl[i] = command->dead[i] != 0 ? 0 : mu - cross;
        dir->zu[i] = command->dead[i] != 0 ? 0 : mu + cross_up;
    }
    for (v = 0; v < V; ++v) {
        dir->lambda[v] = mu - second_order * dir->lambda[v] * dir->rise[v];
        dir->bend[v] *= step * step;
    }
}

/* Where the products would be after a step: mean only. */
static real mean_product(const direction_t *dir, const iterate_t *it, real step, int products)
{
    int i, v;
    real sum = 0;
    for (i = 0; i < N; ++i) {
        sum += (it->zl[i] + step * dir->zl[i]) * (it->down[i] + step * dir->F[i]);
        sum += (it->zu[i] + step * dir->zu[i]) * (it->up[i] - step * dir->F[i]);
    }
    for (v = 0; v < V; ++v) {
        sum += (it->lambda[v] + step * dir->lambda[v]) *
               (it->s[v] + step * dir->rise[v] - step * step * dir->bend[v]);
    }
    return sum / (real)products;
}

/* ---- the iteration ------------------------------------------------------------------------------ */

/* Equal weights, equal products; forces in the middle of the box, or those of the workspace, a little inside it. */
static int set_out(iterate_t *it, real *force, const workspace_t *work, const data_t *data, const command_t *command,
                   point_t *point, int near)
{
    int i, v, products = V;
    const real count = (real)(int)V, inside = near != 0 ? INSIDE : (real)0.5;
    real mu = 0;
    for (i = 0; i < N; ++i) {
        const real width = command->upper[i] - command->lower[i], room = inside * width;
        it->down[i] = smaller(larger(work->force[i] - command->lower[i], room), width - room);
        it->up[i] = width - it->down[i];
        force[i] = command->lower[i] + it->down[i];
        if (command->dead[i] != 0) {
            force[i] = command->lower[i];
            it->down[i] = 1;
            it->up[i] = 1;
        }
    }
    NAME(residuals)(data, command, force, point);
    it->t = larger(2 * point->worst, command->floor) + TINY;
    for (v = 0; v < V; ++v) {
        it->lambda[v] = 1 / count;
        it->s[v] = it->t - point->q[v];
        mu += it->s[v] / (count * count);
    }
    for (i = 0; i < N; ++i) {
        it->zl[i] = command->dead[i] != 0 ? 0 : mu / it->down[i];
        it->zu[i] = command->dead[i] != 0 ? 0 : mu / it->up[i];
        products += command->dead[i] != 0 ? 0 : 2;
    }
    return products;
}

/* A first answer: stay at the previous forces. At rest (u = 0, Fp = 0) it is exactly optimal, while no
 * interior iterate ever is. */
static void rest(workspace_t *work, const data_t *data, const command_t *command, const real *lambda,
                 point_t *point)
{
    int i;
    for (i = 0; i < N; ++i) {
        work->force[i] = larger(command->lower[i], smaller(command->upper[i], command->previous[i]));
    }
    (void)memcpy(work->lambda, lambda, sizeof work->lambda);
    NAME(evaluate)(data, command, work->force, work->lambda, point);
}

/* Which bound an actuator is at: one whose multiplier outweighs what the weights' curvature does with the room. */
static int8_t side_of(const iterate_t *it, const data_t *data, int i)
{
    int8_t side = 0;
    if (it->zl[i] > data->q[i] * it->down[i] && it->down[i] < it->up[i]) {
        side = -1;
    } else if (it->zu[i] > data->q[i] * it->up[i] && it->up[i] < it->down[i]) {
        side = 1;
    } else {
        side = 0;
    }
    return side;
}

/* Record the point for the caller and for the next warm start. */
static void keep(workspace_t *work, const data_t *data, const iterate_t *it, const point_t *point)
{
    int i, v;
    for (i = 0; i < N; ++i) {
        work->side[i] = side_of(it, data, i);
        work->bound[i] = work->side[i] != 0 ? point->g[i] : 0;
    }
    for (v = 0; v < V; ++v) { /* a copy hands its weight to the original */
        const real weight = work->lambda[v];
        int original = data->original[v];
        if (!GNC_ASSERT(is_within(original, 0, v))) {
            original = v; /* damaged data must not lead out of bounds */
        }
        work->lambda[v] = 0;
        work->lambda[original] += weight;
    }
    for (v = 0; v < V; ++v) {
        work->slack[v] = point->worst - point->q[v];
        work->active[v] = (int8_t)(work->lambda[v] * larger(point->worst, TINY) > work->slack[v] ? 1 : 0);
    }
    work->warm = 1;
}

/* Mean of all products multiplier * room. */
static real mean_now(const iterate_t *it, int products)
{
    int i, v;
    real sum = 0;
    for (i = 0; i < N; ++i) {
        sum += it->zl[i] * it->down[i] + it->zu[i] * it->up[i];
    }
    for (v = 0; v < V; ++v) {
        sum += it->lambda[v] * it->s[v];
    }
    return sum / (real)products;
}

/* Take a step. Each force is measured from its nearer bound, so that none is lost in rounding; with care for digits
 * from zero where that is nearer still. */
static void take_step(iterate_t *it, real *force, const direction_t *dir, const command_t *command, real step)
{
    int i, v;
    for (i = 0; i < N; ++i) {
        const real moved = force[i] + step * dir->F[i];
        it->down[i] += step * dir->F[i];
        it->up[i] -= step * dir->F[i];
        it->zl[i] += step * dir->zl[i];
        it->zu[i] += step * dir->zu[i];
        force[i] = it->down[i] < it->up[i] ? command->lower[i] + it->down[i] : command->upper[i] - it->up[i];
        if (command->dead[i] != 0) {
            force[i] = command->lower[i];
        } else if (command->careful != 0 && size_of(moved) < smaller(it->down[i], it->up[i])) {
            force[i] = moved;
            it->down[i] = moved - command->lower[i];
            it->up[i] = command->upper[i] - moved;
        } else {
            continue; /* measured from its nearer bound */
        }
    }
    for (v = 0; v < V; ++v) {
        it->lambda[v] += step * dir->lambda[v];
    }
    it->t += step * dir->t;
}

/* The direction towards a target, and how far it may be followed: 0 where it cannot be computed. */
static real towards(direction_t *dir, factors_t *fac, const data_t *data, const iterate_t *it, const point_t *point,
                    real part)
{
    return NAME(interior_direction)(dir, fac, data, it, point) ? step_length(dir, it, part) : 0;
}

/* A predictor and a corrector; after a round in which these led nowhere, a step back to the centre instead: no round
 * computes more than two directions. */
static int iterate(iterate_t *it, real *force, workspace_t *work, const data_t *data, const command_t *command,
                   const point_t *point, int products)
{
    factors_t fac;
    direction_t dir;
    real step, part = BACK_OFF;
    int v;
    fac.W = work->W;
    fac.L = work->L;
    fac.C = work->C;
    fac.inv_L = work->inv_L;
    fac.inv_C = work->inv_C;
    for (v = 0; v < V; ++v) {
        it->s[v] = larger(it->t - point->q[v], EPS * it->t);
    }
    it->mu = mean_now(it, products);
    if (!NAME(interior_factors)(&fac, data, command, it, point) || !GNC_ASSERT(it->mu > 0)) {
        return 0;
    }
    (void)memset(&dir, 0, sizeof dir); /* predictor: all products to zero */
    if (it->astray != 0) {
        aim(&dir, command, it->mu, 0, 0);
    } else {
        const real far = towards(&dir, &fac, data, it, point, 1);
        const real sigma = mean_product(&dir, it, far, products) / it->mu;
        aim(&dir, command, sigma * sigma * it->mu, far, 1); /* corrector */
        part = larger(BACK_OFF, smaller(BACK_OFF_LESS, 1 - sigma));
    }
    step = towards(&dir, &fac, data, it, point, part);
    if (!GNC_ASSERT(step > 0)) {
        return 0;
    }
    if (it->astray == 0 && step < SHORT_STEP) { /* some product lags far behind */
        it->astray = 1;
    } else {
        it->astray = 0;
    }
    take_step(it, force, &dir, command, step);
    return 1;
}

void NAME(interior_point)(workspace_t *work, const data_t *data, command_t *command, point_t *point,
                          int near, int32_t *iterations)
{
    const int most = near != 0 ? MAX_STEPS_NEAR : MAX_STEPS;
    iterate_t it;
    real force[N], best;
    int k, going;
    int products;
    command->floor = NAME(floor_of)(data, command);
    it.astray = 0;
    work->stamp = 0; /* the factors of the sets make room */
    products = set_out(&it, force, work, data, command, point, near);
    rest(work, data, command, it.lambda, point);
    best = point->gap;
    going = !is_optimal(data, point);
    *iterations = 0;
    for (k = 0; k <= MAX_STEPS && going; ++k) {
        *iterations = k;
        NAME(evaluate)(data, command, force, it.lambda, point);
        if (point->gap < best) {
            best = point->gap;
            (void)memcpy(work->force, force, sizeof force);
            (void)memcpy(work->lambda, it.lambda, sizeof it.lambda);
        }
        going = !is_optimal(data, point) && is_finite(point->gap);
        command->careful = point->gap <= NEAR_ROUNDING * command->floor ? 1 : command->careful;
        if (going && k < most) {
            going = iterate(&it, force, work, data, command, point, products);
        } else {
            going = 0;
        }
    }
    if (point->gap != best) { /* an earlier iterate was better */
        NAME(evaluate)(data, command, work->force, work->lambda, point);
    }
    keep(work, data, &it, point);
}
