/* SPDX-License-Identifier: MIT-0
 *
 * gnc_allocate.h - robust control allocation on board, with a proof of optimality in every answer.
 *
 * Which thruster or wheel does what, when the geometry is only known within a box?
 *
 *     minimise    f(F) = (F-Fs)'M1(F-Fs) + (F-Fp)'M2(F-Fp) + h max_v |u - (A0 + D_v E) F|^2
 *     subject to  lo <= F <= hi
 *
 *     symbol  name here   shape    unit              meaning
 *     F       force       N        N (or rad/s^2)    actuator commands
 *     u       torque      R        N m               wanted effort: torque, or torque and force
 *     A0      A0          R x N    m (effort per F)  nominal effectiveness
 *     E       E           P x N    1                 what the error multiplies, e.g. thrust directions
 *     D_v     D           V: RxP   m                 vertices of the error set, e.g. -[R_CB dr_v]x
 *     M1, M2  m1, m2      N        1/N^2             weights (diagonal, >= 0) on effort and on change
 *     h       h           -        1/(N m)^2         weight on the worst torque error, > 0
 *     Fs, Fp  preferred, previous  N  N              preferred forces; forces of the last sample
 *
 * The torque error is convex in the uncertain geometry, so the vertices of the error set are enough
 * (Huang, Biggs, Duan 2020, doi:10.1016/j.ast.2019.105572, eqs 58-69). V = 1, P = 0 is the plain
 * box-constrained quadratic program of control allocation.
 *
 * Sizes and names are fixed by macros before the header is included, and the sources are compiled
 * with the same macros:
 *
 *     GNC_ALLOC_N       actuators, 1..64             GNC_ALLOC_R  rows of A0, 1..6
 *     GNC_ALLOC_P       rows of E, 0..8              GNC_ALLOC_V  vertices, 1..64
 *     GNC_ALLOC_REAL_FLOAT   defined: float, else double
 *     GNC_ALLOC_PREFIX  prefix of every symbol; two solvers in one program differ in it
 *
 * What is certified: gap <= tolerance * f (1e-8; float: 1e-5), status OPTIMAL; or gap <= 1e-6 f (float: 1e-4),
 * status AT_ROUNDING, as is a gap below 2e-16 (float: 4e-14) of the size of f over the box. Where rounding of the
 * residuals hides so small a gap (f tiny against that size), they are summed with twice the digits, in float always.
 * If M1 = M2 = 0 the forces are not unique and the set-up
 * adds M1 = 1e-9 h |A0|_F^2 I (float: 1e-5), which is part of f and of its certificate; up to 1e-5 f (float: 1e-3)
 * counts as rounding then. Single zero weights are allowed and nothing is added; in float a third of these is not certified.
 *
 * The header may be included again with other sizes and another prefix. No heap, no globals, no
 * recursion, every loop is bounded; all state lies in the caller's structs, so calls on different
 * workspaces may run at the same time.
 *
 * Assertions never stop the processor. One that fails (memory was damaged, or numbers overflowed) makes the
 * call give up that way and, where no other is left, hold the last forces with status BAD_COMMAND. Define
 * GNC_ASSERT(condition) when compiling the sources to be told; it must return the truth of the condition.
 */
#ifndef GNC_ALLOCATE_ONCE
#define GNC_ALLOCATE_ONCE

#include <stdint.h>

#define GNC_ALLOC_PASTE(prefix, word) prefix##_##word
#define GNC_ALLOC_JOIN(prefix, word) GNC_ALLOC_PASTE(prefix, word)
#define GNC_ALLOC_NAME(word) GNC_ALLOC_JOIN(GNC_ALLOC_PREFIX, word)
#define GNC_ALLOC_AT_LEAST_1(size) ((size) > 0 ? (size) : 1)
#define GNC_ALLOC_TRIANGLE(size) ((size) * ((size) + 1) / 2)

/* How a call ended. <prefix>_status_text() gives the sentence for each. */
enum gnc_alloc_status {
    GNC_ALLOC_OPTIMAL = 0,       /* gap <= tolerance * objective */
    GNC_ALLOC_AT_ROUNDING = 1,   /* gap <= 1e-6 objective (float: 1e-4), or below its last digit; usable */
    GNC_ALLOC_NOT_CERTIFIED = 2, /* iteration limit: feasible, its gap is reported */
    GNC_ALLOC_BAD_COMMAND = 3,   /* not finite, too large, lo > hi, absent: last feasible answer returned */
    GNC_ALLOC_BAD_PROBLEM = 4    /* set-up refused: weights, h, numbers that are not finite, a build with fused operations */
};

/* Which method produced the answer. */
enum gnc_alloc_path {
    GNC_ALLOC_PATH_NONE = 0,          /* bad command: nothing was solved */
    GNC_ALLOC_PATH_ACTIVE_SET = 1,    /* homotopy from the previous answer */
    GNC_ALLOC_PATH_INTERIOR_POINT = 2 /* the base method */
};

/* Saturation of one actuator. Amplitude and rate are told apart when max_step is given. */
enum gnc_alloc_saturation {
    GNC_ALLOC_FREE = 0,
    GNC_ALLOC_LOWER_AMPLITUDE = 1,
    GNC_ALLOC_UPPER_AMPLITUDE = 2,
    GNC_ALLOC_LOWER_RATE = 3,
    GNC_ALLOC_UPPER_RATE = 4,
    GNC_ALLOC_STUCK = 5 /* lo = hi: dead, stuck or switched off */
};
#endif /* GNC_ALLOCATE_ONCE */

#ifndef GNC_ALLOC_PREFIX
#define GNC_ALLOC_PREFIX gnc_alloc
#endif
#if !defined(GNC_ALLOC_N) || !defined(GNC_ALLOC_R) || !defined(GNC_ALLOC_P) || !defined(GNC_ALLOC_V)
#error "define GNC_ALLOC_N, GNC_ALLOC_R, GNC_ALLOC_P and GNC_ALLOC_V before including gnc_allocate.h"
#endif
#if GNC_ALLOC_N < 1 || GNC_ALLOC_N > 64 || GNC_ALLOC_R < 1 || GNC_ALLOC_R > 6 || GNC_ALLOC_P < 0 || \
    GNC_ALLOC_P > 8 || GNC_ALLOC_V < 1 || GNC_ALLOC_V > 64
#error "sizes out of range: N 1..64, R 1..6, P 0..8, V 1..64"
#endif
#if GNC_ALLOC_P == 0 && GNC_ALLOC_V != 1
#error "P = 0 means no uncertainty: V must be 1"
#endif

#undef GNC_ALLOC_K
#define GNC_ALLOC_K (GNC_ALLOC_R + GNC_ALLOC_P)

#ifdef __cplusplus
extern "C" {
#endif

#ifdef GNC_ALLOC_REAL_FLOAT
typedef float GNC_ALLOC_NAME(real);
#else
typedef double GNC_ALLOC_NAME(real);
#endif

/* A bit for each actuator. */
#if GNC_ALLOC_N > 32
typedef uint64_t GNC_ALLOC_NAME(set);
#else
typedef uint32_t GNC_ALLOC_NAME(set);
#endif

/* The problem as the user states it; the set-up reads it once. */
typedef struct {
    GNC_ALLOC_NAME(real) A0[GNC_ALLOC_R][GNC_ALLOC_N];
    GNC_ALLOC_NAME(real) E[GNC_ALLOC_AT_LEAST_1(GNC_ALLOC_P)][GNC_ALLOC_N];
    GNC_ALLOC_NAME(real) D[GNC_ALLOC_V][GNC_ALLOC_R][GNC_ALLOC_AT_LEAST_1(GNC_ALLOC_P)];
    GNC_ALLOC_NAME(real) m1[GNC_ALLOC_N];        /* >= 0 */
    GNC_ALLOC_NAME(real) m2[GNC_ALLOC_N];        /* >= 0 */
    GNC_ALLOC_NAME(real) preferred[GNC_ALLOC_N]; /* Fs, often 0 */
    GNC_ALLOC_NAME(real) h;                      /* > 0 */
    GNC_ALLOC_NAME(real) tolerance;              /* relative gap; 0: 1e-8 (double), 1e-5 (float) */
    int32_t keep_zero_weights;                   /* 0: if M1 = M2 = 0, then M1 = 1e-9 h |A0|_F^2 (float: 1e-5) */
} GNC_ALLOC_NAME(problem);

/* Everything that does not change from sample to sample. Constant after the set-up, may be shared. */
typedef struct {
    GNC_ALLOC_NAME(real) S[GNC_ALLOC_K][GNC_ALLOC_N];  /* sqrt(h) [A0; E] */
    GNC_ALLOC_NAME(real) St[GNC_ALLOC_N][GNC_ALLOC_K]; /* its transpose */
    /* lower triangles of s_i s_i', s_i a column of S */
    GNC_ALLOC_NAME(real) SS[GNC_ALLOC_N][GNC_ALLOC_TRIANGLE(GNC_ALLOC_K)];
    /* D_v with the vertex as last index, and as first; lower triangles of D_v'D_v */
    GNC_ALLOC_NAME(real) D[GNC_ALLOC_R][GNC_ALLOC_AT_LEAST_1(GNC_ALLOC_P)][GNC_ALLOC_V];
    GNC_ALLOC_NAME(real) Dv[GNC_ALLOC_V][GNC_ALLOC_R][GNC_ALLOC_AT_LEAST_1(GNC_ALLOC_P)];
    GNC_ALLOC_NAME(real) DD[GNC_ALLOC_V][GNC_ALLOC_AT_LEAST_1(GNC_ALLOC_TRIANGLE(GNC_ALLOC_P))];
    GNC_ALLOC_NAME(real) column[GNC_ALLOC_N]; /* squares of the columns of sqrt(h) A0 */
    GNC_ALLOC_NAME(real) m1[GNC_ALLOC_N], m2[GNC_ALLOC_N], preferred[GNC_ALLOC_N];
    GNC_ALLOC_NAME(real) q[GNC_ALLOC_N], inv_q[GNC_ALLOC_N]; /* m1 + m2, its inverse or 0 */
    /* curvature of Newton steps, max(q, a little), and its inverse */
    GNC_ALLOC_NAME(real) curvature[GNC_ALLOC_N], inv_curvature[GNC_ALLOC_N];
    GNC_ALLOC_NAME(real) sqrt_h, inv_sqrt_h, tolerance;
    GNC_ALLOC_NAME(real) scale; /* of the objective: h / sqrt_h^2 */
    int32_t original[GNC_ALLOC_V]; /* first vertex with the same D: v itself, or the one it copies */
    int32_t distinct;              /* number of vertices that are no copies */
    int32_t regularised;           /* 1: M1 = M2 = 0 was given and M1 was added */
    uint32_t stamp;                /* hash of the matrices: kept factors belong to one stamp */
    int32_t ready;                 /* set by a successful set-up */
} GNC_ALLOC_NAME(data);

/* State between calls, owned by the caller: <prefix>_reset before the first call. A workspace may be
 * used with other data (new mass properties): it is a starting point, answers are certified anew. */
typedef struct {
    GNC_ALLOC_NAME(real) answer[GNC_ALLOC_N]; /* forces of the last call, whatever its status */
    /* the last solved sample */
    GNC_ALLOC_NAME(real) force[GNC_ALLOC_N];
    GNC_ALLOC_NAME(real) bound[GNC_ALLOC_N];  /* multipliers of the bounds, signed as the gradient */
    GNC_ALLOC_NAME(real) lambda[GNC_ALLOC_V]; /* vertex weights */
    GNC_ALLOC_NAME(real) slack[GNC_ALLOC_V];  /* how far each inactive vertex is below the worst */
    int8_t side[GNC_ALLOC_N];                 /* -1 at lower, +1 at upper, 0 free */
    int8_t active[GNC_ALLOC_V];               /* 1: vertex is in the active set */
    int32_t warm;                             /* 1: there is such a sample */
    /* its command sqrt(h) u, and the changes from the sample before: a slew goes on as it went */
    GNC_ALLOC_NAME(real) command[GNC_ALLOC_R], command_change[GNC_ALLOC_R];
    GNC_ALLOC_NAME(real) force_change[GNC_ALLOC_N], lambda_change[GNC_ALLOC_V];
    int32_t smooth;                           /* 1: the sets stayed the same over that change */
    /* factors of the last Newton system; they hold while the set of free actuators does */
    GNC_ALLOC_NAME(real) L[GNC_ALLOC_K][GNC_ALLOC_K], W[GNC_ALLOC_K][GNC_ALLOC_K];
    GNC_ALLOC_NAME(real) C[GNC_ALLOC_K][GNC_ALLOC_K], inv_L[GNC_ALLOC_K], inv_C[GNC_ALLOC_K];
    GNC_ALLOC_NAME(real) T[GNC_ALLOC_K][GNC_ALLOC_K], Tt[GNC_ALLOC_K][GNC_ALLOC_K];
    GNC_ALLOC_NAME(real) lambda_W[GNC_ALLOC_V]; /* vertex weights that made W and T */
    GNC_ALLOC_NAME(set) free_set;               /* bit i: actuator i was free */
    uint32_t stamp;                             /* of the data they belong to, 0: none */
} GNC_ALLOC_NAME(workspace);

/* The answer. */
typedef struct {
    GNC_ALLOC_NAME(real) force[GNC_ALLOC_N];        /* lo <= F <= hi, always */
    /* f(F), and f(F) - min f <= gap, rigorous; with the M1 that is added where M1 = M2 = 0 */
    GNC_ALLOC_NAME(real) objective;
    GNC_ALLOC_NAME(real) gap;
    GNC_ALLOC_NAME(real) relative_gap;              /* gap / f(F); 0 when both are 0 */
    GNC_ALLOC_NAME(real) lambda[GNC_ALLOC_V];       /* weight of each vertex; sums to 1 */
    GNC_ALLOC_NAME(real) unallocated[GNC_ALLOC_R];  /* u - A0 F, N m */
    GNC_ALLOC_NAME(real) worst_error;               /* max_v |u - (A0 + D_v E) F|, N m */
    int32_t worst_vertex;                           /* the v that attains it */
    int32_t saturation[GNC_ALLOC_N];                /* enum gnc_alloc_saturation */
    int32_t active_set_iterations;
    int32_t interior_point_iterations;
    int32_t path;                                   /* enum gnc_alloc_path */
    int32_t status;                                 /* enum gnc_alloc_status */
} GNC_ALLOC_NAME(result);

/* Precompute what stays constant. Return GNC_ALLOC_OPTIMAL or GNC_ALLOC_BAD_PROBLEM. */
int32_t GNC_ALLOC_NAME(setup)(GNC_ALLOC_NAME(data) * data, const GNC_ALLOC_NAME(problem) * problem);

/* Forget the previous answer: the next solve is a cold start. */
void GNC_ALLOC_NAME(reset)(GNC_ALLOC_NAME(workspace) * workspace);

/* Allocate one command; return the status, which is also result->status.
 *
 *   torque    R      N m   wanted effort u
 *   previous  N      N     forces of the last sample Fp; null: the last answer of this workspace
 *   lower     N      N     amplitude box, lower <= upper; equal: the actuator is stuck there
 *   upper     N      N
 *   max_step  N      N     largest change in one sample (rate limit times sample time, >= 0), or
 *                          null. If the rate box misses the amplitude box, the amplitude box wins.
 *
 * Whatever the input, the call returns within a bounded number of operations with finite forces, which
 * are within those bounds that are finite and in order. Where an array is absent (a null pointer) nothing
 * is known and the forces are zero; without a result nothing is written. */
int32_t GNC_ALLOC_NAME(solve)(GNC_ALLOC_NAME(workspace) * workspace,
                              const GNC_ALLOC_NAME(data) * data,
                              const GNC_ALLOC_NAME(real) * torque,
                              const GNC_ALLOC_NAME(real) * previous,
                              const GNC_ALLOC_NAME(real) * lower,
                              const GNC_ALLOC_NAME(real) * upper,
                              const GNC_ALLOC_NAME(real) * max_step,
                              GNC_ALLOC_NAME(result) * result);

/* The same by the interior point alone: the base method, for comparison and for audits. */
int32_t GNC_ALLOC_NAME(solve_interior_point)(GNC_ALLOC_NAME(workspace) * workspace,
                                             const GNC_ALLOC_NAME(data) * data,
                                             const GNC_ALLOC_NAME(real) * torque,
                                             const GNC_ALLOC_NAME(real) * previous,
                                             const GNC_ALLOC_NAME(real) * lower,
                                             const GNC_ALLOC_NAME(real) * upper,
                                             const GNC_ALLOC_NAME(real) * max_step,
                                             GNC_ALLOC_NAME(result) * result);

/* The sentence that belongs to a status. */
const char *GNC_ALLOC_NAME(status_text)(int32_t status);

#ifdef __cplusplus
}
#endif
