/* SPDX-License-Identifier: MIT-0
 *
 * allocator_counts.c - run commands through the online allocator on an emulated board and write for each the
 * instructions of the call and how it ended, warm as well as from a reset workspace. Not flight code.
 *
 * problem.bin: A0, E, D, m1, m2, preferred, h as doubles. commands.bin: a row of u, previous, lower, upper each.
 */
#include "gnc_allocate.h"
#include "target.h"

#define NAME(word) GNC_ALLOC_NAME(word)
typedef NAME(real) real;
enum { N = GNC_ALLOC_N, R = GNC_ALLOC_R, WIDTH = R + 3 * N };

__asm__(".section .rodata\n.balign 8\nproblem: .incbin \"problem.bin\"\n.balign 8\ncommands: .incbin \"commands.bin\"\n"
        "commands_end:\n.text");
extern const double problem[], commands[][WIDTH], commands_end[];

typedef struct {
    uint32_t instructions;
    int32_t active_set, interior_point, status;
    double relative_gap;
    double force[N];
} row;

static NAME(workspace) warm, cold;
static NAME(data) data;
static NAME(problem) given;
static int32_t (*volatile solve)(NAME(workspace) *, const NAME(data) *, const real *, const real *, const real *,
                                 const real *, const real *, NAME(result) *) = NAME(solve);

static const double *take(real *to, int count, const double *from)
{
    int i;
    for (i = 0; i < count; i++) to[i] = (real)from[i];
    return from + count;
}

static void call(int file, NAME(workspace) *work, const double *command)
{
    static NAME(result) result;
    real u[R], previous[N], lower[N], upper[N];
    uint64_t before;
    row out;
    int i;
    command = take(u, R, command);
    command = take(previous, N, command);
    command = take(lower, N, command);
    (void)take(upper, N, command);
    before = target_instructions();
    (void)solve(work, &data, u, previous, lower, upper, 0, &result);
    out.instructions = (uint32_t)(target_instructions() - before);
    out.active_set = result.active_set_iterations;
    out.interior_point = result.interior_point_iterations;
    out.status = result.status;
    out.relative_gap = (double)result.relative_gap;
    for (i = 0; i < N; i++) out.force[i] = (double)result.force[i];
    target_write(file, &out, sizeof out);
}

int main(void)
{
    const int file = target_open("counts.bin");
    const double *from = problem;
    int k, count = (int)(commands_end - &commands[0][0]) / WIDTH;
    from = take(&given.A0[0][0], R * N, from);
    from = take(&given.E[0][0], GNC_ALLOC_P * N, from);
    from = take(&given.D[0][0][0], GNC_ALLOC_P * R * GNC_ALLOC_V, from);
    from = take(given.m1, N, from);
    from = take(given.m2, N, from);
    from = take(given.preferred, N, from);
    (void)take(&given.h, 1, from);
    if (NAME(setup)(&data, &given) != 0) return 5;
    NAME(reset)(&warm);
    for (k = 0; k < count; k++) {
        NAME(reset)(&cold);
        call(file, &cold, commands[k]);
        call(file, &warm, commands[k]);
    }
    return 0;
}
