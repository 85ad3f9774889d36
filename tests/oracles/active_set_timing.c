/* SPDX-License-Identifier: MIT-0
 *
 * active_set_timing.c - run weighted least squares in a box through ActiveSetCtlAlloc's C interface and time each.
 * For the benchmark only: compiled with that program's C sources, which are not part of this project.
 */
#define _POSIX_C_SOURCE 199309L
#include <string.h>
#include <time.h>

#include "solveActiveSet.h"

void active_set_sequence(int algorithm, int count, double *matrix, double *efforts, double *pulled,
                         double *lower, double *upper, double accuracy, double effort, int cold, int repeats,
                         double *microseconds, double *x, int *iterations, int *status);

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return 1e6 * (double)t.tv_sec + 1e-3 * (double)t.tv_nsec;
}

/* |matrix x - b|, matrix (N + R, N) column by column, b = (accuracy efforts, effort pulled) made within the clock;
 * efforts (count, R), pulled, lower, upper, x (count, N). Cold: from the middle of the box, none at a bound. */
void active_set_sequence(int algorithm, int count, double *matrix, double *efforts, double *pulled,
                         double *lower, double *upper, double accuracy, double effort, int cold, int repeats,
                         double *microseconds, double *x, int *iterations, int *status)
{
    activeSetAlgo solve = solveActiveSet((activeSetAlgoChoice)algorithm);
    int i, j, k;
    for (i = 0; i < count; ++i) {
        microseconds[i] = 1e30;
    }
    for (k = 0; k < repeats; ++k) {
        double point[AS_N_U] = {0.0}, b[AS_N_C], start, time;
        int8_t working[AS_N_U] = {0};
        for (i = 0; i < count; ++i) {
            const double *low = lower + i * AS_N_U, *high = upper + i * AS_N_U;
            int free_ones = 0;
            if (cold) {
                memset(working, 0, sizeof working);
                for (j = 0; j < AS_N_U; ++j) {
                    point[j] = 0.5 * (low[j] + high[j]);
                }
            }
            start = now();
            for (j = 0; j < AS_N_V; ++j) {
                b[j] = accuracy * efforts[i * AS_N_V + j];
            }
            for (j = 0; j < AS_N_U; ++j) {
                b[AS_N_V + j] = effort * pulled[i * AS_N_U + j];
            }
            status[i] = (int)solve(matrix, b, low, high, point, working, 100, AS_N_U, AS_N_V, &iterations[i],
                                   &free_ones, NULL);
            time = now() - start;
            microseconds[i] = time < microseconds[i] ? time : microseconds[i];
            memcpy(x + i * AS_N_U, point, sizeof point);
        }
    }
}
