/* SPDX-License-Identifier: MIT-0
 *
 * allocator_millions.c - many problems of every family through the online allocator, each answer against its promises.
 * Not flight code.
 *
 *     allocator_millions CALLS SEED
 *
 * The families are those of online_allocator.py. Each problem gets a cold start, jumps of the command, and a hill climb:
 * the costliest command so far is changed a little, and kept where it costs more. Of every answer is checked that it is
 * in its box, within the caps of iterations, and that its gap is true: forces and weights are evaluated here in long
 * double, from the problem alone, by the sums of the definition; that gives a lower bound of the least cost which no
 * code of the allocator has touched, and no feasible point that is at hand may lie below it or below the reported one.
 */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "gnc_allocate.h"

#define NAME(word) GNC_ALLOC_NAME(word)
typedef NAME(real) real;
typedef long double wide;

enum {
    N = GNC_ALLOC_N, R = GNC_ALLOC_R, P = GNC_ALLOC_P, V = GNC_ALLOC_V, COMMANDS = 12, FAMILIES = 16,
    WARM_WORK = 5, BLOCK_STEPS = 6, PIECES = 10 + N, INTERIOR = 34
};
enum { ZERO, SURE, FLAT, ASYMMETRIC, TIES, FAR, STUCK, RATE, M1_ZERO, ALL_ZERO, MIXED_ZERO, H, EXTREME, BOTH, PREFERRED,
       PLAIN };
static const char *const names[FAMILIES] = {
    "zero", "no_uncertainty", "flat_box", "asymmetric_box", "ties", "unreachable", "stuck", "rate", "m1_zero", "all_zero",
    "mixed_zero", "h", "extreme_weights", "two_sided", "preferred", "plain"};
static const wide tolerance = 1e-8L, rounding = 1e-6L, added = 1e-5L, weight = 1e-9L, seen = 1e-9L, floor_ = 1e-14L;

/* ---- random numbers -------------------------------------------------------------------------------- */

static uint64_t state;

static double uniform(void)
{
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return (double)((state * UINT64_C(0x2545f4914f6cdd1d)) >> 11) * 0x1p-53;
}
static double between(double low, double high) { return low + (high - low) * uniform(); }
static double normal(void) { return sqrt(-2 * log(1 - uniform())) * cos(6.283185307179586 * uniform()); }
static int below(int count) { return (int)(uniform() * count); }

/* ---- problems and commands -------------------------------------------------------------------------- */

static NAME(problem) problem;
static double top;
typedef struct {
    real torque[R], previous[N], lower[N], upper[N], step[N];
    int with_step;
} command;
static command box; /* what all commands of a problem have in common */

static void skew(double *to, const double *r) /* rows of -[r]x */
{
    const double rows[9] = {0, r[2], -r[1], -r[2], 0, r[0], r[1], -r[0], 0};
    memcpy(to, rows, sizeof rows);
}

static void draw_vertices(int family)
{
    const double sizes[4] = {1e-3, 5e-3, 2e-2, 5e-2};
    double low[3], high[3], size = sizes[below(4)], rows[9], r[3];
    int v, a, j, flat = below(3);
    for (a = 0; a < 3; a++) {
        high[a] = family == SURE || (family == FLAT && a == flat) ? 0 : size;
        low[a] = family == ASYMMETRIC ? -high[a] * between(0, 2) : -high[a];
        high[a] *= family == ASYMMETRIC ? between(0, 2) : 1;
    }
    for (v = 0; v < V; v++) {
        for (a = 0; a < 3; a++) r[a] = (v >> a) & 1 ? high[a] : low[a];
        skew(rows, r);
        for (a = 0; a < 3 && a < R; a++)
            for (j = 0; j < P; j++) problem.D[v][a][j] = (real)rows[3 * a + j];
    }
}

static void draw_problem(int family)
{
    int i, a;
    memset(&problem, 0, sizeof problem);
    memset(&box, 0, sizeof box);
    top = pow(10, between(-3, 3));
    problem.h = (real)(family == H ? pow(10, between(2, 9)) : 1e6);
    for (i = 0; i < N; i++) {
        double e[3], at[3], length = 0;
        for (a = 0; a < 3; a++) {
            at[a] = between(-0.3, 0.3);
            e[a] = normal();
            length += e[a] * e[a];
        }
        for (a = 0; a < 3; a++) e[a] /= sqrt(length);
        for (a = 0; a < R; a++) {
            const int b = (a + 1) % 3, c = (a + 2) % 3;
            problem.A0[a][i] = (real)(a < 3 ? at[b] * e[c] - at[c] * e[b] : 0.3 * e[a - 3]);
        }
        for (a = 0; a < P; a++) problem.E[a][i] = (real)e[a];
        problem.m1[i] = family == M1_ZERO || family == ALL_ZERO ? 0 : 1;
        problem.m2[i] = family == TIES || family == ALL_ZERO ? 0 : 1;
        if (family == MIXED_ZERO) {
            problem.m1[i] = (real)below(2);
            problem.m2[i] = (real)below(2);
        } else if (family == EXTREME) {
            problem.m1[i] = (real)pow(10, between(-6, 6));
            problem.m2[i] = (real)pow(10, between(-6, 6));
        }
        problem.preferred[i] = (real)(family == PREFERRED ? between(0, top) : 0);
        box.upper[i] = (real)top;
        box.lower[i] = (real)(family == BOTH ? -top : 0);
        if (family == STUCK && below(3) == 0) {
            box.upper[i] = below(2) ? 0 : (real)top;
            box.lower[i] = box.upper[i];
        }
    }
    if (family == RATE) {
        const double step = top * pow(10, between(-3, 0));
        box.with_step = 1;
        for (i = 0; i < N; i++) box.step[i] = (real)step;
    }
    draw_vertices(family);
}

static void draw_command(command *c, int family)
{
    const double size = 0.1 * top * (family == ZERO ? 0 : family == TIES ? 0.2 : family == FAR ? 10 : 1);
    const int rest = family == ZERO && below(2), wide_ = family == RATE && below(2);
    int i;
    *c = box;
    for (i = 0; i < R; i++) c->torque[i] = (real)(size * normal());
    for (i = 0; i < N; i++)
        c->previous[i] = (real)(rest ? 0 : wide_ ? between(-top, 2 * top) : between(0, top));
}

/* The costliest command, changed a little: one number anew, or all by a part. */
static void change_command(command *c, const command *costliest, int family)
{
    command other;
    const double part = pow(10, between(-6, 0));
    int i;
    draw_command(&other, family);
    *c = *costliest;
    for (i = 0; i < R; i++) c->torque[i] += (real)part * (other.torque[i] - c->torque[i]);
    for (i = 0; i < N; i++) c->previous[i] += (real)part * (other.previous[i] - c->previous[i]);
    if (below(4) == 0) c->previous[below(N)] = below(2) ? box.lower[0] : box.upper[0]; /* at a bound */
}

/* ---- the second program: cost and lower bound from the definition, in long double -------------------- */

typedef struct {
    wide cost, gap, scale;
    int inside, on_simplex;
} bound;

static void limits(const command *c, int i, real *low, real *high)
{
    *low = c->lower[i];
    *high = c->upper[i];
    if (c->with_step) {
        const real down = c->previous[i] - c->step[i], up = c->previous[i] + c->step[i];
        *low = fmin(fmax(c->lower[i], down), c->upper[i]);
        *high = fmax(fmin(c->upper[i], up), c->lower[i]);
    }
}

/* What the set-up adds to m1 where there are no weights. */
static wide added_weight(void)
{
    wide all = 0, size = 0;
    int k, a;
    for (k = 0; k < N; k++) {
        all += (wide)problem.m1[k] + problem.m2[k];
        for (a = 0; a < R; a++) size += (wide)problem.A0[a][k] * problem.A0[a][k];
    }
    return all > 0 ? 0 : weight * problem.h * size;
}

static bound judge(const command *c, const real *force, const real *lambda)
{
    wide q[V], g[N] = {0}, worst = 0, sum = 0, mean = 0, at_corner = 0, over_box = 0;
    bound b = {0, 0, 0, 1, 1};
    int i, a, j, v;
    const wide extra = added_weight();
    for (v = 0; v < V; v++) {
        wide corner = 0;
        b.on_simplex = b.on_simplex && lambda[v] >= 0;
        sum += lambda[v];
        q[v] = 0;
        for (a = 0; a < R; a++) {
            wide error = -(wide)c->torque[a], lowest = -(wide)c->torque[a], row[N];
            for (i = 0; i < N; i++) {
                row[i] = problem.A0[a][i];
                for (j = 0; j < P; j++) row[i] += (wide)problem.D[v][a][j] * problem.E[j][i];
                error += row[i] * force[i];
                lowest += row[i] * c->lower[i];
            }
            q[v] += problem.h * error * error;
            corner += problem.h * lowest * lowest;
            for (i = 0; i < N; i++) g[i] += 2 * problem.h * lambda[v] * error * row[i];
        }
        worst = fmaxl(worst, q[v]);
        at_corner = fmaxl(at_corner, corner);
    }
    b.on_simplex = b.on_simplex && fabsl(sum - 1) < 1e-4L;
    for (v = 0; v < V; v++) mean += lambda[v] * q[v] / sum;
    b.gap = worst - mean;
    b.cost = worst;
    for (i = 0; i < N; i++) {
        const wide m1 = problem.m1[i] + extra, m2 = problem.m2[i];
        const wide effort = (wide)force[i] - problem.preferred[i], change = (wide)force[i] - c->previous[i];
        const wide slope = g[i] / sum + 2 * m1 * effort + 2 * m2 * change, bend = m1 + m2;
        real low, high;
        wide down, up, d, width;
        limits(c, i, &low, &high);
        b.inside = b.inside && low <= force[i] && force[i] <= high;
        down = (wide)low - force[i];
        up = (wide)high - force[i];
        width = up - down;
        d = bend > 0 ? -slope / (2 * bend) : slope > 0 ? down : up;
        d = fmaxl(down, fminl(up, d));
        b.gap -= slope * d + bend * d * d;
        b.cost += m1 * effort * effort + m2 * change * change;
        b.scale += m1 * powl(fabsl((wide)low - problem.preferred[i]) + width, 2);
        b.scale += m2 * powl(fabsl((wide)low - c->previous[i]) + width, 2);
        for (a = 0; a < R; a++) over_box += problem.h * powl(problem.A0[a][i] * width, 2);
    }
    b.scale += fmaxl(at_corner, over_box);
    return b;
}

/* ---- one call and what it promised -------------------------------------------------------------------- */

typedef struct {
    long calls, ended[3];
    double gaps[3];
    int active_set, interior_point;
} account;
static account accounts[FAMILIES];
static NAME(data) data;
static NAME(workspace) work, fresh;
static long failures;

static void fail(const char *what, int family, long call, wide number)
{
    printf("%s: N %d R %d family %s call %ld: %.3Le\n", what, N, R, names[family], call, number);
    failures++;
}

static int solve(const command *c, int family, long call)
{
    NAME(result) r, other;
    account *sum = &accounts[family];
    bound b, at_rest, by_other;
    wide slack;
    real rest[N];
    int i, with_weights = 0;
    const int status = NAME(solve)(&work, &data, c->torque, c->previous, c->lower, c->upper,
                                   c->with_step ? c->step : NULL, &r);
    if (status > GNC_ALLOC_NOT_CERTIFIED) {
        fail("refused", family, call, status);
        return 0;
    }
    b = judge(c, r.force, r.lambda);
    slack = seen * b.cost + 0.1L * floor_ * b.scale;
    for (i = 0; i < N; i++) {
        real low, high;
        limits(c, i, &low, &high);
        rest[i] = fmin(fmax(c->previous[i], low), high);
        with_weights |= problem.m1[i] + problem.m2[i] > 0;
    }
    if (!b.inside) fail("outside its box", family, call, 0);
    if (!b.on_simplex) fail("weights off the simplex", family, call, 0);
    if (r.active_set_iterations > WARM_WORK + BLOCK_STEPS + PIECES || r.interior_point_iterations > INTERIOR)
        fail("above the cap", family, call, r.active_set_iterations + r.interior_point_iterations);
    if (fabsl(r.gap - b.gap) > slack) fail("another gap", family, call, (r.gap - b.gap) / b.cost);
    if (fabsl(r.objective - b.cost) > slack) fail("another cost", family, call, (r.objective - b.cost) / b.cost);
    if (b.gap < -floor_ * b.scale) fail("a gap below zero", family, call, b.gap / b.cost);
    if (status == GNC_ALLOC_OPTIMAL && b.gap > 1.0001L * tolerance * b.cost + floor_ * b.scale)
        fail("not optimal", family, call, b.gap / b.cost);
    if (status == GNC_ALLOC_AT_ROUNDING && b.gap > 1.0001L * (with_weights ? rounding : added) * b.cost + floor_ * b.scale)
        fail("not at rounding", family, call, b.gap / b.cost);
    at_rest = judge(c, rest, r.lambda);
    if (r.objective - r.gap > at_rest.cost + slack || b.cost - b.gap > at_rest.cost + floor_ * b.scale)
        fail("above the cost of rest", family, call, 0);
    if (call % 16 == 0 || status == GNC_ALLOC_NOT_CERTIFIED) {
        NAME(reset)(&fresh);
        (void)NAME(solve_interior_point)(&fresh, &data, c->torque, c->previous, c->lower, c->upper,
                                         c->with_step ? c->step : NULL, &other);
        by_other = judge(c, other.force, other.lambda);
        if (r.objective - r.gap > by_other.cost + slack || b.cost - b.gap > by_other.cost + floor_ * b.scale)
            fail("above the cost of the interior point", family, call, 0);
        if (by_other.cost - by_other.gap > b.cost + floor_ * b.scale)
            fail("below the interior point's bound", family, call, 0);
    }
    if (status == GNC_ALLOC_NOT_CERTIFIED && sum->ended[2] < 3)
        printf("not certified: N %d R %d family %s call %ld: %.3Le of the cost, %.3Le of its size over the box\n", N, R,
               names[family], call, b.gap / b.cost, b.gap / b.scale);
    sum->calls++;
    sum->ended[status]++;
    if (b.cost > 0 && b.gap > sum->gaps[status] * b.cost) sum->gaps[status] = (double)(b.gap / b.cost);
    if (r.active_set_iterations > sum->active_set) sum->active_set = r.active_set_iterations;
    if (r.interior_point_iterations > sum->interior_point) sum->interior_point = r.interior_point_iterations;
    return r.active_set_iterations + 4 * r.interior_point_iterations;
}

int main(int argc, char **argv)
{
    const long calls = argc > 1 ? atol(argv[1]) : 10000;
    const uint64_t seed = argc > 2 ? (uint64_t)atol(argv[2]) : 1;
    long call = 0;
    int family, k;
    state = seed * UINT64_C(2654435761) + UINT64_C(88172645463325252);
    while (call < calls) {
        command c, costliest;
        int cost, most = -1;
        family = (int)(call / COMMANDS) % FAMILIES;
        draw_problem(family);
        if (NAME(setup)(&data, &problem) != GNC_ALLOC_OPTIMAL) fail("problem refused", family, call, 0);
        if (below(2)) NAME(reset)(&work); /* else the workspace of another problem */
        for (k = 0; k < COMMANDS; k++, call++) {
            if (k < COMMANDS / 2) draw_command(&c, family);
            else change_command(&c, &costliest, family);
            cost = solve(&c, family, call);
            if (cost >= most) {
                most = cost;
                costliest = c;
            }
        }
    }
    for (k = 0; k < FAMILIES; k++) {
        const account *a = &accounts[k];
        printf("%d %d %s calls %ld optimal %ld %.1e rounding %ld %.1e open %ld %.1e rounds %d %d\n", N, R, names[k], a->calls,
               a->ended[0], a->gaps[0], a->ended[1], a->gaps[1], a->ended[2], a->gaps[2], a->active_set, a->interior_point);
    }
    printf("%ld calls, %ld failures\n", call, failures);
    return failures != 0;
}
