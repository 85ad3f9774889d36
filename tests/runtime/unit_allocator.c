/* SPDX-License-Identifier: MIT-0
 *
 * unit_allocator.c - what chance would take long to find: absent arrays, every status, chosen damage. Not flight code.
 */
#include <stdio.h>
#include <string.h>

#include "gnc_allocate.h"

#define NAME(word) GNC_ALLOC_NAME(word)
typedef NAME(real) real;

enum { N = GNC_ALLOC_N, R = GNC_ALLOC_R, P = GNC_ALLOC_P, V = GNC_ALLOC_V };

static int failures;

static long until_failure = -1; /* assertions until one is made to fail, or none */

int gnc_fuzz_assert(int condition);
int gnc_fuzz_assert(int condition)
{
    const int fails = until_failure == 0;
    until_failure -= until_failure >= 0;
    return fails ? 0 : condition;
}

static void must(int holds, const char *what)
{
    if (!holds) {
        printf("%s\n", what);
        ++failures;
    }
}

static NAME(problem) problem;
static NAME(data) data;
static NAME(workspace) work;
static NAME(result) result;
static real torque[R], zero[N], ones[N];

static void prepare(void)
{
    int i, a, j, v;
    memset(&problem, 0, sizeof problem);
    for (i = 0; i < N; ++i) {
        for (a = 0; a < R; ++a) {
            problem.A0[a][i] = (real)((i * 7 + a * 3) % 5 - 2);
        }
        for (j = 0; j < P; ++j) {
            problem.E[j][i] = (real)((i * 3 + j) % 4 - 1);
        }
        problem.m1[i] = 1;
        ones[i] = 1;
    }
    for (v = 0; v < V && P > 0; ++v) {
        for (a = 0; a < R; ++a) {
            for (j = 0; j < P; ++j) {
                problem.D[v][a][j] = (real)0.01 * (real)((v + a * 2 + j) % 3 - 1) * (real)(v + 1);
            }
        }
    }
    problem.h = 1000;
    for (a = 0; a < R; ++a) {
        torque[a] = (real)0.5;
    }
    must(NAME(setup)(&data, &problem) == GNC_ALLOC_OPTIMAL, "the problem is refused");
    NAME(reset)(&work);
}

static int32_t solve(void) { return NAME(solve)(&work, &data, torque, zero, zero, ones, NULL, &result); }

static void absent_arrays(void)
{
    const int32_t bad = GNC_ALLOC_BAD_COMMAND;
    NAME(reset)(NULL);
    must(NAME(setup)(NULL, &problem) == GNC_ALLOC_BAD_PROBLEM, "set-up without data");
    must(NAME(setup)(&data, NULL) == GNC_ALLOC_BAD_PROBLEM && data.ready == 0, "set-up without a problem");
    must(solve() == GNC_ALLOC_BAD_PROBLEM, "a solve without a set-up");
    prepare();
    must(NAME(solve)(NULL, &data, torque, zero, zero, ones, NULL, &result) == bad, "no workspace");
    must(NAME(solve)(&work, NULL, torque, zero, zero, ones, NULL, &result) == bad, "no data");
    must(NAME(solve)(&work, &data, NULL, zero, zero, ones, NULL, &result) == bad, "no torque");
    must(NAME(solve)(&work, &data, torque, zero, NULL, ones, NULL, &result) == bad, "no lower bounds");
    must(NAME(solve)(&work, &data, torque, zero, zero, NULL, NULL, &result) == bad, "no upper bounds");
    must(NAME(solve)(&work, &data, torque, zero, zero, ones, NULL, NULL) == bad, "no result");
    must(result.status == bad && result.force[0] == 0, "something is fired");
    must(NAME(solve)(&work, &data, torque, NULL, zero, ones, NULL, &result) <= 1, "previous forces may be absent");
}

static void every_status_has_a_sentence(void)
{
    int k, l;
    for (k = -1; k <= GNC_ALLOC_BAD_PROBLEM + 1; ++k) {
        for (l = k + 1; l <= GNC_ALLOC_BAD_PROBLEM; ++l) {
            must(strcmp(NAME(status_text)(k), NAME(status_text)(l)) != 0, "two statuses share a sentence");
        }
    }
}

/* What the workspace or the data say must not be believed. */
static void damage(void)
{
    real objective;
    prepare();
    must(solve() <= 1, "a plain command");
    objective = result.objective;
    work.lambda[0] -= 2;
    must(solve() <= 1 && result.objective <= (real)1.001 * objective, "a negative weight of a vertex");
    work.lambda[V - 1] += (real)0.5;
    must(solve() <= 1 && result.objective <= (real)1.001 * objective, "weights of the vertices off the simplex");
    memset(work.lambda, 0, sizeof work.lambda);
    must(solve() <= 1 && result.objective <= (real)1.001 * objective, "no weight on any vertex");
    work.force[N - 1] = 50;
    must(solve() <= 1 && result.objective <= (real)1.001 * objective, "a force far outside");
    memset(&work, 0xff, sizeof work);
    must(solve() <= 1 && result.objective <= (real)1.001 * objective, "a workspace full of ones");
    data.original[0] = -1;
    NAME(reset)(&work);
    (void)NAME(solve_interior_point)(&work, &data, torque, zero, zero, ones, NULL, &result);
    data.original[0] = V + 1000000;
    (void)NAME(solve_interior_point)(&work, &data, torque, zero, zero, ones, NULL, &result);
    must(result.force[0] >= 0 && result.force[0] <= 1, "out of the box");
    data.original[0] = 0;
    data.distinct = 0;
    NAME(reset)(&work);
    must(solve() <= 1 && result.objective <= (real)1.001 * objective, "no distinct vertex");
}

/* Overflow inside: the forces are held, and the next call is sound again. */
static void overflow(void)
{
    int i, a;
    prepare();
    must(solve() <= 1, "a plain command");
    for (a = 0; a < R; ++a) {
        torque[a] = sizeof(real) == 4 ? (real)1e38 : (real)1e300;
    }
    must(NAME(solve)(&work, &data, torque, NULL, zero, ones, NULL, &result) == GNC_ALLOC_BAD_COMMAND, "overflow");
    for (i = 0; i < N; ++i) {
        must(result.force[i] == work.answer[i] && result.force[i] >= 0 && result.force[i] <= 1, "not held");
    }
    prepare();
    must(solve() <= 1, "no recovery");
}

/* Every assertion on a flight from the set-up on fails once: the forces stay in the box, or are none. */
static void failing_assertions(void)
{
    long k, evaluated = 1;
    int i, step;
    for (k = 0; evaluated; ++k) {
        prepare();
        until_failure = k;
        (void)NAME(setup)(&data, &problem);
        for (step = 0; step < 4; ++step) {
            torque[0] = (real)0.5 - (real)0.7 * (real)step;
            result.status = -1;
            if (step == 3) {
                (void)NAME(solve_interior_point)(&work, &data, torque, zero, zero, ones, NULL, &result);
            } else {
                (void)solve();
            }
            for (i = 0; i < N; ++i) {
                must(result.force[i] >= 0 && result.force[i] <= 1, "a failing assertion leads out of the box");
            }
        }
        evaluated = until_failure < 0;
        until_failure = -1;
    }
    prepare();
    must(solve() <= 1, "no recovery from failing assertions");
    printf("%ld assertions made to fail one by one; ", k - 1);
}

int main(void)
{
    prepare();
    absent_arrays();
    every_status_has_a_sentence();
    damage();
    overflow();
    failing_assertions();
    printf("%d failures\n", failures);
    return failures != 0;
}
