/* SPDX-License-Identifier: MIT-0
 *
 * gnc_allocate.c - the public calls.
 *
 * A call checks the command, lets a solver find F and the vertex weights lambda, and reports the
 * point together with its duality gap (gnc_allocate_point.c), which does not trust the solver.
 */
#include "gnc_allocate_internal.h"

/* ---- the command ------------------------------------------------------------------------------ */

/* Build the effective box and the linear terms; return 0 if the command cannot be used. */
static int read_command(command_t *command, const data_t *data, const real *torque,
                        const real *previous, const real *lower, const real *upper,
                        const real *max_step)
{
    int i, a, sound = 1;
    real sum = 0; /* adding zero times everything: finite exactly if all of it is */
    for (a = 0; a < R; ++a) {
        sum += 0 * torque[a];
        command->b[a] = data->sqrt_h * torque[a];
    }
    for (i = 0; i < N; ++i) {
        real low = lower[i], high = upper[i];
        sound &= GNC_ASSERT(low <= high);
        sum += 0 * low + 0 * high + 0 * previous[i];
        if (max_step != NULL) {
            sound &= GNC_ASSERT(max_step[i] >= 0);
            low = smaller(larger(lower[i], previous[i] - max_step[i]), upper[i]);
            high = larger(smaller(upper[i], previous[i] + max_step[i]), lower[i]);
        }
        command->lower[i] = low;
        command->upper[i] = high;
        command->previous[i] = previous[i];
        command->dead[i] = high - low <= 8 * EPS * larger(size_of(low), size_of(high)) + TINY ? 1 : 0;
        command->c[i] = -(data->m1[i] * data->preferred[i] + data->m2[i] * previous[i]);
    }
    command->careful = CAREFUL_FROM_THE_START;
    sound &= GNC_ASSERT(data->ready == READY);
    return sound & GNC_ASSERT(is_finite(sum));
}

/* ---- the answer ------------------------------------------------------------------------------- */

/* How an actuator stands to its bounds: enum gnc_alloc_saturation. */
static int32_t saturation(const command_t *command, int i, real force, real lower, real upper)
{
    const real near_bound = (real)1e-6 * (command->upper[i] - command->lower[i]);
    int32_t code = GNC_ALLOC_FREE;
    if (command->dead[i] != 0) {
        code = GNC_ALLOC_STUCK;
    } else if (force - command->lower[i] <= near_bound) {
        code = command->lower[i] > lower ? GNC_ALLOC_LOWER_RATE : GNC_ALLOC_LOWER_AMPLITUDE;
    } else if (command->upper[i] - force <= near_bound) {
        code = command->upper[i] < upper ? GNC_ALLOC_UPPER_RATE : GNC_ALLOC_UPPER_AMPLITUDE;
    } else {
        code = GNC_ALLOC_FREE;
    }
    return code;
}

/* Fill in the result; return 0 if the forces are not in the box, which must never leave here. */
static int report(const data_t *data, const command_t *command, const real *lower, const real *upper,
                  const workspace_t *work, const point_t *point, result_t *result)
{
    int i, a, v, sound = GNC_ASSERT(is_finite(point->phi)) && GNC_ASSERT(is_finite(point->gap));
    for (i = 0; i < N; ++i) {
        const real force = work->force[i];
        sound &= GNC_ASSERT(force == larger(lower[i], smaller(upper[i], force)));
        result->force[i] = force;
        result->saturation[i] = saturation(command, i, force, lower[i], upper[i]);
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
    result->objective = 2 * data->scale * point->phi;
    result->gap = 2 * data->scale * point->gap;
    result->relative_gap = point->gap > 0 ? point->gap / larger(point->phi, TINY) : 0;
    return sound;
}

/* A command that cannot be used: hold the last forces, as far as the box allows. */
static int32_t hold(workspace_t *work, const data_t *data, const real *previous, const real *lower,
                    const real *upper, result_t *result)
{
    int i;
    (void)memset(result, 0, sizeof *result);
    for (i = 0; i < N; ++i) {
        real force = is_finite(previous[i]) ? previous[i] : work->answer[i];
        if (!GNC_ASSERT(is_finite(force))) { /* a damaged workspace: nothing is known, so nothing is fired */
            force = 0;
        }
        if (lower[i] <= upper[i]) {
            force = larger(force, is_finite(lower[i]) ? lower[i] : force);
            force = smaller(force, is_finite(upper[i]) ? upper[i] : force);
        }
        result->force[i] = force;
        work->answer[i] = force;
    }
    result->status = data->ready == READY ? GNC_ALLOC_BAD_COMMAND : GNC_ALLOC_BAD_PROBLEM;
    return result->status;
}

/* The next call starts cold, but still knows the forces of this one. */
static void forget(workspace_t *work)
{
    real answer[N];
    (void)memcpy(answer, work->answer, sizeof answer);
    (void)memset(work, 0, sizeof *work);
    (void)memcpy(work->answer, answer, sizeof answer);
}

/* ---- the solvers in turn ---------------------------------------------------------------------- */

/* The active set from the last answer, within its budget, and if that does not arrive as from a reset workspace. */
static int follow_sets(workspace_t *work, const data_t *data, const command_t *command, point_t *point,
                       int32_t *iterations)
{
    last_t last;
    int certified = 0;
    NAME(predict)(work, &last, command);
    *iterations = 0;
    if (work->warm != 0) {
        certified = NAME(from_last)(work, data, command, point, iterations);
    }
    if (!certified) {
        work->stamp = 0;
        certified = NAME(from_cold)(work, data, command, point, iterations);
    }
    NAME(remember)(work, &last);
    return certified;
}

/* Rounding of the residuals may have ended the path above what is called close: then what it found is evaluated with
 * twice the digits. Where that is not good, or the path did not arrive, the interior point goes on near where it ended. */
static void go_on_inside(workspace_t *work, const data_t *data, command_t *command, point_t *point, int found,
                       int32_t *iterations)
{
    real gap = -1;
    if (found != 0) {
        command->careful = 1;
        NAME(evaluate)(data, command, work->force, work->lambda, point);
        gap = point->gap;
    }
    work->smooth = 0; /* what the path found is kept where its changes would be */
    (void)memcpy(work->force_change, work->force, sizeof work->force);
    (void)memcpy(work->lambda_change, work->lambda, sizeof work->lambda);
    if (!(found && is_optimal(data, point))) {
        NAME(interior_point)(work, data, command, point, 1, iterations);
    }
    if (found && !(point->gap <= gap)) {
        (void)memcpy(work->force, work->force_change, sizeof work->force);
        (void)memcpy(work->lambda, work->lambda_change, sizeof work->lambda);
        work->warm = 0;
        NAME(evaluate)(data, command, work->force, work->lambda, point);
    }
}

/* Is the gap so small that the answer is usable? With the added M1 the condition is 1e9: there 1e-5 of the objective can
 * be all that is left. Where the objective next to vanishes no gap is a small part of it: then what counts is the last
 * digit of its size over the box. */
static int is_close(const data_t *data, const command_t *command, const point_t *point)
{
    return point->gap <= (data->regularised != 0 ? (real)CLOSE_REGULARISED : (real)CLOSE) * point->phi ||
           point->gap <= (real)LAST_DIGIT * NAME(floor_of)(data, command);
}

static int32_t solve_by(int fast, workspace_t *work, const data_t *data, const real *torque,
                        const real *previous, const real *lower, const real *upper,
                        const real *max_step, result_t *result)
{
    command_t command;
    point_t point;
    int follow;
    const real *held = previous;
    point.gap = 0; /* nothing has been found */
    point.phi = 0;
    if (!GNC_ASSERT(result != NULL)) {
        return GNC_ALLOC_BAD_COMMAND;
    }
    if (!GNC_ASSERT(work != NULL && data != NULL) || !GNC_ASSERT(torque != NULL && lower != NULL && upper != NULL)) {
        (void)memset(result, 0, sizeof *result);
        result->status = GNC_ALLOC_BAD_COMMAND; /* nothing is known, so nothing is fired */
        return result->status;
    }
    if (held == NULL) {
        held = work->answer;
    }
    result->active_set_iterations = 0;
    result->interior_point_iterations = 0;
    if (!read_command(&command, data, torque, held, lower, upper, max_step)) {
        return hold(work, data, held, lower, upper, result);
    }
    /* With next to no weight on F the path is too badly conditioned to follow among vertices. */
    follow = fast != 0 && (data->regularised == 0 || data->distinct == 1);
    if (follow != 0) {
        result->path = GNC_ALLOC_PATH_ACTIVE_SET;
        const int certified = follow_sets(work, data, &command, &point, &result->active_set_iterations);
        if (!certified || !(point.gap <= (real)CLOSE * point.phi)) {
            result->path = GNC_ALLOC_PATH_INTERIOR_POINT;
            go_on_inside(work, data, &command, &point, certified, &result->interior_point_iterations);
        }
    } else {
        result->path = GNC_ALLOC_PATH_INTERIOR_POINT;
        work->smooth = 0;
        NAME(interior_point)(work, data, &command, &point, 0, &result->interior_point_iterations);
    }
    if (!report(data, &command, lower, upper, work, &point, result)) { /* overflow: numbers too large */
        forget(work);
        return hold(work, data, held, lower, upper, result);
    }
    (void)memcpy(work->answer, result->force, sizeof work->answer);
    result->status = is_optimal(data, &point)           ? GNC_ALLOC_OPTIMAL
                     : is_close(data, &command, &point) ? GNC_ALLOC_AT_ROUNDING
                                                        : GNC_ALLOC_NOT_CERTIFIED;
    return result->status;
}

/* ---- public calls ----------------------------------------------------------------------------- */

void NAME(reset)(workspace_t *work)
{
    if (work != NULL) {
        (void)memset(work, 0, sizeof *work);
    }
}

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
