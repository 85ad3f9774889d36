/* SPDX-License-Identifier: MIT-0
 *
 * gnc_allocate_internal.h - what the source files of the allocator share. Not for users.
 *
 * Inside, everything is in the half objective  phi(F) = f(F)/2  and in the residuals
 *
 *     y = S F = sqrt(h) [A0; E] F = (tau, p)          K = R + P numbers, whatever N is
 *     r_v = tau + D_v p - sqrt(h) u                   error of vertex v
 *     q_v = |r_v|^2 / 2
 *     z_v = [r_v; D_v' r_v]                           gradient of q_v with respect to y
 *
 * so that  phi = sum_i (q_i F_i^2/2 + c_i F_i) + max_v q_v + const,  q = m1 + m2, c = -(m1 Fs + m2 Fp).
 * All curvature besides the diagonal q lies in y.
 */
#ifndef GNC_ALLOCATE_INTERNAL_H
#define GNC_ALLOCATE_INTERNAL_H

#include <string.h>
#if !defined(__GNUC__)
#include <math.h> /* sqrt, which gcc and clang know without a header */
#endif

#ifndef GNC_ALLOC_DECLARED /* defined by a unit that has included it and goes on with the source files themselves */
#include "gnc_allocate.h"
#endif
#include "gnc_arithmetic.h"

#if !defined(GNC_ALLOC_REAL_FLOAT)
/* -fsingle-precision-constant defines no macro: it makes the size of this array negative. */
typedef char gnc_alloc_constants_must_be_doubles_[(sizeof(1.0) == sizeof(double)) ? 1 : -1];
/* Some compilers for small processors make a double a float. */
typedef char gnc_alloc_doubles_must_have_64_bits_[(sizeof(double) == sizeof(uint64_t)) ? 1 : -1];
#endif

enum {
    N = GNC_ALLOC_N,                        /* actuators */
    R = GNC_ALLOC_R,                        /* rows of the effort */
    P = GNC_ALLOC_P,                        /* rows of the uncertain part */
    V = GNC_ALLOC_V,                        /* vertices */
    K = GNC_ALLOC_K,                        /* rows of S */
    KT = GNC_ALLOC_TRIANGLE(GNC_ALLOC_K),   /* entries of a lower triangle, packed by rows */
    PT = GNC_ALLOC_TRIANGLE(GNC_ALLOC_P),
    A = K + 2,                              /* more active vertices are always dependent */
    READY = 0x5EA1,                         /* mark of data that the set-up has filled */
    NOTHING = -1,                           /* no obstacle; else actuator i is i and vertex v is N + v */
    WARM_WORK = 5, /* from the last answer: a step costs one, with an obstacle two, short of half way all */
    COLD_WORK = 1000 /* no limit but that of rounds */
};

#define NAME(word) GNC_ALLOC_NAME(word)
typedef NAME(real) real;
typedef NAME(problem) problem_t;
typedef NAME(data) data_t;
typedef NAME(workspace) workspace_t;
typedef NAME(result) result_t;

/* What must hold where it stands. Never stops the processor: 1 or 0, and beside it what happens if not, so that
 * in the end the call holds its last forces and says so. A project may define it to note file and line as well. */
#ifndef GNC_ASSERT
#define GNC_ASSERT(condition) ((condition) ? 1 : 0)
#endif

#if defined(__GNUC__) && defined(GNC_ALLOC_REAL_FLOAT)
#define SQUARE_ROOT(a) __builtin_sqrtf(a)
#elif defined(__GNUC__)
#define SQUARE_ROOT(a) __builtin_sqrt(a)
#elif defined(GNC_ALLOC_REAL_FLOAT)
#define SQUARE_ROOT(a) sqrtf(a)
#else
#define SQUARE_ROOT(a) sqrt(a)
#endif

#ifdef GNC_ALLOC_REAL_FLOAT
#define ARITHMETIC_FAULTS() gnc_arithmetic_faultsf()
#define EPS 1.1920929e-7F /* distance from 1 to the next number */
#define TINY 1e-30F
#define DEFAULT_TOLERANCE 1e-5F
#define CAREFUL_FROM_THE_START 1
#define ROUNDING_FLOOR 1e-12F
#define CURVATURE_FLOOR 1e-6F
#define NO_CURVATURE_FLOOR 1e-4F
#define CLOSE 1e-4F
#define CLOSE_REGULARISED 1e-3F
#define ADDED_WEIGHT 1e-5F
#define SPLITTER 4097.0F
#else
#define ARITHMETIC_FAULTS() gnc_arithmetic_faults()
#define EPS 2.220446049250313e-16
#define TINY 1e-200
#define DEFAULT_TOLERANCE 1e-8
#define CAREFUL_FROM_THE_START 0
#define ROUNDING_FLOOR 5e-15  /* gap, of the size of phi over the box, that rounding explains */
#define CLOSE 1e-6            /* gap, of phi, up to which an answer at the rounding floor is left at that */
#define CLOSE_REGULARISED 1e-5 /* the same where M1 was added */
#define ADDED_WEIGHT 1e-9      /* the M1 that is, of the torque term's curvature */
#define SPLITTER 134217729.0  /* 2^27 + 1: cuts a number into two halves */
#define CURVATURE_FLOOR 1e-12 /* least curvature of a Newton step, of that of the torque error in one force */
#define NO_CURVATURE_FLOOR 1e-8 /* the same where there are no weights */
#endif
#define LAST_DIGIT 0.04 /* of the gap that rounding explains: 2e-16 of the size over the box, float 4e-14 */
#define OFF_SIMPLEX (64 * (real)(int)V * EPS) /* of the sum of the vertex weights: more is no rounding */

/* Before inner loops of few rounds: without their counters a small processor does a third less. The order of sums,
 * and so their words, stay the same. Where there are vectors, compilers do better by themselves. */
#if defined(__GNUC__) && !defined(__clang__) && !defined(__SSE2__)
#define UNROLLED _Pragma("GCC unroll 8")
#else
#define UNROLLED
#endif

/* min, max and size as comparisons: fmin and fmax differ between compilers on signed zeros. */
static inline real smaller(real a, real b) { return a < b ? a : b; }
static inline real larger(real a, real b) { return a > b ? a : b; }
static inline real size_of(real a) { return a < 0 ? -a : a; }
static inline int is_finite(real a) { return a - a == 0; }
static inline int is_within(int value, int least, int most) { return value < least ? 0 : value <= most; }

/* One checked command: what the solvers work on. */
typedef struct {
    real b[R];     /* sqrt(h) u */
    real c[N];     /* linear weight */
    real previous[N];
    real lower[N], upper[N];
    int8_t dead[N]; /* 1: no room to move */
    real floor;     /* gap that rounding explains, set by the interior point */
    int careful;    /* 1: residuals with twice the digits */
} command_t;

/* Everything about one point F with vertex weights lambda. */
typedef struct {
    real y[K];
    real r[R][V];
    real q[V];
    real worst; /* max_v q_v */
    real g[N];  /* gradient of the lambda-weighted function */
    real phi;   /* half objective */
    real gap;   /* phi - min phi <= gap */
} point_t;

/* The active vertices, the heaviest first, and their part of a Newton system. */
typedef struct {
    int count, list[A];
    real z[A][K];           /* gradients of q_v with respect to y */
    real J[A][K];           /* T z; from the second row on, less the first row */
    real G[A][A], inv_G[A]; /* unit factor and inverse pivots of the products of rows 1.. of J */
} vertices_t;

/* Where a full Newton step leads. */
typedef struct {
    real force[N], bound[N], lambda[V], slack[V];
} goal_t;

/* The sets of the last sample. */
typedef struct {
    int8_t side[N], active[V];
    int known; /* 0: there is none */
} last_t;

/* The interior point: its unknowns, the factors at one iterate, a direction, and what to aim at. */
typedef struct {
    real down[N], up[N];   /* room: F - lo, hi - F */
    real zl[N], zu[N];     /* multipliers of the box */
    real lambda[V], s[V];  /* vertex weights, and slack t - q_v */
    real t;
    real mu;               /* mean of all products multiplier * room */
    int astray;            /* 1: the last step was short */
} iterate_t;

/* Triangular factors keep the inverse of their diagonal; for the letters see interior_step.c. */
typedef struct {
    real invd[N]; /* 0 for dead actuators: they do not move */
    real (*W)[K], (*L)[K], (*C)[K], *inv_L, *inv_C; /* those of the workspace */
    real z[K][V], J[K][V];
    real U[V][V], inv_U[V];   /* U'U = B, upper triangle */
    real B1[V], sum_B1;       /* B^-1 (1,...,1)' and its sum */
} factors_t;

/* Before a direction is computed zl, zu and lambda are what the products zl*(F-lo), zu*(hi-F), lambda*s should become,
 * and bend the second-order loss of s that is counted with. */
typedef struct {
    real F[N], zl[N], zu[N], lambda[V], t;
    real rise[V], bend[V]; /* s(a) = s + a rise - a^2 bend along the step */
} direction_t;

static inline int is_optimal(const data_t *data, const point_t *point)
{
    return point->gap <= data->tolerance * point->phi;
}

/* Functions that return int without a word about it return 1, or 0 where an assertion failed: rounding,
 * overflow or damaged memory have spoilt the numbers, and the caller gives up the way it was going. */

/* gnc_allocate_point.c */
void NAME(residuals)(const data_t *data, const command_t *command, const real *force, point_t *point);
void NAME(evaluate)(const data_t *data, const command_t *command, const real *force,
                    const real *lambda, point_t *point);
real NAME(floor_of)(const data_t *data, const command_t *command);
int NAME(curvature_in_y)(const data_t *data, const real *lambda, real (*W)[K]);
void NAME(inner_matrix)(real (*L)[K], real (*W)[K], real (*C)[K]);
int NAME(factor)(real (*matrix)[K], real *inverse, real lost);
int NAME(factor_forces)(real (*L)[K], real *inverse, const data_t *data, const real *weight, real lost);

/* gnc_allocate_direction.c */
int NAME(refresh_factors)(workspace_t *work, const data_t *data, int always);
int NAME(factor_vertices)(vertices_t *vert, workspace_t *work, const data_t *data, const point_t *point);
int NAME(newton_goal)(goal_t *goal, const vertices_t *vert, workspace_t *work, const data_t *data,
                      const command_t *command, const point_t *point);

/* gnc_allocate_interior_step.c */
int NAME(interior_factors)(factors_t *fac, const data_t *data, const command_t *command,
                           const iterate_t *it, const point_t *point);
int NAME(interior_direction)(direction_t *dir, factors_t *fac, const data_t *data, const iterate_t *it,
                             const point_t *point);

/* gnc_allocate_exchange.c: make dependent vertices fewer by one, or free an actuator; return what was dropped. */
int NAME(exchange)(workspace_t *work, const vertices_t *vert, const data_t *data,
                   const command_t *command, point_t *point, int last, int newcomer);
void NAME(change_set)(workspace_t *work, int which, int upwards);

/* gnc_allocate_obstacle.c: the first obstacle on the way to the goal, and going there or up to it. */
int NAME(first_obstacle)(real *clear, const goal_t *goal, const workspace_t *work, const data_t *data,
                         const command_t *command, const point_t *point);
void NAME(move)(workspace_t *work, const goal_t *goal, const command_t *command, real clear, int full);
void NAME(open_up)(workspace_t *work, const command_t *command, const point_t *point);
void NAME(normalise)(real *lambda);

/* gnc_allocate_cold_start.c */
void NAME(start_cold)(workspace_t *work, const data_t *data, const command_t *command);
int NAME(block_steps)(workspace_t *work, const data_t *data, const command_t *command, point_t *point, int most,
                      int *arrived);

/* gnc_allocate_prediction.c */
void NAME(predict)(workspace_t *work, last_t *last, const command_t *command);
void NAME(remember)(workspace_t *work, const last_t *last);

/* gnc_allocate_interior_point.c, gnc_allocate_active_set.c: the point belongs to the answer in the workspace. The
 * former begins in the middle of the box or near the forces of the workspace, leaves the best of its iterates and
 * switches the command to careful where it must; the latter, from the last
 * answer or from none, return 1 if theirs is certified, or as far as rounding lets it be, and add up iterations. */
void NAME(interior_point)(workspace_t *work, const data_t *data, command_t *command, point_t *point,
                          int near, int32_t *iterations);
int NAME(is_there)(const workspace_t *work, const data_t *data, const command_t *command, const point_t *point,
                   real last_gap);
int NAME(from_last)(workspace_t *work, const data_t *data, const command_t *command, point_t *point,
                    int32_t *iterations);
int NAME(from_cold)(workspace_t *work, const data_t *data, const command_t *command, point_t *point,
                    int32_t *iterations);

/* ---- small dense algebra: lower triangles, inverse diagonals ---------------------------------- */

/* x <- 0, without a call of the library where K is small */
static inline void set_zero(real *x)
{
    int k;
    UNROLLED
    for (k = 0; k < K; ++k) {
        x[k] = 0;
    }
}

/* x <- L^-1 x */
static inline void forward(real (*L)[K], const real *inverse, real *x)
{
    int i, k;
    for (i = 0; i < K; ++i) {
        for (k = 0; k < i; ++k) {
            x[i] -= L[i][k] * x[k];
        }
        x[i] *= inverse[i];
    }
}

/* x <- L^-T x */
static inline void backward(real (*L)[K], const real *inverse, real *x)
{
    int i, k;
    for (i = K - 1; i >= 0; --i) {
        x[i] *= inverse[i];
        for (k = 0; k < i; ++k) {
            x[k] -= L[i][k] * x[i];
        }
    }
}

#endif
