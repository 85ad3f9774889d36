/* SPDX-License-Identifier: MIT-0
 *
 * allocator_timing.c - run a sequence of commands through the online allocator inside a C loop, and time
 * every call. Compiled together with the solver by the tests and the benchmark; not flight code.
 */
#define _POSIX_C_SOURCE 199309L
#include <stddef.h>
#include <time.h>

#include "gnc_allocate.h"

#define NAME(word) GNC_ALLOC_NAME(word)
typedef NAME(real) real;

enum { WARM = 0, COLD = 1, INTERIOR_POINT = 2 };

size_t NAME(size)(int which);
void NAME(sequence)(const NAME(data) * data, int count, const real *torque, const real *previous,
                    const real *lower, const real *upper, const real *max_step, int mode, int repeats,
                    double *microseconds, NAME(result) * results);

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return 1e6 * (double)t.tv_sec + 1e-3 * (double)t.tv_nsec;
}

/* Sizes of the structs: data, workspace, result, problem. */
size_t NAME(size)(int which)
{
    return which == 0   ? sizeof(NAME(data))
           : which == 1 ? sizeof(NAME(workspace))
           : which == 2 ? sizeof(NAME(result))
                        : sizeof(NAME(problem));
}

/* Arrays have one row per command; max_step may be null. Time: the least of the repeats of each call. */
void NAME(sequence)(const NAME(data) * data, int count, const real *torque, const real *previous,
                    const real *lower, const real *upper, const real *max_step, int mode, int repeats,
                    double *microseconds, NAME(result) * results)
{
    NAME(workspace) work;
    NAME(result) result;
    int i, k;
    for (i = 0; i < count; ++i) {
        microseconds[i] = 1e30;
    }
    for (k = 0; k < repeats; ++k) {
        NAME(reset)(&work);
        for (i = 0; i < count; ++i) {
            const real *u = torque + i * GNC_ALLOC_R, *Fp = previous + i * GNC_ALLOC_N;
            const real *lo = lower + i * GNC_ALLOC_N, *hi = upper + i * GNC_ALLOC_N;
            const real *step = max_step ? max_step + i * GNC_ALLOC_N : NULL;
            double start, time;
            if (mode != WARM) {
                NAME(reset)(&work);
            }
            start = now();
            if (mode == INTERIOR_POINT) {
                NAME(solve_interior_point)(&work, data, u, Fp, lo, hi, step, &result);
            } else {
                NAME(solve)(&work, data, u, Fp, lo, hi, step, &result);
            }
            time = now() - start;
            microseconds[i] = time < microseconds[i] ? time : microseconds[i];
            results[i] = result;
        }
    }
}
