/* SPDX-License-Identifier: MIT-0
 *
 * daqp_timing.c - run box-constrained quadratic programs through DAQP's C interface and time each. For the
 * benchmark only: compiled with the C sources of DAQP, which are not part of this project.
 */
#define _POSIX_C_SOURCE 199309L
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "api.h"
#include "auxiliary.h"
#include "utils.h"

void daqp_sequence(int size, int count, double *H, double *f, double *lower, double *upper, int cold,
                   int repeats, double primal_tolerance, double *microseconds, double *x);

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return 1e6 * (double)t.tv_sec + 1e-3 * (double)t.tv_nsec;
}

/* One set-up (factorised H), then new f and bounds for each row. Cold: the working set is emptied, outside
 * the clock, before each solve. */
void daqp_sequence(int size, int count, double *H, double *f, double *lower, double *upper, int cold,
                   int repeats, double primal_tolerance, double *microseconds, double *x)
{
    int i, k, j;
    for (i = 0; i < count; ++i) {
        microseconds[i] = 1e30;
    }
    for (k = 0; k < repeats; ++k) {
        DAQPWorkspace work;
        DAQPProblem problem;
        DAQPResult result;
        double setup_time, *multipliers = calloc((size_t)size, sizeof *multipliers);
        int *sense = calloc((size_t)size, sizeof *sense);
        memset(&work, 0, sizeof work);
        memset(&problem, 0, sizeof problem);
        memset(&result, 0, sizeof result);
        problem.n = problem.m = problem.ms = size;
        problem.H = H;
        problem.f = f;
        problem.bupper = upper;
        problem.blower = lower;
        problem.sense = sense;
        result.lam = multipliers;
        setup_daqp(&problem, &work, &setup_time);
        work.settings->primal_tol = primal_tolerance;
        for (i = 0; i < count; ++i) {
            double start, time;
            if (cold) {
                daqp_deactivate_constraints(&work);
                work.n_active = 0;
                work.reuse_ind = 0;
                work.sing_ind = DAQP_EMPTY_IND;
                for (j = 0; j < size; ++j) {
                    work.sense[j] &= ~DAQP_ACTIVE;
                }
            }
            result.x = x + i * size;
            start = now();
            problem.f = f + i * size;
            problem.bupper = upper + i * size;
            problem.blower = lower + i * size;
            daqp_update_ldp(DAQP_UPDATE_v | DAQP_UPDATE_d, &work, &problem);
            daqp_solve(&result, &work);
            time = now() - start;
            microseconds[i] = time < microseconds[i] ? time : microseconds[i];
        }
        free_daqp_workspace(&work);
        free_daqp_ldp(&work);
        free(sense);
        free(multipliers);
    }
}
