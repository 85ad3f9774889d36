/* SPDX-License-Identifier: MIT-0
 *
 * fuzz_allocator.c - random problems, commands and damage against the allocator. Not flight code.
 *
 *     fuzz_allocator steps seed [damage] [failing assertions]
 *
 * Every input may be NaN, infinite, denormal, huge or absent. What must hold of every answer is stated anew in
 * check_answer(), from the inputs alone. With `damage` bits of the workspace and of the data flip now and then; with
 * `failing assertions` a share of 1e-3 of the assertions is made to fail. The last line counts what happened.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "gnc_allocate.h"

#define NAME(word) GNC_ALLOC_NAME(word)
typedef NAME(real) real;

enum { N = GNC_ALLOC_N, R = GNC_ALLOC_R, P = GNC_ALLOC_P, V = GNC_ALLOC_V, MOST_ITERATIONS = 5 + 6 + 10 + N + 34 };
#ifdef GNC_ALLOC_REAL_FLOAT
#define LARGEST 3.4e38F
#define SMALLEST 1e-45F
#define SAFE 1e12F /* squares and their sums do not overflow */
#define TOLERANCE 2e-2
#define ROUNDING 1e-10 /* square of what is lost in a sum of numbers of the size of 1 */
#else
#define LARGEST 1.7e308
#define SMALLEST 4.9e-324
#define SAFE 1e100
#define TOLERANCE 1e-6
#define ROUNDING 1e-28
#endif

/* ---- random numbers ----------------------------------------------------------------------------- */

static uint64_t state;
static int failing;
static long counts[5], failed_assertions, rechecked;

static uint64_t draw(void)
{
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return state * UINT64_C(0x2545f4914f6cdd1d);
}

static double uniform(void) { return (double)(draw() >> 11) * 0x1p-53; }
static int one_in(int n) { return draw() % (uint64_t)n == 0; }
static real between(double low, double high) { return (real)(low + (high - low) * uniform()); }
static int finite_number(real a) { return a - a == 0; }

/* The assertions of the code under test end here in a build for it. */
int gnc_fuzz_assert(int condition);
int gnc_fuzz_assert(int condition)
{
    if (failing && one_in(1000)) {
        ++failed_assertions;
        return 0;
    }
    return condition;
}

/* Any number at all. */
static real wild(void)
{
    const real zero = 0;
    switch (draw() % 12) {
    case 0: return zero / zero;
    case 1: return 1 / zero;
    case 2: return -1 / zero;
    case 3: return LARGEST;
    case 4: return -LARGEST;
    case 5: return SMALLEST;
    case 6: return -SMALLEST;
    case 7: return -zero;
    case 8: return (real)1e20;
    case 9: return (real)-1e-20;
    case 10: return SAFE;
    default: return between(-1, 1);
    }
}

static void fail(const char *what, long step)
{
    printf("step %ld: %s\n", step, what);
    exit(1);
}

/* ---- problems ----------------------------------------------------------------------------------- */

typedef struct {
    NAME(problem) problem;
    NAME(data) data;
    NAME(workspace) work;
    int32_t ready; /* the set-up accepted the problem */
    int modest;    /* its numbers are far from overflow */
    int damaged;
    real unit;     /* size of commands that the actuators can follow */
} flight_t;

static real *some_number(NAME(problem) *p)
{
    switch (draw() % 8) {
    case 0: return &p->A0[draw() % R][draw() % N];
    case 1: return P > 0 ? &p->E[draw() % (P > 0 ? P : 1)][draw() % N] : &p->h;
    case 2: return P > 0 ? &p->D[draw() % V][draw() % R][draw() % (P > 0 ? P : 1)] : &p->h;
    case 3: return &p->m1[draw() % N];
    case 4: return &p->m2[draw() % N];
    case 5: return &p->preferred[draw() % N];
    case 6: return &p->h;
    default: return &p->tolerance;
    }
}

static void make_problem(flight_t *f)
{
    NAME(problem) *p = &f->problem;
    int i, a, j, v;
    const int weights = (int)(draw() % 4);
    const real spread = one_in(4) ? 0 : between(0, 0.1);
    memset(p, 0, sizeof *p);
    for (i = 0; i < N; ++i) {
        for (a = 0; a < R; ++a) {
            p->A0[a][i] = one_in(5) ? 0 : between(-1, 1);
        }
        for (j = 0; j < P; ++j) {
            p->E[j][i] = between(-1, 1);
        }
        p->m1[i] = weights == 0 || (weights == 1 && one_in(2)) ? 0 : between(0, 2);
        p->m2[i] = weights == 0 || weights == 2 ? 0 : between(0, 2);
        p->preferred[i] = one_in(3) ? between(0, 1) : 0;
    }
    for (v = 0; v < V && P > 0; ++v) {
        const int copy = v > 0 && one_in(6);
        for (a = 0; a < R; ++a) {
            for (j = 0; j < P; ++j) {
                p->D[v][a][j] = copy ? p->D[v - 1][a][j] : spread * between(-1, 1);
            }
        }
    }
    p->h = (real)(1 + 1e6 * uniform() * uniform());
    p->tolerance = one_in(3) ? (real)1e-6 : 0;
    p->keep_zero_weights = one_in(3);
    if (one_in(4)) {
        *some_number(p) = wild();
    }
}

/* What the header says a problem must be. */
static int problem_is_good(const NAME(problem) *p, int *modest)
{
    int good = p->h > 0 && finite_number(p->h) && p->tolerance >= 0, k;
    const real *number = &p->A0[0][0];
    const int count = (int)((sizeof *p - sizeof p->keep_zero_weights) / sizeof(real));
    *modest = p->h < SAFE && p->h > 1 / SAFE;
    for (k = 0; k < N; ++k) {
        good = good && p->m1[k] >= 0 && p->m2[k] >= 0;
    }
    for (k = 0; k < count; ++k) { /* the tolerance, which may be infinite, is the last */
        if (&number[k] >= &p->h) {
            break;
        }
        good = good && finite_number(number[k]);
        *modest = *modest && number[k] <= (real)1e3 && number[k] >= (real)-1e3;
    }
    return good;
}

static void new_flight(flight_t *f, long step)
{
    int32_t status;
    int good;
    make_problem(f);
    status = NAME(setup)(&f->data, one_in(200) ? NULL : &f->problem);
    good = problem_is_good(&f->problem, &f->modest);
    if (status == GNC_ALLOC_OPTIMAL && !good) {
        fail("a bad problem was accepted", step);
    }
    if (f->data.ready == 0 && status == GNC_ALLOC_OPTIMAL) {
        fail("accepted, but not ready", step);
    }
    f->ready = status == GNC_ALLOC_OPTIMAL;
    f->damaged = 0;
    f->unit = between(0.01, 3);
    if (one_in(2)) {
        NAME(reset)(&f->work);
    }
}

/* ---- steps -------------------------------------------------------------------------------------- */

typedef struct {
    real torque[R], previous[N], lower[N], upper[N], max_step[N];
    int with_previous, with_step, modest, good;
} command_t;

static void make_command(command_t *c, const flight_t *f)
{
    int i, k;
    const int dead = one_in(6), bad = one_in(8), drift = one_in(2);
    c->with_previous = !one_in(3);
    c->with_step = one_in(3);
    for (i = 0; i < R; ++i) {
        c->torque[i] = drift ? c->torque[i] + f->unit * between(-0.02, 0.02) : f->unit * between(-1, 1);
        c->torque[i] = finite_number(c->torque[i]) && !one_in(50) ? c->torque[i] : 0;
    }
    for (i = 0; i < N; ++i) {
        c->lower[i] = one_in(20) ? between(-1, 0.5) : 0;
        c->upper[i] = dead && one_in(3) ? c->lower[i] : c->lower[i] + between(0, 2);
        c->previous[i] = one_in(20) ? between(-2, 3) : between(0, 1);
        c->max_step[i] = one_in(10) ? 0 : between(0, 0.5);
    }
    for (k = 0; bad && k < 1 + (int)(draw() % 3); ++k) {
        real *const columns[5] = {c->previous, c->lower, c->upper, c->max_step, c->torque};
        const uint64_t which = draw() % 5;
        columns[which][draw() % (which == 4 ? R : N)] = wild();
    }
}

/* Does the header promise an answer to this command, and is it far from overflow? */
static void judge(command_t *c, const real *previous)
{
    int i;
    c->good = 1;
    c->modest = 1;
    for (i = 0; i < R; ++i) {
        c->good = c->good && finite_number(c->torque[i]);
        c->modest = c->modest && c->torque[i] < (real)1e3 && c->torque[i] > (real)-1e3;
    }
    for (i = 0; i < N; ++i) {
        c->good = c->good && finite_number(c->lower[i]) && finite_number(c->upper[i]) && finite_number(previous[i]);
        c->good = c->good && c->lower[i] <= c->upper[i] && (!c->with_step || c->max_step[i] >= 0);
        c->modest = c->modest && c->lower[i] > (real)-1e3 && c->upper[i] < (real)1e3;
        c->modest = c->modest && previous[i] < (real)1e3 && previous[i] > (real)-1e3;
    }
}

static void check_answer(const flight_t *f, const command_t *c, const NAME(result) *r, int32_t status, long step)
{
    int i;
    if (status != r->status || status < 0 || status > GNC_ALLOC_BAD_PROBLEM) {
        fail("no such status", step);
    }
    for (i = 0; i < N; ++i) {
        const real force = r->force[i];
        if (!finite_number(force)) {
            fail("a force that is not finite", step);
        }
        if (c->lower[i] <= c->upper[i] && ((finite_number(c->lower[i]) && force < c->lower[i]) ||
                                           (finite_number(c->upper[i]) && force > c->upper[i]))) {
            fail("a force out of its box", step);
        }
        if (f->work.answer[i] != force) {
            fail("the answer was not remembered", step);
        }
    }
    if (r->active_set_iterations + r->interior_point_iterations > MOST_ITERATIONS) {
        fail("too many iterations", step);
    }
    if (failing || f->damaged) {
        return;
    }
    if ((status == GNC_ALLOC_BAD_PROBLEM) != !f->ready) {
        fail("the status hides or invents a bad problem", step);
    }
    if (f->ready && !c->good && status != GNC_ALLOC_BAD_COMMAND) {
        fail("a bad command was not called so", step);
    }
    if (f->ready && c->good && c->modest && f->modest && status > GNC_ALLOC_NOT_CERTIFIED) {
        fail("a good command was refused", step);
    }
}

/* A certificate that was given must be true: from a fresh start nothing better is found. */
static void check_certificate(const flight_t *f, const command_t *c, const real *previous, const NAME(result) *r,
                              long step)
{
    NAME(workspace) fresh;
    NAME(result) other;
    double slack;
    NAME(reset)(&fresh);
    (void)NAME(solve_interior_point)(&fresh, &f->data, c->torque, previous, c->lower, c->upper,
                                     c->with_step ? c->max_step : NULL, &other);
    slack = (double)r->gap + TOLERANCE * (double)other.objective + ROUNDING * (double)f->problem.h;
    if (other.status <= GNC_ALLOC_NOT_CERTIFIED && (double)r->objective > (double)other.objective + slack) {
        fail("a certificate that is not true", step);
    }
}

static void flip_bit(void *memory, size_t size)
{
    ((unsigned char *)memory)[draw() % size] ^= (unsigned char)(1u << draw() % 8);
}

static void one_step(flight_t *f, command_t *c, long step)
{
    NAME(result) result;
    real previous[N];
    int32_t status;
    const int no_upper = one_in(5000), no_result = one_in(5000);
    make_command(c, f);
    memcpy(previous, c->with_previous ? c->previous : f->work.answer, sizeof previous);
    judge(c, previous);
    memset(&result, 0xff, sizeof result);
    status = (one_in(10) ? NAME(solve_interior_point) : NAME(solve))(
        &f->work, &f->data, c->torque, c->with_previous ? c->previous : NULL, c->lower,
        no_upper ? NULL : c->upper, c->with_step ? c->max_step : NULL, no_result ? NULL : &result);
    if (no_result) {
        if (status != GNC_ALLOC_BAD_COMMAND) {
            fail("an absent result was not noticed", step);
        }
        return;
    }
    if (failing && (result.status == -1 || result.force[0] == 0)) {
        return; /* as if the result or another array were absent */
    }
    if (no_upper) {
        if (status != GNC_ALLOC_BAD_COMMAND || result.status != status || result.force[N - 1] != 0) {
            fail("an absent array was not noticed", step);
        }
        return;
    }
    check_answer(f, c, &result, status, step);
    ++counts[status];
    if (status <= GNC_ALLOC_AT_ROUNDING && f->modest && c->modest && one_in(20) && !failing && f->damaged < 2) {
        check_certificate(f, c, previous, &result, step);
        ++rechecked;
    }
}

int main(int argc, char **argv)
{
    static flight_t f;
    static command_t c;
    const long steps = argc > 1 ? atol(argv[1]) : 10000;
    const int damage = argc > 3 && atoi(argv[3]);
    long k;
    state = argc > 2 ? (uint64_t)atol(argv[2]) * 2654435761u + 88172645463325252u : 1;
    failing = argc > 4 && atoi(argv[4]);
    for (k = 0; k < steps; ++k) {
        if (k == 0 || one_in(200)) {
            new_flight(&f, k);
        }
        if (damage && one_in(20)) {
            flip_bit(&f.work, sizeof f.work);
            f.damaged = f.damaged > 1 ? 2 : 1;
        }
        if (damage && one_in(2000)) {
            flip_bit(&f.data, sizeof f.data);
            f.damaged = 2;
        }
        one_step(&f, &c, k);
    }
    printf("%ld steps: optimal %ld, at rounding %ld, not certified %ld, bad command %ld, bad problem %ld; "
           "%ld certificates checked, %ld assertions made to fail\n",
           steps, counts[0], counts[1], counts[2], counts[3], counts[4], rechecked, failed_assertions);
    return 0;
}
