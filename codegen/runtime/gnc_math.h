/* SPDX-License-Identifier: MIT-0 */
/*
 * Elementary functions with the same bits on every compiler and target.
 *
 * libm differs between machines in the last bits, and most of it cannot be vectorised. The functions
 * here use only + - * / sqrt, comparisons and integer operations on the bit pattern, which IEEE 754
 * rounds in one way only. Nothing loops, and every choice is between two values without side effects, so that a compiler
 * can turn a loop over lanes into vector code. This file holds the double versions (gnc_exp), gnc_mathf.h the
 * float versions (gnc_expf), which never touch double.
 *
 * Build with -std=c99 -ffp-contract=off, rounding to nearest, subnormal numbers on, and link with -lm for sqrt.
 * gcc vectorises only with -fno-math-errno -fno-trapping-math -fopenmp-simd as well, which leave the bits alone:
 * all functions for AVX2 and wider, most for SSE2. Define GNC_INLINE as
 * `static inline __attribute__((always_inline))`, and GNC_LANES as 1, where lanes matter more than code size.
 *
 * "max u ulp" beside a function is the largest error found, in units in the last place of the exact result, rounded
 * up: here over at least eight million arguments in the range stated (random ones, and ones close to the places where
 * such functions go wrong) against a reference of 113 bits, and two million against 140 bits. It is a measurement,
 * not a proof.
 *
 * Special values follow C99 Annex F, except:
 *  - floating-point exception flags and errno have no meaning;
 *  - a NaN result is always the quiet NaN 0x7ff8000000000000 (0x7fc00000); only fabs, floor, ceil,
 *    copysign, sign, min and max hand a NaN argument on unchanged;
 *  - min and max are one comparison, not fmin and fmax: the second argument where either is NaN or where
 *    they are equal (so of zeros with different signs);
 *  - sin, cos, tan: accurate for |x| <= 2^20 (float: 1e4). Further out the phase is off by up to
 *    |x| 2^-52 (|x| 2^-23), and from |x| > 2^30 (2^17) on the argument counts as zero. The result stays
 *    finite, and in [-1, 1] for sin and cos;
 *  - fmod: exact for |x/y| < 2^52 (2^23). Beyond, zero with the sign of x (the exact remainder needs a
 *    loop, and says nothing when neighbours of x differ by more than y); remainder: the same from 2^53
 *    (2^24) on.
 *
 * Words used below: a *pair* is an unevaluated sum hi + lo with |lo| at most half an ulp of hi.
 */
#ifndef GNC_MATH_H
#define GNC_MATH_H

#include <stdint.h>

#include "gnc_mathf.h"

/* -fsingle-precision-constant defines no macro: it makes the size of this array negative. */
typedef char gnc_constants_must_be_doubles_[(sizeof(1.0) == sizeof(double)) ? 1 : -1];
/* Some compilers for small processors make a double a float. */
typedef char gnc_doubles_must_have_64_bits_[(sizeof(double) == sizeof(uint64_t)) ? 1 : -1];

/* ---- Building blocks ------------------------------------------------------------------------------- */

typedef struct {
    double hi, lo;
} gnc_pair_;

/* Adding and subtracting 1.5 * 2^52 rounds to an integer; the sum's low bits are that integer. */
#define GNC_ROUNDER_ 0x1.8p52

GNC_INLINE uint64_t gnc_bits_(double x) {
    uint64_t u;
    (void)GNC_COPY_(&u, &x, sizeof u);
    return u;
}

GNC_INLINE double gnc_from_bits_(uint64_t u) {
    double x;
    (void)GNC_COPY_(&x, &u, sizeof x);
    return x;
}

GNC_INLINE double gnc_nan_(void) { return gnc_from_bits_(UINT64_C(0x7ff8000000000000)); }
GNC_INLINE double gnc_inf_(void) { return gnc_from_bits_(UINT64_C(0x7ff0000000000000)); }

/* 2^k for -1022 <= k <= 1023; k is a two's complement integer, here and below. */
GNC_INLINE double gnc_exp2i_(uint64_t k) { return gnc_from_bits_((k + 1023u) << 52); }

/* m 2^k for |k| < 2000 and m near 1, in two steps since 2^k alone may overflow: the first is exact. */
GNC_INLINE double gnc_scale_(double m, uint64_t k) {
    const uint64_t half = ((k + 4096u) >> 1) - 2048u;
    return (m * gnc_exp2i_(half)) * gnc_exp2i_(k - half);
}

/* a + b as a pair, for |a| >= |b| or a = 0. */
GNC_INLINE gnc_pair_ gnc_sum_sorted_(double a, double b) {
    gnc_pair_ s;
    s.hi = a + b;
    s.lo = (a - s.hi) + b;
    return s;
}

/* a + b as a pair, for any a and b. */
GNC_INLINE gnc_pair_ gnc_sum_(double a, double b) {
    gnc_pair_ s;
    s.hi = a + b;
    const double b_part = s.hi - a;
    s.lo = (a - (s.hi - b_part)) + (b - b_part);
    return s;
}

/* x rounded to 26 bits; x minus it has 26 as well, so products of such halves are exact. */
GNC_INLINE double gnc_head_(double x) {
    return gnc_from_bits_((gnc_bits_(x) + UINT64_C(0x4000000)) & UINT64_C(0xfffffffff8000000));
}

/* The exact value of a b - product, where product is a b rounded (Dekker). */
GNC_INLINE double gnc_product_error_(double a, double b, double product) {
    const double ah = gnc_head_(a), al = a - ah;
    const double bh = gnc_head_(b), bl = b - bh;
    return (((ah * bh - product) + ah * bl) + al * bh) + al * bl;
}

/* x^2 / 2 as a sum whose larger part is exact. */
GNC_INLINE gnc_pair_ gnc_half_square_(double x) {
    const double head = gnc_head_(x);
    gnc_pair_ h;
    h.hi = 0.5 * head * head;
    h.lo = 0.5 * (x - head) * (x + head);
    return h;
}

/* n / d as a pair: the quotient, and its remainder over d. Rounding the sum once makes it good to half an ulp. */
GNC_INLINE gnc_pair_ gnc_quotient_(gnc_pair_ n, gnc_pair_ d) {
    gnc_pair_ q;
    q.hi = n.hi / d.hi;
    const double product = q.hi * d.hi;
    const double error = gnc_product_error_(q.hi, d.hi, product);
    q.lo = (((n.hi - product) - error) + (n.lo - q.hi * d.lo)) / d.hi;
    return q;
}

/* Polynomials are sums of such blocks times powers of x^3: independent work, so less waiting than Horner. */
GNC_INLINE double gnc_poly3_(double x, double c0, double c1, double c2) { return c0 + x * (c1 + x * c2); }

/*
 * A choice between two values: only the chosen one is computed, but both in loops over lanes, whatever is chosen, since
 * a table that is read under a condition would keep compilers from vector code.
 */
#if GNC_LANES
GNC_INLINE double gnc_choose_(int first, double x, double y) {
    const uint64_t mask = first != 0 ? ~UINT64_C(0) : 0u;
    return gnc_from_bits_((gnc_bits_(x) & mask) | (gnc_bits_(y) & ~mask));
}
#define GNC_CHOOSE_(condition, x, y) gnc_choose_((condition) ? 1 : 0, (x), (y))
#else
#define GNC_CHOOSE_(condition, x, y) ((condition) ? (x) : (y))
#endif

/* ---- Exact functions ------------------------------------------------------------------------------- */

#if defined(__GNUC__) /* one instruction */
GNC_INLINE double gnc_fabs(double x) { return __builtin_fabs(x); }
#else
GNC_INLINE double gnc_fabs(double x) { return gnc_from_bits_(gnc_bits_(x) & UINT64_C(0x7fffffffffffffff)); }
#endif

GNC_INLINE double gnc_copysign(double x, double y) {
    const uint64_t sign = UINT64_C(0x8000000000000000);
    return gnc_from_bits_((gnc_bits_(x) & ~sign) | (gnc_bits_(y) & sign));
}

/* 1, -1, or x itself when it is zero or NaN. */
GNC_INLINE double gnc_sign(double x) {
    const double negative = x < 0.0 ? -1.0 : x;
    return x > 0.0 ? 1.0 : negative;
}

/* The smaller and the larger, by one comparison: when it is false (equal, zeros of two signs, a NaN), the second. */
GNC_INLINE double gnc_min(double x, double y) { return x < y ? x : y; }
GNC_INLINE double gnc_max(double x, double y) { return x > y ? x : y; }

/* The IEEE square root: 0.5 ulp. Never asked for a negative number: that NaN differs between processors. */
GNC_INLINE double gnc_sqrt(double x) {
    const double root = GNC_ROOT_(x > 0.0 ? x : 0.0);
    const double keep_zero = x > 0.0 ? root : x;
    return x >= 0.0 ? keep_zero : gnc_nan_();
}

/* An integer next to x, with the sign of x, for |x| < 2^52: adding 2^52 leaves no room for a fraction. */
GNC_INLINE double gnc_near_integer_(double x) { return gnc_copysign((gnc_fabs(x) + 0x1p52) - 0x1p52, x); }

GNC_INLINE double gnc_floor(double x) {
    const double near_x = gnc_near_integer_(x);
    const double down = near_x - (near_x > x ? 1.0 : 0.0);
    return gnc_fabs(x) < 0x1p52 ? gnc_copysign(down, x) : x;
}

GNC_INLINE double gnc_ceil(double x) {
    const double near_x = gnc_near_integer_(x);
    const double up = near_x + (near_x < x ? 1.0 : 0.0);
    return gnc_fabs(x) < 0x1p52 ? gnc_copysign(up, x) : x; /* copysign: ceil(-0.5) is -0 */
}

/*
 * Remainder of x / y with the sign of x, exact for |x/y| < 2^52. With q the integer next to |x/y|, the
 * remainder |x| - q|y| is a double, so the product error gives it exactly; q may be one too large.
 */
GNC_INLINE double gnc_fmod(double x, double y) {
    const double x_raw = gnc_fabs(x), y_raw = gnc_fabs(y);
    const double up = y_raw < 0x1p-500 ? 0x1p300 : 1.0; /* keeps the product error from underflowing */
    const double scale = x_raw > 0x1p1000 ? 0x1p-100 : up;
    const double back = scale > 1.0 ? 0x1p-300 : (scale < 1.0 ? 0x1p100 : 1.0);
    const double a = x_raw * scale, b = y_raw * scale;
    const double ratio = a / b;
    const double q = (ratio + 0x1p52) - 0x1p52;
    const double product = q * b;
    const double rest = (a - product) - gnc_product_error_(q, b, product);
    const double in_range = (rest < 0.0 ? rest + b : rest) * back;
    const double far = ratio < 0x1p52 ? in_range : 0.0;
    const double finite = x_raw < y_raw ? x_raw : far;
    const double checked = x_raw < gnc_inf_() ? gnc_copysign(finite, x) : gnc_nan_();
    const double nonzero = y_raw > 0.0 ? checked : gnc_nan_();
    return x == x ? nonzero : gnc_nan_();
}

/*
 * x less the whole multiple of y next to x, of two as near the even one: what IEEE 754 calls the remainder; exact for
 * |x/y| < 2^53. After fmod by 2 |y| the quotient left is below 2, and its parity is that of the whole one; the
 * differences of neighbours are exact.
 */
GNC_INLINE double gnc_remainder(double x, double y) {
    const double b = gnc_fabs(y);
    const double rest = gnc_fmod(gnc_fabs(x), b + b);
    const double past = rest - b;
    const double beyond = past + past >= b ? past - b : past;
    const double near_x = rest + rest <= b ? rest : beyond;
    const double found = gnc_copysign(1.0, x) * near_x;
    return rest == rest ? found : gnc_nan_();
}

/* ---- Exponentials ---------------------------------------------------------------------------------- */

/* 2^(j/64) as a pair, 0 <= j < 64. */
GNC_INLINE gnc_pair_ gnc_exp_node_(uint64_t j) {
    static const double node[64][2] = {
        {0x1.0p+0, 0x0.0p+0}, {0x1.02c9a3e778061p+0, -0x1.19083535b085dp-56},
        {0x1.059b0d3158574p+0, 0x1.d73e2a475b465p-55}, {0x1.0874518759bc8p+0, 0x1.186be4bb284ffp-57},
        {0x1.0b5586cf9890fp+0, 0x1.8a62e4adc610bp-54}, {0x1.0e3ec32d3d1a2p+0, 0x1.03a1727c57b53p-59},
        {0x1.11301d0125b51p+0, -0x1.6c51039449b3ap-54}, {0x1.1429aaea92dep+0, -0x1.32fbf9af1369ep-54},
        {0x1.172b83c7d517bp+0, -0x1.19041b9d78a76p-55}, {0x1.1a35beb6fcb75p+0, 0x1.e5b4c7b4968e4p-55},
        {0x1.1d4873168b9aap+0, 0x1.e016e00a2643cp-54}, {0x1.2063b88628cd6p+0, 0x1.dc775814a8495p-55},
        {0x1.2387a6e756238p+0, 0x1.9b07eb6c70573p-54}, {0x1.26b4565e27cddp+0, 0x1.2bd339940e9d9p-55},
        {0x1.29e9df51fdee1p+0, 0x1.612e8afad1255p-55}, {0x1.2d285a6e4030bp+0, 0x1.0024754db41d5p-54},
        {0x1.306fe0a31b715p+0, 0x1.6f46ad23182e4p-55}, {0x1.33c08b26416ffp+0, 0x1.32721843659a6p-54},
        {0x1.371a7373aa9cbp+0, -0x1.63aeabf42eae2p-54}, {0x1.3a7db34e59ff7p+0, -0x1.5e436d661f5e3p-56},
        {0x1.3dea64c123422p+0, 0x1.ada0911f09ebcp-55}, {0x1.4160a21f72e2ap+0, -0x1.ef3691c309278p-58},
        {0x1.44e086061892dp+0, 0x1.89b7a04ef80dp-59}, {0x1.486a2b5c13cdp+0, 0x1.3c1a3b69062fp-56},
        {0x1.4bfdad5362a27p+0, 0x1.d4397afec42e2p-56}, {0x1.4f9b2769d2ca7p+0, -0x1.4b309d25957e3p-54},
        {0x1.5342b569d4f82p+0, -0x1.07abe1db13cadp-55}, {0x1.56f4736b527dap+0, 0x1.9bb2c011d93adp-54},
        {0x1.5ab07dd485429p+0, 0x1.6324c054647adp-54}, {0x1.5e76f15ad2148p+0, 0x1.ba6f93080e65ep-54},
        {0x1.6247eb03a5585p+0, -0x1.383c17e40b497p-54}, {0x1.6623882552225p+0, -0x1.bb60987591c34p-54},
        {0x1.6a09e667f3bcdp+0, -0x1.bdd3413b26456p-54}, {0x1.6dfb23c651a2fp+0, -0x1.bbe3a683c88abp-57},
        {0x1.71f75e8ec5f74p+0, -0x1.16e4786887a99p-55}, {0x1.75feb564267c9p+0, -0x1.0245957316dd3p-54},
        {0x1.7a11473eb0187p+0, -0x1.41577ee04992fp-55}, {0x1.7e2f336cf4e62p+0, 0x1.05d02ba15797ep-56},
        {0x1.82589994cce13p+0, -0x1.d4c1dd41532d8p-54}, {0x1.868d99b4492edp+0, -0x1.fc6f89bd4f6bap-54},
        {0x1.8ace5422aa0dbp+0, 0x1.6e9f156864b27p-54}, {0x1.8f1ae99157736p+0, 0x1.5cc13a2e3976cp-55},
        {0x1.93737b0cdc5e5p+0, -0x1.75fc781b57ebcp-57}, {0x1.97d829fde4e5p+0, -0x1.d185b7c1b85d1p-54},
        {0x1.9c49182a3f09p+0, 0x1.c7c46b071f2bep-56}, {0x1.a0c667b5de565p+0, -0x1.359495d1cd533p-54},
        {0x1.a5503b23e255dp+0, -0x1.d2f6edb8d41e1p-54}, {0x1.a9e6b5579fdbfp+0, 0x1.0fac90ef7fd31p-54},
        {0x1.ae89f995ad3adp+0, 0x1.7a1cd345dcc81p-54}, {0x1.b33a2b84f15fbp+0, -0x1.2805e3084d708p-57},
        {0x1.b7f76f2fb5e47p+0, -0x1.5584f7e54ac3bp-56}, {0x1.bcc1e904bc1d2p+0, 0x1.23dd07a2d9e84p-55},
        {0x1.c199bdd85529cp+0, 0x1.11065895048ddp-55}, {0x1.c67f12e57d14bp+0, 0x1.2884dff483cadp-54},
        {0x1.cb720dcef9069p+0, 0x1.503cbd1e949dbp-56}, {0x1.d072d4a07897cp+0, -0x1.cbc3743797a9cp-54},
        {0x1.d5818dcfba487p+0, 0x1.2ed02d75b3707p-55}, {0x1.da9e603db3285p+0, 0x1.c2300696db532p-54},
        {0x1.dfc97337b9b5fp+0, -0x1.1a5cd4f184b5cp-54}, {0x1.e502ee78b3ff6p+0, 0x1.39e8980a9cc8fp-55},
        {0x1.ea4afa2a490dap+0, -0x1.e9c23179c2893p-54}, {0x1.efa1bee615a27p+0, 0x1.dc7f486a4b6bp-54},
        {0x1.f50765b6e454p+0, 0x1.9d3e12dd8a18bp-54}, {0x1.fa7c1819e90d8p+0, 0x1.74853f3a5931ep-55}};
    gnc_pair_ t;
    t.hi = node[j][0];
    t.lo = node[j][1];
    return t;
}

/* e^(x + x_lo) = 2^k (hi + lo) with 1 <= hi < 2, |lo| < 2^-6 and x = n ln(2)/64 + r. */
typedef struct {
    double hi, lo;
    uint64_t k;
} gnc_exp_parts_;

/* ln(2)/64 is split so that n times its upper part (36 bits) is exact. */
GNC_INLINE gnc_exp_parts_ gnc_exp_reduce_(double x, double x_lo) {
    const double shifted = x * 0x1.71547652b82fep+6 + GNC_ROUNDER_;
    const double n = shifted - GNC_ROUNDER_;
    const double r = (x - n * 0x1.62e42fefap-7) + (x_lo - n * 0x1.cf79abc9e3b3ap-46), r2 = r * r;
    const double low = 0.5 + r * 0x1.5555555555252p-3;
    const double high = (0x1.55555555553d4p-5 + r * 0x1.11111d9625013p-7) + r2 * 0x1.6c16cdf12aa29p-10;
    const uint64_t count = gnc_bits_(shifted) - gnc_bits_(GNC_ROUNDER_);
    const gnc_pair_ node = gnc_exp_node_(gnc_bits_(shifted) & 63u);
    gnc_exp_parts_ e;
    e.hi = node.hi;
    e.lo = node.lo + node.hi * (r + r2 * (low + r2 * high));
    e.k = ((count + 0x40000u) >> 6) - 0x1000u;
    return e;
}

/* e^x. All x; max 0.75 ulp. */
GNC_INLINE double gnc_exp(double x) {
    /* The cap overflows or rounds to zero. */
    const gnc_exp_parts_ e = gnc_exp_reduce_(GNC_CHOOSE_(gnc_fabs(x) < 746.0, x, gnc_copysign(746.0, x)), 0.0);
    return GNC_CHOOSE_(x == x, gnc_scale_(e.hi + e.lo, e.k), gnc_nan_());
}

/* e^x - 1 for |x| < 1/8. */
GNC_INLINE double gnc_expm1_near_(double x) {
    const double z = x * x, x3 = x * z;
    const double p0 = gnc_poly3_(x, 0x1.5555555555555p-3, 0x1.5555555555555p-5, 0x1.11111111146ep-7);
    const double p3 = gnc_poly3_(x, 0x1.6c16c16c18ff6p-10, 0x1.a01a00930ee1p-13, 0x1.a01a00ecbe6ffp-16);
    const double p = p0 + x3 * (p3 + x3 * (0x1.71f9218da2e29p-19 + x * 0x1.27f6eadb38abep-22));
    return x + x * (0.5 * x + z * p);
}

/* e^x - 1 elsewhere, for x >= -38. */
GNC_INLINE double gnc_expm1_far_(double x) {
    const double limit = x < 0.0 ? 38.0 : 710.0;
    const gnc_exp_parts_ e = gnc_exp_reduce_(GNC_CHOOSE_(gnc_fabs(x) < limit, x, gnc_copysign(limit, x)), 0.0);
    const gnc_pair_ s = gnc_sum_(e.hi, x > 42.0 ? -0x1p-60 : -gnc_exp2i_(0u - e.k));
    return gnc_scale_(s.hi + (s.lo + e.lo), e.k);
}

/* e^x - 1. All x; max 0.60 ulp. */
GNC_INLINE double gnc_expm1(double x) {
    const double y = GNC_CHOOSE_(gnc_fabs(x) < 0.125, gnc_expm1_near_(x), gnc_expm1_far_(x));
    return GNC_CHOOSE_(x == x, y, gnc_nan_());
}

/*
 * (e^a + sign e^-a)/2 for a >= 0, good where that is above 1/8: with a = n ln(2)/64 + r, both exponentials share the
 * even and the odd part of e^r - 1.
 */
GNC_INLINE double gnc_exp_half_sum_(double a, double sign) {
    const double x = GNC_CHOOSE_(a < 711.0, a, 711.0);
    const double shifted = x * 0x1.71547652b82fep+6 + GNC_ROUNDER_;
    const double n = shifted - GNC_ROUNDER_;
    const double r = (x - n * 0x1.62e42fefap-7) - n * 0x1.cf79abc9e3b3ap-46, r2 = r * r;
    const double odd = r + r * r2 * (0x1.5555555555252p-3 + r2 * 0x1.11111d9625013p-7);
    const double even = r2 * (0.5 + r2 * (0x1.55555555553d4p-5 + r2 * 0x1.6c16cdf12aa29p-10));
    const uint64_t count = gnc_bits_(shifted) - gnc_bits_(GNC_ROUNDER_), back = 0x40000u - count;
    const gnc_pair_ up = gnc_exp_node_(gnc_bits_(shifted) & 63u), down = gnc_exp_node_(back & 63u);
    const uint64_t k = count >> 6;
    const double ratio = sign * (x > 42.0 ? 0x1p-130 : gnc_exp2i_((back >> 6) - 0x1000u - k));
    const gnc_pair_ s = gnc_sum_sorted_(up.hi, ratio * down.hi);
    const double lo = (up.lo + up.hi * (even + odd)) + ratio * (down.lo + down.hi * (even - odd));
    return gnc_scale_(s.hi + (s.lo + lo), k - 1u);
}

/* x + x^3 P(x^2) for |x| < 1/8. */
GNC_INLINE double gnc_sinh_near_(double x) {
    const double z = x * x;
    const double p = (0x1.5555555555555p-3 + z * 0x1.11111111146ep-7) +
                     z * z * (0x1.a01a00930ee1p-13 + z * 0x1.71f9218da2e29p-19);
    return x + x * z * p;
}

/* All x; max 0.60 ulp. */
GNC_INLINE double gnc_sinh(double x) {
    const double a = gnc_fabs(x);
    const double y = GNC_CHOOSE_(a < 0.125, gnc_sinh_near_(x), gnc_copysign(gnc_exp_half_sum_(a, -1.0), x));
    return GNC_CHOOSE_(x == x, y, gnc_nan_());
}

/* All x; max 0.55 ulp. */
GNC_INLINE double gnc_cosh(double x) {
    return GNC_CHOOSE_(x == x, gnc_exp_half_sum_(gnc_fabs(x), 1.0), gnc_nan_());
}

/* tanh(5 j/32) as a pair. The last are never asked for: no j of seven bits is outside. */
GNC_INLINE gnc_pair_ gnc_tanh_node_(uint64_t j) {
    static const double node[128][2] = {
        {0x0.0p+0, 0x0.0p+0}, {0x1.3d6bc7b108c25p-3, 0x1.00cd3564d3341p-61},
        {0x1.35f98a0ea650ep-2, -0x1.c5ef2f6ab7d74p-59}, {0x1.bfae6ab9724dep-2, -0x1.4803a534ea5cdp-57},
        {0x1.1bf47eabb8f95p-1, 0x1.2221cd286d06p-55}, {0x1.4e8d895b010dcp-1, 0x1.a4855a4ca6661p-57},
        {0x1.77d838e34057cp-1, 0x1.876b0daf91c74p-56}, {0x1.98b3463a09192p-1, 0x1.560b0c0e4bbe7p-55},
        {0x1.b2523bb6b2deep-1, 0x1.3b6dd4e6b805ap-56}, {0x1.c5fce81840af9p-1, -0x1.28dd9110ad39cp-55},
        {0x1.d4e6f464286b1p-1, -0x1.58d90474e92d8p-55}, {0x1.e01bd4e9861a7p-1, 0x1.77432b96951eep-55},
        {0x1.e8789ecec0ddap-1, 0x1.7e1eab8804de2p-55}, {0x1.eeaddb62d1a59p-1, -0x1.4dfa2d5dffa6ep-57},
        {0x1.f3451e0899e21p-1, -0x1.cbd4020dcffcp-58}, {0x1.f6a7c4d76eea1p-1, 0x1.8671ae7d6051bp-55},
        {0x1.f9258260a71c2p-1, -0x1.c47c0e1b448e9p-56}, {0x1.fafa13cbae665p-1, -0x1.d2eff43c24d06p-55},
        {0x1.fc51f569c07dbp-1, 0x1.4a5a5f589c5fbp-55}, {0x1.fd4e1f5960655p-1, -0x1.31ea8c50da70ep-55},
        {0x1.fe06eb0688212p-1, 0x1.04beec232acfcp-55}, {0x1.fe8e4871868b1p-1, 0x1.284977e9da4f3p-58},
        {0x1.fef16825d225bp-1, -0x1.02b291dfc7cf1p-57}, {0x1.ff39f9960c817p-1, -0x1.8f0d10b2a69b2p-57},
        {0x1.ff6f17a754772p-1, 0x1.ab2a4af36d491p-59}, {0x1.ff95f7b4c79c1p-1, -0x1.afaf80cde61e4p-55},
        {0x1.ffb26aa7817a3p-1, 0x1.be2574529e36ap-55}, {0x1.ffc73bf98cdbcp-1, 0x1.d6c9a092bada4p-55},
        {0x1.ffd677867b57fp-1, 0x1.fba90a0575772p-55}, {0x1.ffe19cc8d9214p-1, 0x1.d0659456b480ep-59},
        {0x1.ffe9c46d65d83p-1, 0x1.ccf7da9f262ecp-57}, {0x1.ffefbbdc98743p-1, -0x1.ee806c63d7acp-55},
        {0x1.fff419668df11p-1, 0x1.a800b7186cb57p-56}, {0x1.fff74b0879ca4p-1, 0x1.d04f78bd8edbep-55},
        {0x1.fff9a13d0afaep-1, 0x1.af51473ce1e91p-56}, {0x1.fffb56e6ce017p-1, -0x1.52b26c9220733p-57},
        {0x1.fffc971b3c075p-1, -0x1.032235fa0e8a5p-56}, {0x1.fffd81600a701p-1, -0x1.281cd246a72c9p-55},
        {0x1.fffe2cc559309p-1, -0x1.fcf7e5fd15358p-57}, {0x1.fffeaa2ad07b6p-1, 0x1.2a2be8ab6b163p-57},
        {0x1.ffff05e8d3192p-1, -0x1.b5a824232e239p-55}, {0x1.ffff490798f03p-1, 0x1.b693d722d33eep-55},
        {0x1.ffff7a22cde86p-1, -0x1.2f8a93cc7e33bp-55}, {0x1.ffff9e101b80ap-1, 0x1.09501942e1132p-55},
        {0x1.ffffb859011e1p-1, 0x1.3a747e0bc8dbp-55}, {0x1.ffffcb93f94f5p-1, -0x1.dbca9816757bbp-57},
        {0x1.ffffd9a5b273fp-1, -0x1.b36eaaa480359p-56}, {0x1.ffffe3f0c6689p-1, 0x1.d7fec6275341p-56},
        {0x1.ffffeb78a3c73p-1, 0x1.ca5af79411c48p-56}, {0x1.fffff0fb18933p-1, -0x1.073b4c26af484p-56},
        {0x1.fffff503020a5p-1, -0x1.c615d21fd2fa6p-57}, {0x1.fffff7f5f891ep-1, 0x1.0e89a19eb4265p-55},
        {0x1.fffffa1e50522p-1, -0x1.e86b27d1d5c93p-56}, {0x1.fffffbb26a982p-1, -0x1.5a4d5f60aeebep-55},
        {0x1.fffffcda106f2p-1, 0x1.20ca54a17c199p-59}, {0x1.fffffdb25d611p-1, -0x1.02404d9f97509p-56},
        {0x1.fffffe509d179p-1, -0x1.046cdac60a2b9p-56}, {0x1.fffffec464184p-1, 0x1.04b0d796c7a64p-55},
        {0x1.ffffff191873ep-1, 0x1.0dfa69df61375p-55}, {0x1.ffffff5711116p-1, 0x1.ee19562d9fe16p-55},
        {0x1.ffffff8467de6p-1, -0x1.9fe959d08c37ep-55}, {0x1.ffffffa59395dp-1, 0x1.572235f0b585cp-55},
        {0x1.ffffffbdd8421p-1, -0x1.25aa8c72cd11ap-55}, {0x1.ffffffcf998bep-1, 0x1.d3199e269f443p-56},
        {0x1.ffffffdc96f35p-1, 0x1.54a515b0b44b4p-55}, {0x1.ffffffe617de4p-1, -0x1.70f796bc53eefp-56},
        {0x1.ffffffed0bd42p-1, 0x1.9411fc523225dp-56}, {0x1.fffffff222136p-1, -0x1.26ab96ec4c85ep-55},
        {0x1.fffffff5dad1ep-1, 0x1.9eaef7ffb04cep-58}, {0x1.fffffff893dccp-1, 0x1.93bf900b050b9p-55},
        {0x1.fffffffa91d46p-1, 0x1.7cac9763ff6b2p-56}, {0x1.fffffffc06eep-1, -0x1.bf933bea1b69fp-56},
        {0x1.fffffffd17e54p-1, -0x1.5d3444c3fbf9fp-55}, {0x1.fffffffddf9ap-1, -0x1.a14b0e3567f6fp-55},
        {0x1.fffffffe71b5ap-1, 0x1.9d7f185432de5p-56}, {0x1.fffffffedc9acp-1, -0x1.0258f3f1b2ad5p-56},
        {0x1.ffffffff2acf8p-1, -0x1.4382ec1f5b127p-55}, {0x1.ffffffff6406fp-1, 0x1.c582c83d190b5p-55},
        {0x1.ffffffff8de35p-1, -0x1.2dd8c7f1641d7p-55}, {0x1.ffffffffac838p-1, 0x1.c7308853adfc7p-55},
        {0x1.ffffffffc2eb9p-1, 0x1.6e883ca81457fp-58}, {0x1.ffffffffd3502p-1, 0x1.eb2fab76ad8bbp-56},
        {0x1.ffffffffdf4e7p-1, -0x1.24e335fdf3b5cp-55}, {0x1.ffffffffe814bp-1, -0x1.b1ff5fe87a9c6p-58},
        {0x1.ffffffffee801p-1, 0x1.886c3e337af5bp-55}, {0x1.fffffffff3327p-1, -0x1.920263afc02f2p-56},
        {0x1.fffffffff6a21p-1, 0x1.9c09f95b3392ap-56}, {0x1.fffffffff925ap-1, 0x1.005e00da4e925p-55},
        {0x1.fffffffffafc8p-1, -0x1.11f58e137a343p-55}, {0x1.fffffffffc54fp-1, 0x1.62017a263a9b3p-55},
        {0x1.fffffffffd51p-1, -0x1.166cb09bb7f78p-55}, {0x1.fffffffffe096p-1, -0x1.e2fef76f0eab6p-57},
        {0x1.fffffffffe904p-1, 0x1.0b19d14b69479p-55}, {0x1.fffffffffef2fp-1, 0x1.7538c658033efp-55},
        {0x1.ffffffffff3b3p-1, -0x1.5ac127cc6789cp-55}, {0x1.ffffffffff7p-1, -0x1.af8eb134a193p-57},
        {0x1.ffffffffff96ap-1, 0x1.1f3d538340ee1p-55}, {0x1.ffffffffffb2fp-1, -0x1.31e571aac82d8p-55},
        {0x1.ffffffffffc7ap-1, -0x1.33d6b3323d7b3p-55}, {0x1.ffffffffffd6cp-1, -0x1.19106614a0576p-56},
        {0x1.ffffffffffe1dp-1, 0x1.109f8c288a6bcp-58}, {0x1.ffffffffffe9fp-1, -0x1.624e2335fd38ep-55},
        {0x1.ffffffffffefdp-1, 0x1.f2385aabdcc04p-55}, {0x1.fffffffffff43p-1, -0x1.0f547c3d04277p-56},
        {0x1.fffffffffff76p-1, -0x1.7d378daf838afp-55}, {0x1.fffffffffff9bp-1, -0x1.e1f1b416ea30dp-56},
        {0x1.fffffffffffb6p-1, -0x1.0ba7ad02def66p-57}, {0x1.fffffffffffcap-1, -0x1.7fb8da6a13c03p-56},
        {0x1.fffffffffffd8p-1, 0x1.6c36b175976edp-55}, {0x1.fffffffffffe3p-1, -0x1.20c0c82356924p-61},
        {0x1.fffffffffffebp-1, -0x1.c2b799e721b95p-56}, {0x1.ffffffffffffp-1, 0x1.e6762e4f626ffp-55},
        {0x1.ffffffffffff5p-1, -0x1.6ee334b3e1b84p-55}, {0x1.ffffffffffff8p-1, -0x1.3d56ce9f2058ap-55},
        {0x1.ffffffffffffap-1, -0x1.46430ab0a3442p-57}, {0x1.ffffffffffffcp-1, -0x1.cab89346292c2p-55},
        {0x1.ffffffffffffdp-1, -0x1.044e18dff7af5p-55}, {0x1.ffffffffffffep-1, -0x1.85f76a69a920fp-55},
        {0x1.ffffffffffffep-1, 0x1.08587b2d84b0dp-55}, {0x1.fffffffffffffp-1, -0x1.18f30cccd54acp-55},
        {0x1.fffffffffffffp-1, 0x1.151d4ce7f09c7p-57}, {0x1.fffffffffffffp-1, 0x1.4582cb2914dep-55},
        {0x1.0p+0, -0x1.ff068955ef6c3p-55}, {0x1.0p+0, -0x1.75dfcff2c44f9p-55},
        {0x1.0p+0, -0x1.118841fc0a577p-55}, {0x1.0p+0, -0x1.903daec8f0fbp-56},
        {0x1.0p+0, -0x1.24d291874c17ap-56}, {0x1.0p+0, -0x1.ac7792c79c7abp-57}};
    gnc_pair_ t;
    t.hi = node[j][0];
    t.lo = node[j][1];
    return t;
}

/*
 * With t = tanh c, c = 5 j/32 next to |x|, and s = tanh h, h = |x| - c: t + (1 - t^2) s/(1 + t s), one division. The
 * larger part of that step is g h, where g is 1 - t^2 in two bits, so that g h is exact; what is left over is small and
 * shrinks with 1 - t^2: the function never falls where x rises. All x; max 0.57 ulp.
 */
GNC_INLINE double gnc_tanh(double x) {
    const double a = gnc_fabs(x), shifted = a * 6.4 + GNC_ROUNDER_;
    const double h = a - (shifted - GNC_ROUNDER_) * 0.15625, z = h * h;
    const gnc_pair_ t = gnc_tanh_node_(gnc_bits_(shifted) & 0x7fu);
    const double w = ((1.0 - t.hi) - t.lo) * (1.0 + t.hi); /* 1 - t^2, good where that is small */
    const double g = gnc_from_bits_((gnc_bits_(w) + UINT64_C(0x4000000000000)) & UINT64_C(0xfff8000000000000));
    const double w_rest = t.hi < 0.7 ? (1.0 - g) - t.hi * t.hi : w - g;
    const double p0 = gnc_poly3_(z, -0x1.5555555555554p-2, 0x1.111111110cd06p-3, -0x1.ba1ba162f73a8p-5);
    const double p3 = 0x1.664e0ff293673p-6 - z * 0x1.20a45086912c1p-7;
    const double rest = h * z * (p0 + z * z * z * p3); /* tanh h - h */
    const double ts = t.hi * (h + rest), gh = g * h;
    const double q = ((w_rest * h + w * rest) - gh * ts) / (1.0 + ts);
    const gnc_pair_ y = gnc_sum_sorted_(t.hi, gh);
    const double size = y.hi + (y.lo + (t.lo + q));
    const double y_ok = gnc_copysign(a < 19.0625 ? size : 1.0, x);
    return x == x ? y_ok : gnc_nan_();
}

/* ---- Error function -------------------------------------------------------------------------------- */

/* Below 1, x + x P(x^2); from there on 1 - e^(-x^2) Q((|x| - 3)/(|x| + 3)), as what is taken off is small. P and Q are
 * minimax polynomials, made with 60 digits. */
GNC_INLINE double gnc_erf_near_(double x) {
    const double s = x * x, s3 = s * s * s;
    const double p_low = gnc_poly3_(s, 0.12837916709551256, -0.37612638903183393, 0.11283791670939276) +
                         s3 * gnc_poly3_(s, -0.026866170642337487, 0.0052239775997986182, -0.00085483256279412611);
    const double p_high = gnc_poly3_(s, 0.00012055284633541632, -1.4924542340417247e-05, 1.6445063106371516e-06) +
                          s3 * gnc_poly3_(s, -1.6190730651579864e-07, 1.3644831708592282e-08, -7.6585436879790383e-10);
    return x + x * (p_low + (s3 * s3) * p_high);
}

/* For 1 <= |x|. */
GNC_INLINE double gnc_erf_far_(double x) {
    const double a = gnc_fabs(x);
    const double b = GNC_CHOOSE_(a < 6.0, a, 6.0);
    const double t = (b - 3.0) / (b + 3.0), t3 = t * t * t;
    const double q_low = gnc_poly3_(t, 0.17900115118135387, -0.32623356004589982, 0.24560380166428189) +
                         t3 * gnc_poly3_(t, -0.15011593634472473, 0.071665850116798019, -0.024392327975932996);
    const double q_high = gnc_poly3_(t, 0.0042703533585785932, 0.00071317400150438192, -0.00058109463945536051) +
                          t3 * gnc_poly3_(t, 7.6391097370486397e-05, 0.00010294982681996221, 1.5202692020050951e-05);
    return gnc_copysign(1.0 - gnc_exp(-(b * b)) * (q_low + (t3 * t3) * q_high), x);
}

/* All x; max 1.45 ulp. */
GNC_INLINE double gnc_erf(double x) {
    const double y = GNC_CHOOSE_(gnc_fabs(x) < 1.0, gnc_erf_near_(x), gnc_erf_far_(x));
    return GNC_CHOOSE_(x == x, y, gnc_nan_());
}

/* ---- Logarithms ------------------------------------------------------------------------------------ */

/* x = 2^k m with sqrt(1/2) <= m < sqrt(2), so that log m stays small when k = 0. */
typedef struct {
    double m, k;
} gnc_log_parts_;

GNC_INLINE gnc_log_parts_ gnc_log_reduce_(double x) {
    const double up = x < 0x1p-1022 ? 0x1p54 : 1.0; /* subnormal numbers have no exponent to read */
    const uint64_t bits = gnc_bits_(x * up);
    const uint64_t biased = (bits - UINT64_C(0x3fe6a09e667f3bcd) + UINT64_C(0x4000000000000000)) >> 52;
    gnc_log_parts_ p;
    p.m = gnc_from_bits_(bits - ((biased - 1024u) << 52));
    p.k = (gnc_from_bits_(gnc_bits_(0x1p52) + biased) - (0x1p52 + 1024.0)) - (up > 1.0 ? 54.0 : 0.0);
    return p;
}

/*
 * k ln 2 + log(1 + f). With s = f/(2 + f), log(1 + f) = 2 atanh(s) = f - f^2/2 + s (f^2/2 + s^2 P(s^2)).
 * The sums from large to small keep their errors.
 */
GNC_INLINE double gnc_log_sum_(double k, double f) {
    const double s = f / (2.0 + f), z = s * s, z3 = z * z * z;
    const double p0 = gnc_poly3_(z, 0x1.5555555555592p-1, 0x1.999999997fd11p-2, 0x1.24924941fb26cp-2);
    const double p3 = gnc_poly3_(z, 0x1.c71c5200a378ap-3, 0x1.746640cfef102p-3, 0x1.39a186c8ecd3cp-3);
    const double p = z * (p0 + z3 * (p3 + z3 * 0x1.2f0789afb6648p-3));
    const gnc_pair_ half = gnc_half_square_(f);
    const gnc_pair_ b = gnc_sum_sorted_(f, -half.hi);
    const gnc_pair_ a = gnc_sum_sorted_(k * 0x1.62e42fefa38p-1, b.hi);
    const double small = (b.lo - half.lo) + s * (0.5 * f * f + p);
    return a.hi + (a.lo + (small + k * 0x1.ef35793c7673p-45));
}

/* Natural logarithm. All x; max 0.67 ulp. */
GNC_INLINE double gnc_log(double x) {
    const gnc_log_parts_ p = gnc_log_reduce_(x);
    const double y = gnc_log_sum_(p.k, p.m - 1.0);
    const double finite = x < gnc_inf_() ? y : x;
    const double positive = x > 0.0 ? finite : -gnc_inf_();
    return x >= 0.0 ? positive : gnc_nan_();
}

/*
 * log1p and pow start from a table: c of ten bits near 1/m in the middle of the j-th of 128 ranges of m, and -log c as
 * a sum whose larger part is a multiple of 2^-42. On both sides of m = 1, c = 1.
 */
typedef struct {
    double c, hi, lo;
} gnc_log_node_;

GNC_INLINE gnc_log_node_ gnc_log_node_at_(uint64_t j) {
    static const double node[128][3] = {
        {0x1.738p+0, -0x1.7d4eeef5efp-2, 0x1.c9018f8f27d8fp-45}, {0x1.71p+0, -0x1.7664e1239ep-2, 0x1.0c4fb6aeb27afp-44},
        {0x1.6fp+0, -0x1.70d42e2789p-2, -0x1.1aead337ee287p-45},
        {0x1.6dp+0, -0x1.6b3bb22359p-2, -0x1.0f6257a933268p-44},
        {0x1.6bp+0, -0x1.659b57303ep-2, -0x1.f281db0af8efcp-46},
        {0x1.69p+0, -0x1.5ff3070a79p-2, -0x1.e9e439f105039p-45}, {0x1.67p+0, -0x1.5a42ab0f4dp-2, 0x1.e63af2df7ba69p-50},
        {0x1.65p+0, -0x1.548a2c3addp-2, -0x1.3167e63081cf7p-45}, {0x1.63p+0, -0x1.4ec97326p-2, -0x1.34d7aaf04d104p-45},
        {0x1.618p+0, -0x1.4a7373cedp-2, 0x1.9a234ebf35449p-44},
        {0x1.5f8p+0, -0x1.44a41b463cp-2, -0x1.1ee28f37cf612p-44},
        {0x1.5d8p+0, -0x1.3ecc460ef6p-2, 0x1.6028627c1300fp-47},
        {0x1.5b8p+0, -0x1.38ebdb38edp-2, -0x1.90582e67d4cap-45}, {0x1.5ap+0, -0x1.347dd9a988p-2, 0x1.5594dd4c58092p-45},
        {0x1.58p+0, -0x1.2e8e2bae12p-2, 0x1.67b1e99b72bd8p-45}, {0x1.56p+0, -0x1.2895a13de8p-2, -0x1.a8d7ad24c13fp-44},
        {0x1.548p+0, -0x1.241558bfd1p-2, -0x1.00fff3228fcadp-44},
        {0x1.528p+0, -0x1.1e0d0c3371p-2, -0x1.af8f2a9b0d4ap-44},
        {0x1.51p+0, -0x1.1980d2dd42p-2, -0x1.b7b3a7a361c9ap-45}, {0x1.4fp+0, -0x1.136870293bp-2, 0x1.d3e8499d67123p-44},
        {0x1.4d8p+0, -0x1.0ed005f658p-2, 0x1.2dc75285aa803p-45},
        {0x1.4cp+0, -0x1.0a324e2739p-2, -0x1.c6bee7ef4030ep-47},
        {0x1.4ap+0, -0x1.0402594b4dp-2, -0x1.036b89ef42d7fp-48},
        {0x1.488p+0, -0x1.feb0233e6p-3, -0x1.f316e32d5e8c7p-45}, {0x1.47p+0, -0x1.f550a564b8p-3, 0x1.323e3a09202fep-45},
        {0x1.45p+0, -0x1.e8c0252aa6p-3, 0x1.6805b80e8e6ffp-45},
        {0x1.438p+0, -0x1.df46c0c722p-3, -0x1.a5e82b0b79039p-44},
        {0x1.42p+0, -0x1.d5c216b4fcp-3, 0x1.1ba91bbca681bp-45},
        {0x1.408p+0, -0x1.cc320c0176p-3, -0x1.409039a653794p-45}, {0x1.3fp+0, -0x1.c2968558c2p-3, 0x1.cfd73dee38a4p-45},
        {0x1.3d8p+0, -0x1.b8ef67042p-3, -0x1.87533321788ep-44}, {0x1.3cp+0, -0x1.af3c94e80cp-3, 0x1.a4e633fcd9066p-52},
        {0x1.3a8p+0, -0x1.a57df28244p-3, -0x1.b99c8ca1d9abbp-44}, {0x1.39p+0, -0x1.9bb362e7ep-3, 0x1.1f2a8a1ce0ffcp-45},
        {0x1.378p+0, -0x1.91dcc8c34p-3, -0x1.7bc6abddeff46p-44},
        {0x1.36p+0, -0x1.87fa06520cp-3, -0x1.22120401202fcp-44},
        {0x1.348p+0, -0x1.7e0afd630cp-3, -0x1.39e7c1d8f1034p-46},
        {0x1.33p+0, -0x1.740f8f5404p-3, 0x1.0b66c99018aa1p-44},
        {0x1.318p+0, -0x1.6a079d0f7ap-3, -0x1.5a3f8448d14f5p-44}, {0x1.3p+0, -0x1.5ff3070a7ap-3, 0x1.8586f183bebf2p-44},
        {0x1.2e8p+0, -0x1.55d1ad4232p-3, -0x1.add94dda647e8p-44},
        {0x1.2d8p+0, -0x1.4f099f4a24p-3, 0x1.e9bf2fafeaf27p-44}, {0x1.2cp+0, -0x1.44d2b6ccb8p-3, 0x1.70cc16135783cp-46},
        {0x1.2a8p+0, -0x1.3a8eb2d31ap-3, -0x1.bafb77d5d503ep-46},
        {0x1.29p+0, -0x1.303d718e48p-3, 0x1.680b5ce3ecb05p-50}, {0x1.28p+0, -0x1.29552f82p-3, 0x1.5b967f4471dfcp-44},
        {0x1.268p+0, -0x1.1eed90e2dcp-3, -0x1.615637097648fp-46},
        {0x1.25p+0, -0x1.1478584674p-3, -0x1.563451027c75p-46}, {0x1.24p+0, -0x1.0d77e7cd08p-3, -0x1.cb2cd2ee2f482p-44},
        {0x1.228p+0, -0x1.02ebb42bf4p-3, 0x1.5a8fa5ce00e5dp-46},
        {0x1.218p+0, -0x1.f7b79fec38p-4, 0x1.10987e897ed01p-47}, {0x1.2p+0, -0x1.e27076e2bp-4, 0x1.a342c2af0003cp-45},
        {0x1.1fp+0, -0x1.d4313d66ccp-4, 0x1.9454379135713p-45}, {0x1.1d8p+0, -0x1.beba818148p-4, 0x1.89b78b6df1f57p-44},
        {0x1.1c8p+0, -0x1.b05b49bee4p-4, -0x1.ff22c18f84a5ep-47},
        {0x1.1bp+0, -0x1.9ab4246204p-4, 0x1.8a64826787061p-45}, {0x1.1ap+0, -0x1.8c345d6318p-4, -0x1.b20f5acb42a66p-44},
        {0x1.188p+0, -0x1.765bf23a6cp-4, 0x1.ecbc035c4256ap-48},
        {0x1.178p+0, -0x1.67bb0726ecp-4, -0x1.f724b69ef5912p-49},
        {0x1.168p+0, -0x1.590cafdfp-4, -0x1.c284f5722abaap-44}, {0x1.15p+0, -0x1.42edcbea64p-4, -0x1.bc0eeea7c9acdp-46},
        {0x1.14p+0, -0x1.341d7961bcp-4, -0x1.1d0929983761p-44}, {0x1.13p+0, -0x1.253f62f0ap-4, -0x1.416f8fb69a701p-44},
        {0x1.118p+0, -0x1.0ed839b554p-4, 0x1.901f46d48abb4p-44},
        {0x1.108p+0, -0x1.ffae9119b8p-5, -0x1.303374262c554p-45},
        {0x1.0f8p+0, -0x1.e19070c278p-5, 0x1.fea4664629e86p-45},
        {0x1.0e8p+0, -0x1.c355dd092p-5, -0x1.f2ccc9abf8388p-45}, {0x1.0dp+0, -0x1.95c830ec9p-5, 0x1.c148297c5feb8p-45},
        {0x1.0cp+0, -0x1.77458f633p-5, 0x1.181dce586af09p-44}, {0x1.0bp+0, -0x1.58a5bafc9p-5, 0x1.b2b739570ad39p-45},
        {0x1.0ap+0, -0x1.39e87b9fe8p-5, -0x1.eafd480ad9015p-44}, {0x1.09p+0, -0x1.1b0d98924p-5, 0x1.3401e9ae889bbp-44},
        {0x1.078p+0, -0x1.d91a66c54p-6, -0x1.e61f1658cfb9ap-45}, {0x1.068p+0, -0x1.9ace7551dp-6, 0x1.d75d97ec7c41p-45},
        {0x1.058p+0, -0x1.5c45a51b9p-6, 0x1.63bb6216d87d8p-45}, {0x1.048p+0, -0x1.1d7f7eb9fp-6, 0x1.4193a83fcc7a6p-46},
        {0x1.038p+0, -0x1.bcf712c74p-7, -0x1.c25e097bd9771p-46}, {0x1.028p+0, -0x1.3e7295d26p-7, 0x1.609c1ff29a114p-45},
        {0x1.018p+0, -0x1.7ee11ebd8p-8, -0x1.749d3c2d23a07p-47}, {0x1.0p+0, 0x0.0p+0, 0x0.0p+0},
        {0x1.0p+0, 0x0.0p+0, 0x0.0p+0}, {0x1.fap-1, 0x1.82448a388p-7, 0x1.4554412c584ep-44},
        {0x1.f6p-1, 0x1.432a92598p-6, 0x1.98139928637fep-47}, {0x1.f2p-1, 0x1.c63d2ec15p-6, -0x1.5439ce030a687p-44},
        {0x1.efp-1, 0x1.149e3e4008p-5, -0x1.2b98a9a4168fdp-44}, {0x1.ebp-1, 0x1.5715c4c04p-5, -0x1.8888ddfc47628p-44},
        {0x1.e7p-1, 0x1.9a187b574p-5, -0x1.0c22e4ec4d90dp-44}, {0x1.e4p-1, 0x1.ccb73cddd8p-5, 0x1.965c36e09f5fep-44},
        {0x1.ep-1, 0x1.08598b59e4p-4, -0x1.7e5dd7009902cp-46}, {0x1.ddp-1, 0x1.2207b5c784p-4, 0x1.49d8cfc10c7bfp-44},
        {0x1.d9p-1, 0x1.4485e03dbcp-4, 0x1.fad46e8d26ab7p-44}, {0x1.d6p-1, 0x1.5e95a4d978p-4, 0x1.1cb7ce1d17171p-44},
        {0x1.d2p-1, 0x1.8197e2f41p-4, -0x1.c0fe460d20041p-44}, {0x1.cfp-1, 0x1.9c0c32d4d4p-4, -0x1.ab7c09e838668p-44},
        {0x1.ccp-1, 0x1.b6ac88dad4p-4, 0x1.b1bdff50225c7p-44}, {0x1.c9p-1, 0x1.d179788218p-4, 0x1.36433b5efbeedp-44},
        {0x1.c6p-1, 0x1.ec739830ap-4, 0x1.11fcba80cdd1p-44}, {0x1.c2p-1, 0x1.08598b59e4p-3, -0x1.7e5dd7009902cp-45},
        {0x1.bfp-1, 0x1.160c8024b2p-3, 0x1.ec2d2a9009e3dp-45}, {0x1.bcp-1, 0x1.23d712a49cp-3, 0x1.00d238fd3df5cp-46},
        {0x1.b9p-1, 0x1.31b994d3a4p-3, 0x1.f098ee3a5081p-44}, {0x1.b6p-1, 0x1.3fb45a5992p-3, 0x1.19713c0cae559p-44},
        {0x1.b3p-1, 0x1.4dc7b897bcp-3, 0x1.c79b60ae1ff0fp-47}, {0x1.b1p-1, 0x1.5737cc9018p-3, 0x1.9baa7a6b887f6p-44},
        {0x1.aep-1, 0x1.6574ebe8c2p-3, -0x1.98c1d34f0f462p-44}, {0x1.abp-1, 0x1.73cb9074fep-3, -0x1.d66a90d0005a6p-44},
        {0x1.a8p-1, 0x1.823c16551ap-3, 0x1.e0ddb9a631e83p-46}, {0x1.a5p-1, 0x1.90c6db9fccp-3, -0x1.935f57718d7cap-46},
        {0x1.a3p-1, 0x1.9a8778debap-3, 0x1.470fa3efec39p-44}, {0x1.ap-1, 0x1.a93ed3c8aep-3, -0x1.8724350562169p-45},
        {0x1.9dp-1, 0x1.b811730b82p-3, 0x1.e90683b9cd768p-46}, {0x1.9bp-1, 0x1.c2028ab18p-3, -0x1.92e0ee55c7ac6p-45},
        {0x1.98p-1, 0x1.d1037f2656p-3, -0x1.84a7e75b6f6e4p-47}, {0x1.96p-1, 0x1.db13db0d48p-3, 0x1.2806a847527e6p-44},
        {0x1.93p-1, 0x1.ea4449f04ap-3, 0x1.5e91663732a36p-44}, {0x1.91p-1, 0x1.f474b134ep-3, -0x1.bae49f1df7b5ep-44},
        {0x1.8ep-1, 0x1.01eae5626cp-2, 0x1.a43dcfade85aep-44}, {0x1.8cp-1, 0x1.07138604d6p-2, -0x1.e76324e912b17p-44},
        {0x1.8ap-1, 0x1.0c42d67616p-2, 0x1.7188b163ceae9p-45}, {0x1.87p-1, 0x1.14167ef367p-2, 0x1.e0c07824daaf5p-44},
        {0x1.85p-1, 0x1.1956d3b9bcp-2, 0x1.7d2f73ad1aa14p-45}, {0x1.83p-1, 0x1.1e9e16788ap-2, -0x1.82eaed3c8b65ep-44},
        {0x1.8p-1, 0x1.269621134ep-2, -0x1.1b61f10522625p-44}, {0x1.7ep-1, 0x1.2bef07cdc9p-2, 0x1.a9cfa4a5004f4p-45},
        {0x1.7cp-1, 0x1.314f1e1d36p-2, -0x1.8e27ad3213cb8p-45}, {0x1.7ap-1, 0x1.36b6776be1p-2, 0x1.16ecdb0f177c8p-46},
        {0x1.78p-1, 0x1.3c25277333p-2, 0x1.83b54b606bd5cp-46}, {0x1.75p-1, 0x1.44591e053ap-2, -0x1.6e95892923d88p-47}};
    gnc_log_node_ t;
    t.c = node[j][0];
    t.hi = node[j][1];
    t.lo = node[j][2];
    return t;
}

/* x = 2^k m and log x = hi + lo + log(1 + r + r_lo) with |r| < 2^-7, |r_lo| <= 2^-62, and hi = 0 or |hi| > |r|. */
typedef struct {
    double r, r_lo, hi, lo, c;
    uint64_t k;
} gnc_log_offset_;

/* 0.6875 <= m < 1.375. With m in two halves, both products with c are exact; r_lo is what their sum loses. */
GNC_INLINE gnc_log_offset_ gnc_log_from_node_(double x) {
    const double up = x < 0x1p-1022 ? 0x1p54 : 1.0; /* subnormal numbers have no exponent to read */
    const uint64_t shifted = gnc_bits_(x * up) - UINT64_C(0x3fe6000000000000) + UINT64_C(0x4000000000000000);
    const uint64_t biased = shifted >> 52;
    const double m = gnc_from_bits_((shifted & UINT64_C(0xfffffffffffff)) + UINT64_C(0x3fe6000000000000));
    const double k = (gnc_from_bits_(gnc_bits_(0x1p52) + biased) - (0x1p52 + 1024.0)) - (up > 1.0 ? 54.0 : 0.0);
    const gnc_log_node_ node = gnc_log_node_at_((shifted >> 45) & 127u);
    const double head = gnc_from_bits_(gnc_bits_(m) & UINT64_C(0xffffffff00000000));
    gnc_log_offset_ p;
    const double coarse = head * node.c - 1.0, fine = (m - head) * node.c;
    p.r = coarse + fine;
    p.r_lo = (coarse - p.r) + fine;
    p.hi = k * 0x1.62e42fefa38p-1 + node.hi;
    p.lo = k * 0x1.ef35793c7673p-45 + node.lo;
    p.c = node.c;
    p.k = biased - 1024u;
    return p;
}

/* log(1 + r) - r + r^2/2 for |r| < 2^-7. */
GNC_INLINE double gnc_log_rest_(double r) {
    const double r2 = r * r, r3 = r * r2;
    const double p0 = gnc_poly3_(r, 0x1.5555555555555p-2, -0x1.ffffffffffff9p-3, 0x1.99999999967a1p-3);
    const double p3 = gnc_poly3_(r, -0x1.5555555631f13p-3, 0x1.24924e5eb1712p-3, -0x1.000094ed13f24p-3);
    return r3 * (p0 + r3 * (p3 + r3 * 0x1.c27b69da9bd16p-4));
}

/* log(1 + x): what is lost in rounding 1 + x comes back as a correction. All x; max 0.67 ulp. */
GNC_INLINE double gnc_log1p(double x) {
    const gnc_pair_ u = gnc_sum_(1.0, x);
    const gnc_log_offset_ p = gnc_log_from_node_(u.hi);
    const double lost = u.lo * (p.c * gnc_exp2i_(0u - (x < 0x1p100 ? p.k : 100u)));
    const gnc_pair_ s = gnc_sum_sorted_(p.hi, p.r);
    const double rest = (lost - lost * p.r) + (p.r_lo + (gnc_log_rest_(p.r) - 0.5 * p.r * p.r));
    const double y = s.hi + (s.lo + (p.lo + rest));
    const double finite = x < gnc_inf_() ? y : x;
    const double nonzero = x == 0.0 ? x : finite;
    const double above = x > -1.0 ? nonzero : -gnc_inf_();
    return x >= -1.0 ? above : gnc_nan_();
}

/* ---- Power ----------------------------------------------------------------------------------------- */

/*
 * log x as a pair good to about 2^-65, for x > 0 and finite: y log x reaches 745, so a power needs ten bits more than a
 * double.
 */
GNC_INLINE gnc_pair_ gnc_log_pair_(double x) {
    const gnc_log_offset_ p = gnc_log_from_node_(x);
    const gnc_pair_ half = gnc_half_square_(p.r);
    const gnc_pair_ s = gnc_sum_sorted_(p.hi, p.r);
    const gnc_pair_ l = gnc_sum_sorted_(s.hi, -half.hi);
    const double rest = (p.r_lo - p.r_lo * p.r) + (gnc_log_rest_(p.r) - half.lo);
    return gnc_sum_sorted_(l.hi, (s.lo + l.lo) + (p.lo + rest));
}

/* x^y from |x|^y where both are finite and x is not zero. */
GNC_INLINE double gnc_pow_special_(double x, double y, double size) {
    const double a = gnc_fabs(x), b = gnc_fabs(y), inf = gnc_inf_();
    const double of_zero = y < 0.0 ? inf : 0.0;
    const double of_inf = y < 0.0 ? 0.0 : inf;
    const double from_one = a == 1.0 ? 1.0 : size; /* for an infinite y */
    const double from_zero = a > 0.0 ? from_one : of_zero;
    const double magnitude = a < inf ? from_zero : of_inf;
    /* Doubles from 2^53 on are even. y is an integer (odd) when rounding y (y/2) changes nothing (something). */
    const double whole = b < 0x1p52 ? (b + 0x1p52) - 0x1p52 : b;
    const double half = 0.5 * b;
    const double whole_half = half < 0x1p52 ? (half + 0x1p52) - 0x1p52 : half;
    const double odd_sign = whole_half == half ? 1.0 : gnc_copysign(1.0, x);
    const double of_integer = gnc_copysign(magnitude, odd_sign);
    const double finite_base = a > 0.0 ? gnc_nan_() : magnitude;
    const double of_fraction = a < inf ? finite_base : magnitude;
    const double negative = whole == b ? of_integer : of_fraction;
    const double any_base = gnc_copysign(1.0, x) < 0.0 ? negative : magnitude;
    const double y_ok = y == y ? any_base : gnc_nan_();
    const double ok = x == x ? y_ok : gnc_nan_();
    const double y_zero = y == 0.0 ? 1.0 : ok; /* 1 even for a NaN base, by Annex F */
    return x == 1.0 ? 1.0 : y_zero;
}

/* x^y = e^(y log x). All x and y; max 0.76 ulp. */
GNC_INLINE double gnc_pow(double x, double y) {
    const gnc_pair_ l = gnc_log_pair_(gnc_fabs(x));
    const double y_head = gnc_from_bits_(gnc_bits_(y) & UINT64_C(0xfffffffff8000000)), l_head = gnc_head_(l.hi);
    const double e_hi = y_head * l_head;
    const double e_lo = (y - y_head) * l_head + y * ((l.hi - l_head) + l.lo);
    const double size = gnc_fabs(y * l.hi); /* from 800 on, infinity or zero; a NaN is not below either */
    const double capped = GNC_CHOOSE_(size < 800.0, e_hi, gnc_copysign(800.0, e_hi));
    const gnc_exp_parts_ e = gnc_exp_reduce_(capped, GNC_CHOOSE_(size < 800.0, e_lo, 0.0));
    double z = gnc_scale_(e.hi + e.lo, e.k);
    if ((GNC_LANES != 0) || !((x > 0.0) && (x < gnc_inf_()) && (size < 800.0))) {
        z = gnc_pow_special_(x, y, z);
    }
    return z;
}

/* ---- Trigonometry ---------------------------------------------------------------------------------- */

/* a = quarter pi/2 + r, with r a pair. */
typedef struct {
    gnc_pair_ r;
    uint64_t quarter;
} gnc_trig_parts_;

/*
 * For a >= 0. pi/2 comes in parts of 33, 33, 33 and 53 bits: for a count n below 2^20 the first three products
 * with n are exact, and the sums keep their errors, so r is good even where a is next to a multiple of pi/2.
 */
GNC_INLINE gnc_trig_parts_ gnc_trig_reduce_far_(double a) {
    const double x = a <= 0x1p30 ? a : 0.0;
    const double shifted = x * 0x1.45f306dc9c883p-1 + GNC_ROUNDER_;
    const double n = shifted - GNC_ROUNDER_;
    const double r1 = x - n * 0x1.921fb544p+0;
    const gnc_pair_ r2 = gnc_sum_(r1, -(n * 0x1.0b4611a6p-34));
    const gnc_pair_ r3 = gnc_sum_(r2.hi, -(n * 0x1.3198a2ep-69));
    gnc_trig_parts_ p;
    p.r = gnc_sum_sorted_(r3.hi, (r2.lo + r3.lo) - n * 0x1.b839a252049c1p-104);
    p.quarter = gnc_bits_(shifted);
    return p;
}

/* For a >= 0. Below pi/4 nothing is taken off, and the steps above would give a itself. */
GNC_INLINE gnc_trig_parts_ gnc_trig_reduce_(double a) {
    gnc_trig_parts_ p = {{a, 0.0}, 0u};
    if ((GNC_LANES != 0) || !(a <= 0.785)) {
        p = gnc_trig_reduce_far_(a);
    }
    return p;
}

/* sin r - r for |r| <= pi/4, where cos r, the slope of the correction by r.lo, is 1 - r^2/2. */
GNC_INLINE double gnc_sin_rest_(gnc_pair_ r) {
    const double z = r.hi * r.hi, z3 = z * z * z;
    const double p0 = gnc_poly3_(z, -0x1.5555555555549p-3, 0x1.111111110f86fp-7, -0x1.a01a019c10144p-13);
    const double p3 = gnc_poly3_(z, 0x1.71de3576572a3p-19, -0x1.ae5e651d24613p-26, 0x1.5d92ab7121f5p-33);
    return r.hi * z * (p0 + z3 * p3) + (r.lo - 0.5 * z * r.lo);
}

/* cos r for |r| <= pi/4 as a sum hi + lo. */
GNC_INLINE gnc_pair_ gnc_cos_sum_(gnc_pair_ r) {
    const double z = r.hi * r.hi, z3 = z * z * z;
    const double p0 = gnc_poly3_(z, 0x1.555555555554cp-5, -0x1.6c16c16c15171p-10, 0x1.a01a019cb0777p-16);
    const double p3 = gnc_poly3_(z, -0x1.27e4f808fa977p-22, 0x1.1ee9eb3b49805p-29, -0x1.8fae3f2878963p-37);
    const gnc_pair_ half = gnc_half_square_(r.hi);
    gnc_pair_ c = gnc_sum_sorted_(1.0, -half.hi);
    c.lo += z * z * (p0 + z3 * p3) - (half.lo + r.hi * r.lo);
    return c;
}

/* sin(a + quarters pi/2) from the reduced a: odd quarters take the cosine, and bit 1 is the sign. */
GNC_INLINE double gnc_sin_quarter_(gnc_pair_ r, uint64_t quarter) {
    const gnc_pair_ c = gnc_cos_sum_(r);
    const double sine = r.hi + gnc_sin_rest_(r), cosine = c.hi + c.lo;
    const double size = (quarter & 1u) != 0u ? cosine : sine;
    return gnc_from_bits_(gnc_bits_(size) ^ ((quarter & 2u) << 62));
}

/* sin x. |x| <= 2^20; max 0.83 ulp. */
GNC_INLINE double gnc_sin(double x) {
    const gnc_trig_parts_ p = gnc_trig_reduce_(gnc_fabs(x));
    const double size = gnc_sin_quarter_(p.r, p.quarter);
    const double y = gnc_from_bits_(gnc_bits_(size) ^ (gnc_bits_(x) & UINT64_C(0x8000000000000000)));
    return gnc_fabs(x) < gnc_inf_() ? y : gnc_nan_();
}

/* cos x. |x| <= 2^20; max 0.82 ulp. */
GNC_INLINE double gnc_cos(double x) {
    const gnc_trig_parts_ p = gnc_trig_reduce_(gnc_fabs(x));
    const double y = gnc_sin_quarter_(p.r, p.quarter + 1u);
    return gnc_fabs(x) < gnc_inf_() ? y : gnc_nan_();
}

/* tan x: sin/cos, or -cos/sin in odd quarters, in pairs. |x| <= 2^20; max 0.98 ulp. */
GNC_INLINE double gnc_tan(double x) {
    const gnc_trig_parts_ p = gnc_trig_reduce_(gnc_fabs(x));
    const uint64_t odd = p.quarter & 1u;
    const gnc_pair_ c_sum = gnc_cos_sum_(p.r);
    const gnc_pair_ c = gnc_sum_sorted_(c_sum.hi, c_sum.lo);
    const gnc_pair_ s = gnc_sum_sorted_(p.r.hi, gnc_sin_rest_(p.r));
    gnc_pair_ n, d;
    n.hi = odd != 0u ? c.hi : s.hi;
    n.lo = odd != 0u ? c.lo : s.lo;
    d.hi = odd != 0u ? s.hi : c.hi;
    d.lo = odd != 0u ? s.lo : c.lo;
    const gnc_pair_ q = gnc_quotient_(n, d);
    const uint64_t sign = (odd << 63) ^ (gnc_bits_(x) & UINT64_C(0x8000000000000000));
    const double y = gnc_from_bits_(gnc_bits_(q.hi + q.lo) ^ sign);
    return gnc_fabs(x) < gnc_inf_() ? y : gnc_nan_();
}

/* ---- Inverse trigonometry -------------------------------------------------------------------------- */

/* asin s - s for 0 <= |s| <= 1/2, with z = s^2. */
GNC_INLINE double gnc_asin_rest_(double s, double z) {
    const double z3 = z * z * z;
    const double p0 = gnc_poly3_(z, 0x1.5555555555578p-3, 0x1.333333332df03p-4, 0x1.6db6db722c0ffp-5);
    const double p3 = gnc_poly3_(z, 0x1.f1c71a8b6797ep-6, 0x1.6e8bdfeb9a267p-6, 0x1.1c49ddb2bbe11p-6);
    const double p6 = gnc_poly3_(z, 0x1.ca214ad90fdfbp-7, 0x1.75775d15e8432p-7, 0x1.618bad7f2dd26p-7);
    const double p9 = gnc_poly3_(z, 0x1.e14e431e5994fp-9, 0x1.65059a7991161p-6, -0x1.59fb2a41d42cp-6);
    return s * (z * (p0 + z3 * (p3 + z3 * (p6 + z3 * (p9 + z3 * 0x1.0be5bb89ed46fp-5)))));
}

/* asin of sqrt((1 - a)/2) for 1/2 <= a <= 1 as a sum; half the angle from a to 1, the root's rounding undone. */
GNC_INLINE gnc_pair_ gnc_asin_root_(double a) {
    const double z = a < 1.0 ? 0.5 - 0.5 * a : 0.0;
    const double root = GNC_ROOT_(z);
    const double square = root * root;
    const double missing = (z - square) - gnc_product_error_(root, root, square);
    gnc_pair_ s;
    s.hi = root;
    s.lo = gnc_asin_rest_(root, z) + missing / (root > 0.0 ? 2.0 * root : 1.0);
    return s;
}

/* pi/2 - 2 asin(sqrt((1 - a)/2)) for 1/2 <= a <= 1. */
GNC_INLINE double gnc_asin_far_(double a) {
    const gnc_pair_ root = gnc_asin_root_(a);
    const gnc_pair_ far = gnc_sum_sorted_(0x1.921fb54442d18p+0, -2.0 * root.hi);
    return far.hi + (far.lo + (0x1.1a62633145c07p-54 - 2.0 * root.lo));
}

/* |x| <= 1/2 directly. |x| <= 1; max 0.67 ulp. */
GNC_INLINE double gnc_asin(double x) {
    const double a = gnc_fabs(x);
    const double y = gnc_copysign(a <= 0.5 ? a + gnc_asin_rest_(a, a * a) : gnc_asin_far_(a), x);
    return a <= 1.0 ? y : gnc_nan_();
}

/* pi/2 - asin x for |x| <= 1/2. */
GNC_INLINE double gnc_acos_near_(double x) {
    const gnc_pair_ near = gnc_sum_sorted_(0x1.921fb54442d18p+0, -x);
    return near.hi + (near.lo + (0x1.1a62633145c07p-54 - gnc_asin_rest_(x, x * x)));
}

/* 2 asin(sqrt((1 - x)/2)) close to 1, pi minus that of -x close to -1. */
GNC_INLINE double gnc_acos_far_(double x) {
    const gnc_pair_ root = gnc_asin_root_(gnc_fabs(x));
    const gnc_pair_ near_minus_1 = gnc_sum_sorted_(0x1.921fb54442d18p+1, -2.0 * root.hi);
    const double y_minus_1 = near_minus_1.hi + (near_minus_1.lo + (0x1.1a62633145c07p-53 - 2.0 * root.lo));
    return x < 0.0 ? y_minus_1 : 2.0 * (root.hi + root.lo);
}

/* |x| <= 1; max 0.63 ulp. */
GNC_INLINE double gnc_acos(double x) {
    const double a = gnc_fabs(x);
    const double y = a <= 0.5 ? gnc_acos_near_(x) : gnc_acos_far_(x);
    return a <= 1.0 ? y : gnc_nan_();
}

/*
 * The angle of the point (x, y) for x, y >= 0, mirrored to the left half plane when left is not zero.
 * With t = tan of the distance to the nearest of 0, pi/4, pi/2, 3 pi/4, pi: |t| <= tan(pi/8), the angle is
 * m pi/4 +- atan t. t and the sums are pairs; pi/4 has three low bits free so that m pi/4 is exact.
 */
GNC_INLINE double gnc_angle_(double y, double x, uint64_t left) {
    const double small = y < x ? y : x, large = y < x ? x : y;
    const double up = large < 0x1p-800 ? 0x1p200 : 1.0;
    const double scale = large > 0x1p1000 ? 0x1p-4 : up;
    const double a = small * scale, b = large * scale;
    const gnc_pair_ difference = gnc_sum_sorted_(-b, a), sum = gnc_sum_sorted_(b, a);
    const double diagonal = a > 0x1.a8p-2 * b ? 1.0 : 0.0;
    gnc_pair_ n, d;
    n.hi = diagonal > 0.0 ? difference.hi : a;
    n.lo = diagonal > 0.0 ? difference.lo : 0.0;
    d.hi = diagonal > 0.0 ? sum.hi : b;
    d.lo = diagonal > 0.0 ? sum.lo : 0.0;
    d.hi = d.hi > 0.0 ? d.hi : 1.0; /* the origin has the angle of the x axis */
    const gnc_pair_ t = gnc_quotient_(n, d);
    const double z = t.hi * t.hi, z3 = z * z * z;
    const double p0 = gnc_poly3_(z, -0x1.555555555553dp-2, 0x1.99999999958d2p-3, -0x1.24924922b0755p-3);
    const double p3 = gnc_poly3_(z, 0x1.c71c70e75c178p-4, -0x1.745cf902e434bp-4, 0x1.3b111bcd3335dp-4);
    const double p6 = gnc_poly3_(z, -0x1.10ebd6af80c4fp-4, 0x1.df10ffbbe5372p-5, -0x1.9cda47412cfbep-5);
    const double p9 = 0x1.37e860ee2118p-5 - z * 0x1.259261c248288p-6;
    const double p = p0 + z3 * (p3 + z3 * (p6 + z3 * p9));
    /* For tiny t the remainder underflows to nonsense, and t itself is the angle. */
    const double t_lo = gnc_fabs(t.hi) < 0x1p-30 ? 0.0 : t.lo - t.lo * z;
    const double rest = t.hi * z * p + t_lo;

    const double m_octant = y > x ? 2.0 - diagonal : diagonal;
    const double flip_octant = y > x ? -1.0 : 1.0;
    const double m = left != 0u ? 4.0 - m_octant : m_octant;
    const double flip = left != 0u ? -flip_octant : flip_octant;
    const gnc_pair_ s = gnc_sum_sorted_(m * 0x1.921fb54442d18p-1, flip * t.hi);
    return s.hi + (s.lo + (m * 0x1.1a62633145c07p-55 + flip * rest));
}

/* atan x. All x; max 0.64 ulp. */
GNC_INLINE double gnc_atan(double x) {
    const double y = gnc_copysign(gnc_angle_(gnc_fabs(x), 1.0, 0u), x);
    return x == x ? y : gnc_nan_();
}

/* The angle of the point (x, y) in [-pi, pi]. All x and y; max 0.66 ulp. */
GNC_INLINE double gnc_atan2(double y, double x) {
    const double ay = gnc_fabs(y), ax = gnc_fabs(x), inf = gnc_inf_();
    const double ay_finite = ay < inf ? ay : (ax < inf ? ay : 1.0); /* both infinite: the diagonal */
    const double ax_finite = ay < inf ? ax : (ax < inf ? ax : 1.0);
    const double angle = gnc_angle_(ay_finite, ax_finite, gnc_bits_(x) >> 63);
    const double signed_angle = gnc_copysign(angle, y);
    const double y_ok = y == y ? signed_angle : gnc_nan_();
    return x == x ? y_ok : gnc_nan_();
}

#endif /* GNC_MATH_H */
