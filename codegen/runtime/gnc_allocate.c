/* SPDX-License-Identifier: MIT-0
 *
 * gnc_allocate.c - set-up and the public calls.
 *
 * A call checks the command, lets a solver find F and the vertex weights lambda, and reports the
 * point together with its duality gap (gnc_allocate_point.c), which does not trust the solver.
 */
#include "gnc_allocate_internal.h"

/* ---- set-up ----------------------------------------------------------------------------------- */

static int problem_is_sound(const problem_t *problem)
{
    int i, a, v;
    real sum = 0; /* adding zero times everything: finite exactly if all of it is */
    if (!(problem->h > 0) || !is_finite(problem->h) || !(problem->tolerance >= 0)) {
        return 0;
    }
    for (i = 0; i < N; ++i) {
        if (!(problem->m1[i] >= 0) || !(problem->m2[i] >= 0)) {
            return 0;
        }
        sum += 0 * problem->m1[i] + 0 * problem->m2[i] + 0 * problem->preferred[i];
        for (a = 0; a < R; ++a) {
            sum += 0 * problem->A0[a][i];
        }
        for (a = 0; a < P; ++a) {
            sum += 0 * problem->E[a][i];
        }
    }
    for (v = 0; v < V && P > 0; ++v) {
        for (a = 0; a < R * P; ++a) {
            sum += 0 * problem->D[v][a / P1][a % P1];
        }
    }
    return is_finite(sum);
}

/* Note which vertices repeat an earlier one (flat box, no uncertainty): a copy adds nothing but a
 * singular system. */
static void find_copies(data_t *data)
{
    int v, w;
    for (v = 0; v < V; ++v) {
        for (w = 0; w < v && P > 0 && memcmp(data->Dv[v], data->Dv[w], sizeof data->Dv[v]) != 0; ++w) {
        }
        data->original[v] = w;
        data->distinct += w == v;
    }
}

/* FNV-1a hash, continued over some numbers. */
static uint32_t hash_more(uint32_t hash, const real *numbers, size_t size)
{
    size_t k;
    for (k = 0; k < size; ++k) {
        hash = (hash ^ ((const unsigned char *)numbers)[k]) * 16777619U;
    }
    return hash;
}

int32_t NAME(setup)(data_t *data, const problem_t *problem)
{
    int i, k, l, a, j, v, e;
    real weight_sum = 0, size_A0 = 0, least;
    memset(data, 0, sizeof *data);
    if (!problem_is_sound(problem)) {
        return GNC_ALLOC_BAD_PROBLEM;
    }
    data->sqrt_h = SQUARE_ROOT(problem->h);
    data->tolerance = problem->tolerance > 0 ? problem->tolerance : (real)DEFAULT_TOLERANCE;
    for (i = 0; i < N; ++i) {
        for (a = 0; a < R; ++a) {
            data->S[a][i] = data->sqrt_h * problem->A0[a][i];
            size_A0 += data->S[a][i] * data->S[a][i];
        }
        for (j = 0; j < P; ++j) {
            data->S[R + j][i] = data->sqrt_h * problem->E[j][i];
        }
        for (k = 0; k < K; ++k) {
            data->St[i][k] = data->S[k][i];
        }
        for (k = 0, e = 0; k < K; ++k) {
            for (l = 0; l <= k; ++l, ++e) {
                data->SS[i][e] = data->S[k][i] * data->S[l][i];
            }
        }
        weight_sum += problem->m1[i] + problem->m2[i];
    }
    /* Without any weight the forces are not unique; 1e-9 of the torque term's curvature makes them so. */
    data->regularised = weight_sum <= 0 && !problem->keep_zero_weights;
    for (i = 0; i < N; ++i) {
        data->m1[i] = data->regularised ? (real)1e-9 * size_A0 : problem->m1[i];
        data->m2[i] = problem->m2[i];
        data->preferred[i] = problem->preferred[i];
        data->q[i] = data->m1[i] + data->m2[i];
        data->inv_q[i] = data->q[i] > 0 ? 1 / data->q[i] : 0;
        /* Zero or vanishing weights: a Newton step needs some curvature to be well defined. Adding it
         * to the step, not to the problem, makes the iteration a proximal-point method. */
        least = (data->q[i] > 0 ? (real)CURVATURE_FLOOR : 100 * (real)CURVATURE_FLOOR) * size_A0;
        data->curvature[i] = larger(data->q[i], larger(least, TINY));
        data->inv_curvature[i] = 1 / data->curvature[i];
    }
    for (v = 0; v < V && P > 0; ++v) {
        for (a = 0; a < R; ++a) {
            for (j = 0; j < P; ++j) {
                data->D[a][j][v] = data->Dv[v][a][j] = problem->D[v][a][j] + 0; /* -0 becomes 0 */
            }
        }
        for (j = 0, e = 0; j < P; ++j) {
            for (l = 0; l <= j; ++l, ++e) {
                for (a = 0; a < R; ++a) {
                    data->DD[v][e] += data->D[a][j][v] * data->D[a][l][v];
                }
            }
        }
    }
    find_copies(data);
    data->inv_sqrt_h = 1 / data->sqrt_h;
    data->stamp = hash_more(2166136261U, &data->S[0][0], sizeof data->S);
    data->stamp = hash_more(data->stamp, data->q, sizeof data->q);
    data->stamp = hash_more(data->stamp, &data->Dv[0][0][0], sizeof data->Dv) | 1U; /* never 0 */
    data->ready = 1;
    return GNC_ALLOC_OPTIMAL;
}

/* ---- the command ------------------------------------------------------------------------------ */

/* Build the effective box and the linear terms; return 0 if the command cannot be used. */
static int read_command(command_t *command, const data_t *data, const real *torque,
                        const real *previous, const real *lower, const real *upper,
                        const real *max_step)
{
    int i, a, sound = data->ready;
    for (a = 0; a < R; ++a) {
        sound = sound && is_finite(torque[a]);
        command->b[a] = data->sqrt_h * torque[a];
    }
    for (i = 0; i < N; ++i) {
        real low = lower[i], high = upper[i];
        sound = sound && is_finite(low) && is_finite(high) && low <= high;
        sound = sound && is_finite(previous[i]);
        if (max_step) {
            sound = sound && max_step[i] >= 0;
            low = smaller(larger(lower[i], previous[i] - max_step[i]), upper[i]);
            high = larger(smaller(upper[i], previous[i] + max_step[i]), lower[i]);
        }
        command->lower[i] = low;
        command->upper[i] = high;
        command->previous[i] = previous[i];
        command->dead[i] = high - low <= 8 * EPS * larger(size_of(low), size_of(high)) + TINY;
        command->c[i] = -(data->m1[i] * data->preferred[i] + data->m2[i] * previous[i]);
    }
    return sound;
}

/* ---- the answer ------------------------------------------------------------------------------- */

static void report(const data_t *data, const command_t *command, const real *lower,
                   const real *upper, const workspace_t *work, const point_t *point, result_t *result)
{
    int i, a, v;
    for (i = 0; i < N; ++i) {
        const real force = work->force[i];
        const real near = (real)1e-6 * (command->upper[i] - command->lower[i]);
        int32_t code = GNC_ALLOC_FREE;
        if (command->dead[i]) {
            code = GNC_ALLOC_STUCK;
        } else if (force - command->lower[i] <= near) {
            code = command->lower[i] > lower[i] ? GNC_ALLOC_LOWER_RATE : GNC_ALLOC_LOWER_AMPLITUDE;
        } else if (command->upper[i] - force <= near) {
            code = command->upper[i] < upper[i] ? GNC_ALLOC_UPPER_RATE : GNC_ALLOC_UPPER_AMPLITUDE;
        }
        result->force[i] = force;
        result->saturation[i] = code;
    }
    result->worst_vertex = 0;
    for (v = 0; v < V; ++v) {
        result->lambda[v] = work->lambda[v];
        if (point->q[v] > point->q[result->worst_vertex]) {
            result->worst_vertex = v;
        }
    }
    for (a = 0; a < R; ++a) {
        result->unallocated[a] = (command->b[a] - point->y[a]) * data->inv_sqrt_h;
    }
    result->worst_error = SQUARE_ROOT(2 * point->worst) * data->inv_sqrt_h;
    result->objective = 2 * point->phi;
    result->gap = 2 * point->gap;
    result->relative_gap = point->gap > 0 ? point->gap / larger(point->phi, TINY) : 0;
}

/* A command that cannot be used: hold the last forces, as far as the box allows. */
static int32_t hold(workspace_t *work, const data_t *data, const real *previous, const real *lower,
                    const real *upper, result_t *result)
{
    int i;
    memset(result, 0, sizeof *result);
    for (i = 0; i < N; ++i) {
        real force = is_finite(previous[i]) ? previous[i] : work->answer[i];
        if (lower[i] <= upper[i]) {
            force = larger(force, is_finite(lower[i]) ? lower[i] : force);
            force = smaller(force, is_finite(upper[i]) ? upper[i] : force);
        }
        result->force[i] = force;
        work->answer[i] = force;
    }
    result->status = data->ready ? GNC_ALLOC_BAD_COMMAND : GNC_ALLOC_BAD_PROBLEM;
    return result->status;
}

static int32_t solve_by(int fast, workspace_t *work, const data_t *data, const real *torque,
                        const real *previous, const real *lower, const real *upper,
                        const real *max_step, result_t *result)
{
    command_t command;
    point_t point;
    int certified = 0;
    const real *held = previous ? previous : work->answer;
    result->active_set_iterations = 0;
    result->interior_point_iterations = 0;
    if (!read_command(&command, data, torque, held, lower, upper, max_step)) {
        return hold(work, data, held, lower, upper, result);
    }
    /* With next to no weight on F the path is too badly conditioned to follow among vertices. */
    fast = fast && (!data->regularised || data->distinct == 1);
    if (fast) {
        result->path = GNC_ALLOC_PATH_ACTIVE_SET;
        certified = NAME(active_set)(work, data, &command, &point,
                                     &result->active_set_iterations);
    }
    if (!certified) {
        result->path = GNC_ALLOC_PATH_INTERIOR_POINT;
        command.floor = NAME(floor_of)(data, &command);
        certified = NAME(interior_point)(work, data, &command, &point,
                                         &result->interior_point_iterations);
    }
    if (!certified && fast) { /* degenerate: let the active set finish what the interior began */
        int32_t more = 0;
        real force[N], lambda[V];
        memcpy(force, work->force, sizeof force);
        memcpy(lambda, work->lambda, sizeof lambda);
        certified = NAME(active_set)(work, data, &command, &point, &more);
        result->active_set_iterations += more;
        if (!certified) {
            memcpy(work->force, force, sizeof force);
            memcpy(work->lambda, lambda, sizeof lambda);
            work->warm = 0;
            NAME(evaluate)(data, &command, work->force, work->lambda, &point);
        }
    }
    if (!is_finite(point.phi) || !is_finite(point.gap)) { /* overflow: numbers too large */
        NAME(reset)(work);
        return hold(work, data, held, lower, upper, result);
    }
    report(data, &command, lower, upper, work, &point, result);
    memcpy(work->answer, result->force, sizeof work->answer);
    result->status = is_optimal(data, &point) ? GNC_ALLOC_OPTIMAL
                     : certified              ? GNC_ALLOC_AT_ROUNDING
                                              : GNC_ALLOC_NOT_CERTIFIED;
    return result->status;
}

/* ---- public calls ----------------------------------------------------------------------------- */

void NAME(reset)(workspace_t *work) { memset(work, 0, sizeof *work); }

int32_t NAME(solve)(workspace_t *work, const data_t *data, const real *torque, const real *previous,
                    const real *lower, const real *upper, const real *max_step, result_t *result)
{
    return solve_by(1, work, data, torque, previous, lower, upper, max_step, result);
}

int32_t NAME(solve_interior_point)(workspace_t *work, const data_t *data, const real *torque,
                                   const real *previous, const real *lower, const real *upper,
                                   const real *max_step, result_t *result)
{
    return solve_by(0, work, data, torque, previous, lower, upper, max_step, result);
}

const char *NAME(status_text)(int32_t status)
{
    switch (status) {
    case GNC_ALLOC_OPTIMAL:
        return "Optimal: the duality gap is within the tolerance.";
    case GNC_ALLOC_AT_ROUNDING:
        return "Optimal up to rounding: the duality gap reached what the number type can resolve.";
    case GNC_ALLOC_NOT_CERTIFIED:
        return "Iteration limit reached: the forces are feasible, their duality gap is reported.";
    case GNC_ALLOC_BAD_COMMAND:
        return "The command is not finite or its box is empty: the last feasible forces are held.";
    case GNC_ALLOC_BAD_PROBLEM:
        return "The problem was refused: weights must be >= 0, h > 0, and every number finite.";
    default:
        return "Unknown status.";
    }
}
