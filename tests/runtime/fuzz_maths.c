/* SPDX-License-Identifier: MIT-0
 *
 * fuzz_maths.c - random bit patterns through every elementary function, in both precisions. Not flight code.
 *
 *     fuzz_maths rounds
 *
 * What must hold of every result: within the range of the function, and NaN only where Annex F of C99 says so.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "gnc_math.h"

static uint64_t state = 88172645463325252u;

static uint64_t draw(void)
{
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return state * UINT64_C(0x2545f4914f6cdd1d);
}

static void must(int holds, const char *what, double x, double y, double result)
{
    if (!holds) {
        printf("%s: x = %a, y = %a, result %a\n", what, x, y, result);
        exit(1);
    }
}

/* Any bit pattern, or one of the numbers where functions change their ways. */
static double any_double(void)
{
    static const double special[] = {0,      -0.0,   1,         -1,       2,        0.5,     HUGE_VAL, -HUGE_VAL,
                                     0x1p52, 0x1p53, 0x1p-1022, 0x1p1023, 0x1p-1074, -0x1p30, 710,      -746,
                                     3,      -3,     1e300,     -1e-300,  0x1p30,    0x1p-500, 0x1p-800, 41};
    const uint64_t k = draw();
    if (k % 4 == 0) {
        return special[(k >> 8) % (sizeof special / sizeof *special)];
    }
    if (k % 16 == 1) {
        return gnc_nan_();
    }
    if (k % 4 == 1) {
        return ((double)(draw() >> 11) * 0x1p-53 - 0.5) * 100;
    }
    return gnc_from_bits_(draw());
}

static float any_float(void)
{
    static const float special[] = {0,      -0.0f,   1,         -1,        2,         0.5f,    HUGE_VALF, -HUGE_VALF,
                                    0x1p23f, 0x1p24f, 0x1p-126f, 0x1p127f,  0x1p-149f, 0x1p17f, 89,        -104,
                                    3,       -3,      1e30f,     -1e-30f,   0x1p120f,  0x1p-70f, 0x1p-40f, 22};
    const uint64_t k = draw();
    if (k % 4 == 0) {
        return special[(k >> 8) % (sizeof special / sizeof *special)];
    }
    if (k % 16 == 1) {
        return gnc_nanf_();
    }
    if (k % 4 == 1) {
        return ((float)(draw() >> 40) * 0x1p-24f - 0.5f) * 100;
    }
    return gnc_from_bitsf_((uint32_t)draw());
}

/* One precision: T the type, X the suffix, PI a number that atan2 does not pass. */
#define ROUND(T, X, any, canonical, bits)                                                                          \
    static void one_round##X(void)                                                                                     \
    {                                                                                                              \
        const T x = any(), y = any();                                                                              \
        const int nan_x = x != x, nan_y = y != y, inf_x = x - x != 0 && !nan_x;                                    \
        T r;                                                                                                       \
        CHECK(gnc_exp##X(x), nan_x, r >= 0);                                                                       \
        CHECK(gnc_expm1##X(x), nan_x, r >= -1);                                                                    \
        CHECK(gnc_log##X(x), nan_x || x < 0, x < 1 ? r <= 0 : r >= 0);                                             \
        CHECK(gnc_log1p##X(x), nan_x || x < -1, x < 0 ? r <= 0 : r >= 0);                                          \
        CHECK(gnc_sin##X(x), nan_x || inf_x, r >= -1 && r <= 1);                                                   \
        CHECK(gnc_cos##X(x), nan_x || inf_x, r >= -1 && r <= 1);                                                   \
        CHECK(gnc_tan##X(x), nan_x || inf_x, r - r == 0);                                                          \
        CHECK(gnc_sinh##X(x), nan_x, x < 0 ? r <= x : r >= x);                                                     \
        CHECK(gnc_cosh##X(x), nan_x, r >= 1);                                                                      \
        CHECK(gnc_tanh##X(x), nan_x, r >= -1 && r <= 1);                                                           \
        CHECK(gnc_asin##X(x), nan_x || x < -1 || x > 1, r >= -2 && r <= 2);                                        \
        CHECK(gnc_acos##X(x), nan_x || x < -1 || x > 1, r >= 0 && r <= 4);                                         \
        CHECK(gnc_atan##X(x), nan_x, r >= -2 && r <= 2);                                                           \
        CHECK(gnc_sqrt##X(x), nan_x || x < 0, r >= 0 && (r <= x || r <= 1));                                       \
        CHECK(gnc_atan2##X(x, y), nan_x || nan_y, r >= -4 && r <= 4);                                              \
        CHECK(gnc_fmod##X(x, y), nan_x || nan_y || inf_x || y == 0,                                                \
              gnc_fabs##X(r) <= gnc_fabs##X(x) && (r == 0 || gnc_fabs##X(r) < gnc_fabs##X(y)));                    \
        CHECK(gnc_remainder##X(x, y), nan_x || nan_y || inf_x || y == 0,                                           \
              gnc_fabs##X(r) <= gnc_fabs##X(x) && gnc_fabs##X(r) <= gnc_fabs##X(y) / 2);                           \
        r = gnc_pow##X(x, y);                                                                                      \
        must(r == r || canonical == bits(r), "pow" #X, (double)x, (double)y, (double)r);                           \
        must(r == r || x < 0 || nan_x || nan_y, "pow" #X, (double)x, (double)y, (double)r);                        \
        r = gnc_floor##X(x);                                                                                       \
        must(nan_x ? r != r : r <= x && gnc_floor##X(r) == r, "floor" #X, (double)x, 0, (double)r);                \
        r = gnc_ceil##X(x);                                                                                        \
        must(nan_x ? r != r : r >= x && gnc_ceil##X(r) == r, "ceil" #X, (double)x, 0, (double)r);                  \
        r = gnc_sign##X(x);                                                                                        \
        must(nan_x ? r != r : r * gnc_fabs##X(r) == r, "sign" #X, (double)x, 0, (double)r);                        \
        r = gnc_min##X(x, y);                                                                                      \
        must(nan_x || nan_y ? bits(r) == bits(y) : r <= x && r <= y, "min" #X, (double)x, (double)y, (double)r);   \
        r = gnc_max##X(x, y);                                                                                      \
        must(nan_x || nan_y ? bits(r) == bits(y) : r >= x && r >= y, "max" #X, (double)x, (double)y, (double)r);   \
        r = gnc_copysign##X(x, y);                                                                                 \
        must(bits(gnc_fabs##X(r)) == bits(gnc_fabs##X(x)), "copysign" #X, (double)x, (double)y, (double)r);        \
    }
#define CHECK(call, is_nan, holds)                                                                                 \
    r = call;                                                                                                      \
    must((is_nan) ? bits_of(r) : (holds), #call, (double)x, (double)y, (double)r)

#define bits_of(r) (sizeof(r) == 8 ? gnc_bits_((double)(r)) == UINT64_C(0x7ff8000000000000) : \
                    gnc_bitsf_((float)(r)) == UINT32_C(0x7fc00000))
ROUND(double, , any_double, UINT64_C(0x7ff8000000000000), gnc_bits_)
ROUND(float, f, any_float, UINT32_C(0x7fc00000), gnc_bitsf_)

int main(int argc, char **argv)
{
    const long rounds = argc > 1 ? atol(argv[1]) : 10000;
    long k;
    for (k = 0; k < rounds; ++k) {
        one_round();
        one_roundf();
    }
    printf("%ld arguments of each function and precision under ASan and UBSan\n", rounds);
    return 0;
}
