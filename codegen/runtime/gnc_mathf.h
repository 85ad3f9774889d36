/* SPDX-License-Identifier: MIT-0 */
/*
 * Elementary functions with the same bits on every compiler and target: the float versions.
 *
 * The same methods as gnc_math.h, which explains them, in float arithmetic alone: no double operation, constant
 * or library call, so a processor whose unit has single precision only runs all of it in hardware. The build
 * options, the meaning of "max u ulp" and the deviations from Annex F are stated there too. Here the error is the
 * largest over every float in the range, against double arithmetic; for two arguments, over 10^8 random and
 * structured pairs.
 */
#ifndef GNC_MATHF_H
#define GNC_MATHF_H

#include <stdint.h>

#include "gnc_arithmetic.h"

/* 1 where loops over lanes shall become vector code, which computes both sides of a choice; where it is 0, a jump skips
 * what a small argument does not need. The bits are the same. */
#ifndef GNC_LANES
#define GNC_LANES 0
#endif
#ifndef GNC_INLINE
#define GNC_INLINE static inline
#endif

/*
 * The square root, and memcpy, which reads bits without breaking the aliasing rules. gcc and clang know them without a
 * header, and by these names -ffreestanding leaves no call of memcpy behind.
 */
#if defined(__GNUC__)
#define GNC_COPY_ __builtin_memcpy
#define GNC_ROOT_ __builtin_sqrt
#define GNC_ROOTF_ __builtin_sqrtf
#else
#include <math.h>
#include <string.h>
#define GNC_COPY_ memcpy
#define GNC_ROOT_ sqrt
#define GNC_ROOTF_ sqrtf
#endif

/* ---- Building blocks ------------------------------------------------------------------------------- */

typedef struct {
    float hi, lo;
} gnc_pairf_;

/* Adding and subtracting 1.5 * 2^23 rounds to an integer; the sum's low bits are that integer. */
#define GNC_ROUNDERF_ 0x1.8p23f

GNC_INLINE uint32_t gnc_bitsf_(float x) {
    uint32_t u;
    (void)GNC_COPY_(&u, &x, sizeof u);
    return u;
}

GNC_INLINE float gnc_from_bitsf_(uint32_t u) {
    float x;
    (void)GNC_COPY_(&x, &u, sizeof x);
    return x;
}

GNC_INLINE float gnc_nanf_(void) { return gnc_from_bitsf_(UINT32_C(0x7fc00000)); }
GNC_INLINE float gnc_inff_(void) { return gnc_from_bitsf_(UINT32_C(0x7f800000)); }

/* 2^k for -126 <= k <= 127; k is a two's complement integer, here and below. */
GNC_INLINE float gnc_exp2if_(uint32_t k) { return gnc_from_bitsf_((k + 127u) << 23); }

/* m 2^k for |k| < 250 and m near 1, in two steps since 2^k alone may overflow: the first is exact. */
GNC_INLINE float gnc_scalef_(float m, uint32_t k) {
    const uint32_t half = ((k + 512u) >> 1) - 256u;
    return (m * gnc_exp2if_(half)) * gnc_exp2if_(k - half);
}

/* a + b as a pair, for |a| >= |b| or a = 0. */
GNC_INLINE gnc_pairf_ gnc_sum_sortedf_(float a, float b) {
    gnc_pairf_ s;
    s.hi = a + b;
    s.lo = (a - s.hi) + b;
    return s;
}

/* a + b as a pair, for any a and b. */
GNC_INLINE gnc_pairf_ gnc_sumf_(float a, float b) {
    gnc_pairf_ s;
    s.hi = a + b;
    const float b_part = s.hi - a;
    s.lo = (a - (s.hi - b_part)) + (b - b_part);
    return s;
}

/* x rounded to 12 bits; x minus it has 12 as well, so products of such halves are exact. */
GNC_INLINE float gnc_headf_(float x) {
    return gnc_from_bitsf_((gnc_bitsf_(x) + UINT32_C(0x800)) & UINT32_C(0xfffff000));
}

/* The exact value of a b - product, where product is a b rounded (Dekker). */
GNC_INLINE float gnc_product_errorf_(float a, float b, float product) {
    const float ah = gnc_headf_(a), al = a - ah;
    const float bh = gnc_headf_(b), bl = b - bh;
    return (((ah * bh - product) + ah * bl) + al * bh) + al * bl;
}

/* x^2 / 2 as a sum whose larger part is exact. */
GNC_INLINE gnc_pairf_ gnc_half_squaref_(float x) {
    const float head = gnc_headf_(x);
    gnc_pairf_ h;
    h.hi = 0.5f * head * head;
    h.lo = 0.5f * (x - head) * (x + head);
    return h;
}

/* n / d as a pair: the quotient, and its remainder over d. Rounding the sum once makes it good to half an ulp. */
GNC_INLINE gnc_pairf_ gnc_quotientf_(gnc_pairf_ n, gnc_pairf_ d) {
    gnc_pairf_ q;
    q.hi = n.hi / d.hi;
    const float product = q.hi * d.hi;
    const float error = gnc_product_errorf_(q.hi, d.hi, product);
    q.lo = (((n.hi - product) - error) + (n.lo - q.hi * d.lo)) / d.hi;
    return q;
}

/* Polynomials are sums of such blocks times powers of x^3: independent work, so less waiting than Horner. */
GNC_INLINE float gnc_poly3f_(float x, float c0, float c1, float c2) { return c0 + x * (c1 + x * c2); }

/* ---- Exact functions ------------------------------------------------------------------------------- */

#if defined(__GNUC__) /* one instruction */
GNC_INLINE float gnc_fabsf(float x) { return __builtin_fabsf(x); }
#else
GNC_INLINE float gnc_fabsf(float x) { return gnc_from_bitsf_(gnc_bitsf_(x) & UINT32_C(0x7fffffff)); }
#endif

GNC_INLINE float gnc_copysignf(float x, float y) {
    const uint32_t sign = UINT32_C(0x80000000);
    return gnc_from_bitsf_((gnc_bitsf_(x) & ~sign) | (gnc_bitsf_(y) & sign));
}

/* 1, -1, or x itself when it is zero or NaN. */
GNC_INLINE float gnc_signf(float x) {
    const float negative = x < 0.0f ? -1.0f : x;
    return x > 0.0f ? 1.0f : negative;
}

/* The smaller and the larger, by one comparison: when it is false (equal, zeros of two signs, a NaN), the second. */
GNC_INLINE float gnc_minf(float x, float y) { return x < y ? x : y; }
GNC_INLINE float gnc_maxf(float x, float y) { return x > y ? x : y; }

/* The IEEE square root: 0.5 ulp. Never asked for a negative number: that NaN differs between processors. */
GNC_INLINE float gnc_sqrtf(float x) {
    const float root = GNC_ROOTF_(x > 0.0f ? x : 0.0f);
    const float keep_zero = x > 0.0f ? root : x;
    return x >= 0.0f ? keep_zero : gnc_nanf_();
}

/* An integer next to x, with the sign of x, for |x| < 2^23: adding 2^23 leaves no room for a fraction. */
GNC_INLINE float gnc_near_integerf_(float x) { return gnc_copysignf((gnc_fabsf(x) + 0x1p23f) - 0x1p23f, x); }

GNC_INLINE float gnc_floorf(float x) {
    const float near_x = gnc_near_integerf_(x);
    const float down = near_x - (near_x > x ? 1.0f : 0.0f);
    return gnc_fabsf(x) < 0x1p23f ? gnc_copysignf(down, x) : x;
}

GNC_INLINE float gnc_ceilf(float x) {
    const float near_x = gnc_near_integerf_(x);
    const float up = near_x + (near_x < x ? 1.0f : 0.0f);
    return gnc_fabsf(x) < 0x1p23f ? gnc_copysignf(up, x) : x; /* copysign: ceil(-0.5) is -0 */
}

/*
 * Remainder of x / y with the sign of x, exact for |x/y| < 2^23. With q the integer next to |x/y|, the
 * remainder |x| - q|y| is a float, so the product error gives it exactly; q may be one too large.
 */
GNC_INLINE float gnc_fmodf(float x, float y) {
    const float x_raw = gnc_fabsf(x), y_raw = gnc_fabsf(y);
    const float up = y_raw < 0x1p-70f ? 0x1p50f : 1.0f; /* keeps the product error from underflowing */
    const float scale = x_raw > 0x1p120f ? 0x1p-30f : up;
    const float back = scale > 1.0f ? 0x1p-50f : (scale < 1.0f ? 0x1p30f : 1.0f);
    const float a = x_raw * scale, b = y_raw * scale;
    const float ratio = a / b;
    const float q = (ratio + 0x1p23f) - 0x1p23f;
    const float product = q * b;
    const float rest = (a - product) - gnc_product_errorf_(q, b, product);
    const float in_range = (rest < 0.0f ? rest + b : rest) * back;
    const float far = ratio < 0x1p23f ? in_range : 0.0f;
    const float finite = x_raw < y_raw ? x_raw : far;
    const float checked = x_raw < gnc_inff_() ? gnc_copysignf(finite, x) : gnc_nanf_();
    const float nonzero = y_raw > 0.0f ? checked : gnc_nanf_();
    return x == x ? nonzero : gnc_nanf_();
}

/*
 * x less the whole multiple of y next to x, of two as near the even one: what IEEE 754 calls the remainder; exact for
 * |x/y| < 2^24. After fmod by 2 |y| the quotient left is below 2, and its parity is that of the whole one; the
 * differences of neighbours are exact.
 */
GNC_INLINE float gnc_remainderf(float x, float y) {
    const float b = gnc_fabsf(y);
    const float rest = gnc_fmodf(gnc_fabsf(x), b + b);
    const float past = rest - b;
    const float beyond = past + past >= b ? past - b : past;
    const float near_x = rest + rest <= b ? rest : beyond;
    const float found = gnc_copysignf(1.0f, x) * near_x;
    return rest == rest ? found : gnc_nanf_();
}

/* ---- Exponentials ---------------------------------------------------------------------------------- */

/* e^(x + x_lo) = 2^k (1 + r + t), |r| <= ln(2)/2, t of the order of r^2. */
typedef struct {
    float r, t;
    uint32_t k;
} gnc_exp_partsf_;

/* k is the integer next to x / ln 2. ln 2 is split so that k times its upper part (15 bits) is exact. */
GNC_INLINE gnc_exp_partsf_ gnc_exp_reducef_(float x, float x_lo) {
    const float shifted = x * 0x1.715476p+0f + GNC_ROUNDERF_;
    const float k = shifted - GNC_ROUNDERF_;
    const gnc_pairf_ r = gnc_sumf_(x - k * 0x1.62e4p-1f, x_lo - k * 0x1.7f7d1cp-20f);
    const float r2 = r.hi * r.hi, r3 = r.hi * r2;
    const float p0 = gnc_poly3f_(r.hi, 0x1.555556p-3f, 0x1.555556p-5f, 0x1.1110b2p-7f);
    const float p3 = gnc_poly3f_(r.hi, 0x1.6c164ap-10f, 0x1.a16f16p-13f, 0x1.a16514p-16f);
    const float p = p0 + r3 * p3;
    gnc_exp_partsf_ e;
    e.r = r.hi;
    e.t = (0.5f * r2 + r3 * p) + (r.lo + r.lo * r.hi);
    e.k = gnc_bitsf_(shifted) - gnc_bitsf_(GNC_ROUNDERF_);
    return e;
}

/* e^x. All x; max 0.76 ulp. */
GNC_INLINE float gnc_expf(float x) {
    const float capped = x > 89.0f ? 89.0f : x; /* the cap overflows, the floor rounds to zero */
    const gnc_exp_partsf_ e = gnc_exp_reducef_(capped < -104.0f ? -104.0f : capped, 0.0f);
    const gnc_pairf_ s = gnc_sum_sortedf_(1.0f, e.r);
    const float y = gnc_scalef_(s.hi + (s.lo + e.t), e.k);
    return x == x ? y : gnc_nanf_();
}

/* e^x = 2^k exp and e^x - 1 = 2^k minus_1, both pairs; shrink = 2^-k, or 2^-30 where less makes no difference. */
typedef struct {
    gnc_pairf_ exp, minus_1;
    float shrink;
    uint32_t k;
} gnc_expm1_partsf_;

/* For -18 <= x <= 90. Near k = 0 or -1 the terms 1 - 2^-k and r cancel: their sum must be exact. */
GNC_INLINE gnc_expm1_partsf_ gnc_expm1_reducef_(float x) {
    const gnc_exp_partsf_ e = gnc_exp_reducef_(x, 0.0f);
    const float shrink = x > 21.0f ? 0x1p-30f : gnc_exp2if_(0u - e.k);
    const gnc_pairf_ base = gnc_sum_sortedf_(1.0f, -shrink);
    const gnc_pairf_ m = gnc_sum_sortedf_(base.hi, e.r);
    const gnc_pairf_ s = gnc_sum_sortedf_(1.0f, e.r);
    gnc_expm1_partsf_ p;
    p.exp = gnc_sum_sortedf_(s.hi, s.lo + e.t);
    p.minus_1 = gnc_sum_sortedf_(m.hi, m.lo + (base.lo + e.t));
    p.shrink = shrink;
    p.k = e.k;
    return p;
}

/* e^x - 1. All x; max 0.90 ulp. */
GNC_INLINE float gnc_expm1f(float x) {
    const float capped = x > 89.0f ? 89.0f : x;
    const gnc_expm1_partsf_ e = gnc_expm1_reducef_(capped < -18.0f ? -18.0f : capped);
    const float y = gnc_scalef_(e.minus_1.hi + e.minus_1.lo, e.k);
    const float finite = x == 0.0f ? x : y; /* keeps -0 */
    return x == x ? finite : gnc_nanf_();
}

/* (E + E/(E + 1))/2 with E = e^|x| - 1: no cancellation near zero. All x; max 1.10 ulp. */
GNC_INLINE float gnc_sinhf(float x) {
    const float a = gnc_fabsf(x);
    const gnc_expm1_partsf_ e = gnc_expm1_reducef_(a > 90.0f ? 90.0f : a);
    const float q = e.minus_1.hi / e.exp.hi;
    const gnc_pairf_ s = gnc_sum_sortedf_(e.minus_1.hi, e.shrink * q);
    const float lo = s.lo + (e.minus_1.lo + e.shrink * (e.minus_1.lo - q * e.exp.lo));
    const float y = gnc_copysignf(gnc_scalef_(s.hi + lo, e.k - 1u), x);
    return x == x ? y : gnc_nanf_();
}

/* (e^|x| + 1/e^|x|)/2. All x; max 0.65 ulp. */
GNC_INLINE float gnc_coshf(float x) {
    const float a = gnc_fabsf(x);
    const gnc_expm1_partsf_ e = gnc_expm1_reducef_(a > 90.0f ? 90.0f : a);
    const float q = (e.shrink * e.shrink) / e.exp.hi;
    const gnc_pairf_ s = gnc_sum_sortedf_(e.exp.hi, q);
    const float y = gnc_scalef_(s.hi + (s.lo + (e.exp.lo - q * e.exp.lo)), e.k - 1u);
    return x == x ? y : gnc_nanf_();
}

/* tanh(5 j/32) as a pair. */
GNC_INLINE gnc_pairf_ gnc_tanh_nodef_(uint32_t j) {
    static const float node[64][2] = {
        {0x0.0p+0f, 0x0.0p+0f}, {0x1.3d6bc8p-3f, -0x1.3bdcf6p-29f}, {0x1.35f98ap-2f, 0x1.d4ca1cp-31f},
        {0x1.bfae6ap-2f, 0x1.72e49cp-27f}, {0x1.1bf47ep-1f, 0x1.5771f2p-26f}, {0x1.4e8d8ap-1f, -0x1.49fde4p-26f},
        {0x1.77d838p-1f, 0x1.c680bp-26f}, {0x1.98b346p-1f, 0x1.d048cap-28f}, {0x1.b2523cp-1f, -0x1.253484p-27f},
        {0x1.c5fce8p-1f, 0x1.840af8p-29f}, {0x1.d4e6f4p-1f, 0x1.90a1acp-27f}, {0x1.e01bd4p-1f, 0x1.d30c34p-26f},
        {0x1.e8789ep-1f, 0x1.9d81bcp-26f}, {0x1.eeaddcp-1f, -0x1.3a5cb4p-26f}, {0x1.f3451ep-1f, 0x1.133c42p-30f},
        {0x1.f6a7c4p-1f, 0x1.aeddd4p-26f}, {0x1.f92582p-1f, 0x1.829c7p-27f}, {0x1.fafa14p-1f, -0x1.a28ccep-28f},
        {0x1.fc51f6p-1f, -0x1.2c7f04p-26f}, {0x1.fd4e2p-1f, -0x1.4d3f36p-26f}, {0x1.fe06ecp-1f, -0x1.f2efbep-26f},
        {0x1.fe8e48p-1f, 0x1.c61a2cp-27f}, {0x1.fef168p-1f, 0x1.2e912ep-28f}, {0x1.ff39fap-1f, -0x1.a7cdfap-27f},
        {0x1.ff6f18p-1f, -0x1.62ae24p-27f}, {0x1.ff95f8p-1f, -0x1.2ce19p-27f}, {0x1.ffb26ap-1f, 0x1.4f02f4p-26f},
        {0x1.ffc73cp-1f, -0x1.9cc90ep-31f}, {0x1.ffd678p-1f, -0x1.e612ap-27f}, {0x1.ffe19cp-1f, 0x1.91b242p-26f},
        {0x1.ffe9c4p-1f, 0x1.b5976p-27f}, {0x1.ffefbcp-1f, -0x1.1b3c5ep-28f}, {0x1.fff41ap-1f, -0x1.32e41ep-26f},
        {0x1.fff74cp-1f, -0x1.ef0c6cp-26f}, {0x1.fff9a2p-1f, -0x1.85ea0ap-26f}, {0x1.fffb56p-1f, 0x1.cd9c02p-26f},
        {0x1.fffc98p-1f, -0x1.c987f2p-26f}, {0x1.fffd82p-1f, -0x1.3feb2p-26f}, {0x1.fffe2cp-1f, 0x1.8ab262p-26f},
        {0x1.fffeaap-1f, 0x1.5683dcp-28f}, {0x1.ffff06p-1f, -0x1.72ce6ep-29f}, {0x1.ffff4ap-1f, -0x1.f0ce2p-26f},
        {0x1.ffff7ap-1f, 0x1.166f42p-28f}, {0x1.ffff9ep-1f, 0x1.01b80ap-29f}, {0x1.ffffb8p-1f, 0x1.640478p-27f},
        {0x1.ffffccp-1f, -0x1.b01ac2p-27f}, {0x1.ffffdap-1f, -0x1.69363p-27f}, {0x1.ffffe4p-1f, -0x1.e732eep-30f},
        {0x1.ffffecp-1f, -0x1.0eb872p-26f}, {0x1.fffffp-1f, 0x1.f63126p-26f}, {0x1.fffff6p-1f, -0x1.f9fbecp-26f},
        {0x1.fffff8p-1f, -0x1.40edc4p-30f}, {0x1.fffffap-1f, 0x1.e50522p-29f}, {0x1.fffffcp-1f, -0x1.3655ap-27f},
        {0x1.fffffcp-1f, 0x1.b420dep-26f}, {0x1.fffffep-1f, -0x1.368a7cp-27f}, {0x1.fffffep-1f, 0x1.42745ep-27f},
        {0x1.fffffep-1f, 0x1.88c83p-26f}, {0x1.0p+0f, -0x1.cdcf18p-26f}, {0x1.0p+0f, -0x1.51dddep-26f},
        {0x1.0p+0f, -0x1.ee6086p-27f}, {0x1.0p+0f, -0x1.69b1a8p-27f}, {0x1.0p+0f, -0x1.089ef8p-27f},
        {0x1.0p+0f, -0x1.8333ap-28f}};
    gnc_pairf_ t;
    t.hi = node[j][0];
    t.lo = node[j][1];
    return t;
}

/* From the tanh of a neighbour, as gnc_tanh. All x; max 0.58 ulp. */
GNC_INLINE float gnc_tanhf(float x) {
    const float a = gnc_fabsf(x), shifted = a * 6.4f + GNC_ROUNDERF_;
    const float h = a - (shifted - GNC_ROUNDERF_) * 0.15625f, z = h * h;
    const gnc_pairf_ t = gnc_tanh_nodef_(gnc_bitsf_(shifted) & 0x3fu);
    const float w = ((1.0f - t.hi) - t.lo) * (1.0f + t.hi);
    const float g = gnc_from_bitsf_((gnc_bitsf_(w) + UINT32_C(0x200000)) & UINT32_C(0xffc00000));
    const float w_rest = t.hi < 0.7f ? (1.0f - g) - t.hi * t.hi : w - g;
    const float rest = h * z * (-0x1.555544p-2f + z * 0x1.1064ccp-3f); /* tanh h - h */
    const float ts = t.hi * (h + rest), gh = g * h;
    const float q = ((w_rest * h + w * rest) - gh * ts) / (1.0f + ts);
    const gnc_pairf_ y = gnc_sum_sortedf_(t.hi, gh);
    const float size = y.hi + (y.lo + (t.lo + q));
    const float y_ok = gnc_copysignf(a < 9.0625f ? size : 1.0f, x);
    return x == x ? y_ok : gnc_nanf_();
}

/* ---- Error function -------------------------------------------------------------------------------- */

/* For |x| < 1. */
GNC_INLINE float gnc_erf_nearf_(float x) {
    const float s = x * x, s3 = s * s * s;
    const float p_high = gnc_poly3f_(s, -0.026855126f, 0.00519073382f, -0.000803076313f) + s3 * 7.92038627e-05f;
    const float p = gnc_poly3f_(s, 0.128379166f, -0.376126289f, 0.112836182f) + s3 * p_high;
    return x + x * p;
}

/* For 1 <= |x|; Q of (|x| - 2)/(|x| + 2) here. */
GNC_INLINE float gnc_erf_farf_(float x) {
    const float a = gnc_fabsf(x);
    const float b = a < 4.0f ? a : 4.0f;
    const float t = (b - 2.0f) / (b + 2.0f);
    const float q_high = gnc_poly3f_(t, -0.0789869055f, 0.00372974039f, 0.00721255178f);
    const float q = gnc_poly3f_(t, 0.255395681f, -0.427185863f, 0.241657272f) + (t * t * t) * q_high;
    return gnc_copysignf(1.0f - gnc_expf(-(b * b)) * q, x);
}

/* All x; max 1.40 ulp. */
GNC_INLINE float gnc_erff(float x) {
    const float y = gnc_fabsf(x) < 1.0f ? gnc_erf_nearf_(x) : gnc_erf_farf_(x);
    return x == x ? y : gnc_nanf_();
}

/* ---- Logarithms ------------------------------------------------------------------------------------ */

/* x = 2^k m with sqrt(1/2) <= m < sqrt(2), so that log m stays small when k = 0. */
typedef struct {
    float m, k;
    uint32_t k_bits;
} gnc_log_partsf_;

GNC_INLINE gnc_log_partsf_ gnc_log_reducef_(float x) {
    const float up = x < 0x1p-126f ? 0x1p25f : 1.0f; /* subnormal numbers have no exponent to read */
    const uint32_t bits = gnc_bitsf_(x * up);
    const uint32_t biased = (bits - UINT32_C(0x3f3504f3) + UINT32_C(0x40000000)) >> 23;
    gnc_log_partsf_ p;
    p.m = gnc_from_bitsf_(bits - ((biased - 128u) << 23));
    p.k = (gnc_from_bitsf_(gnc_bitsf_(0x1p23f) + biased) - (0x1p23f + 128.0f)) - (up > 1.0f ? 25.0f : 0.0f);
    p.k_bits = biased - 128u;
    return p;
}

/*
 * k ln 2 + log(1 + f) + f_lo. With s = f/(2 + f), log(1 + f) = 2 atanh(s) = f - f^2/2 + s (f^2/2 + s^2 P(s^2)).
 * The sums from large to small keep their errors.
 */
GNC_INLINE float gnc_log_sumf_(float k, float f, float f_lo) {
    const float s = f / (2.0f + f), z = s * s;
    const float p = z * gnc_poly3f_(z, 0x1.55557ap-1f, 0x1.995eb2p-2f, 0x1.31e3dep-2f);
    const gnc_pairf_ half = gnc_half_squaref_(f);
    const gnc_pairf_ b = gnc_sum_sortedf_(f, -half.hi);
    const gnc_pairf_ a = gnc_sum_sortedf_(k * 0x1.62e4p-1f, b.hi);
    const float small = (b.lo - half.lo) + s * (0.5f * f * f + p);
    return a.hi + (a.lo + (small + (k * 0x1.7f7d1cp-20f + f_lo)));
}

/* Natural logarithm. All x; max 0.66 ulp. */
GNC_INLINE float gnc_logf(float x) {
    const gnc_log_partsf_ p = gnc_log_reducef_(x);
    const float y = gnc_log_sumf_(p.k, p.m - 1.0f, 0.0f);
    const float finite = x < gnc_inff_() ? y : x;
    const float positive = x > 0.0f ? finite : -gnc_inff_();
    return x >= 0.0f ? positive : gnc_nanf_();
}

/* log(1 + x): what is lost in rounding 1 + x comes back as a correction. All x; max 0.66 ulp. */
GNC_INLINE float gnc_log1pf(float x) {
    const gnc_pairf_ u = gnc_sumf_(1.0f, x);
    const gnc_log_partsf_ p = gnc_log_reducef_(u.hi);
    const float lost = u.lo * gnc_exp2if_(0u - (x < 0x1p60f ? p.k_bits : 60u));
    const gnc_pairf_ f = gnc_sum_sortedf_(p.m - 1.0f, lost);
    const float y = gnc_log_sumf_(p.k, f.hi, f.lo - f.lo * f.hi);
    const float finite = x < gnc_inff_() ? y : x;
    const float nonzero = x == 0.0f ? x : finite;
    const float above = x > -1.0f ? nonzero : -gnc_inff_();
    return x >= -1.0f ? above : gnc_nanf_();
}

/* ---- Power ----------------------------------------------------------------------------------------- */

/*
 * log x as a pair good to about 2^-36, for x > 0 and finite: y log x reaches 104, so a power needs seven bits
 * more than a float. 2 atanh(s) = s (2 + z (2/3 + z P(z))), z = s^2, with every sum but P's in pairs.
 */
GNC_INLINE gnc_pairf_ gnc_log_pairf_(float x) {
    const gnc_log_partsf_ parts = gnc_log_reducef_(x);
    gnc_pairf_ n, s, z, c, g, u, l;
    n.hi = parts.m - 1.0f;
    n.lo = 0.0f;
    s = gnc_quotientf_(n, gnc_sum_sortedf_(1.0f, parts.m));
    z.hi = s.hi * s.hi;
    z.lo = gnc_product_errorf_(s.hi, s.hi, z.hi) + 2.0f * s.hi * s.lo;
    const float p = gnc_poly3f_(z.hi, 0x1.999ap-2f, 0x1.24529p-2f, 0x1.df9e82p-3f);
    c = gnc_sum_sortedf_(0x1.555556p-1f, z.hi * p);
    c.lo += z.lo * p - 0x1.555556p-26f;
    g.hi = z.hi * c.hi;
    g.lo = gnc_product_errorf_(z.hi, c.hi, g.hi) + (z.hi * c.lo + z.lo * c.hi);
    u = gnc_sum_sortedf_(2.0f, g.hi);
    u.lo += g.lo;
    l.hi = s.hi * u.hi;
    l.lo = gnc_product_errorf_(s.hi, u.hi, l.hi) + (s.hi * u.lo + s.lo * u.hi);
    const gnc_pairf_ sum = gnc_sum_sortedf_(parts.k * 0x1.62e4p-1f, l.hi);
    return gnc_sum_sortedf_(sum.hi, sum.lo + (l.lo + parts.k * 0x1.7f7d1cp-20f));
}

/* x^y = e^(y log x). All x and y; max 0.77 ulp. */
GNC_INLINE float gnc_powf(float x, float y) {
    const float a = gnc_fabsf(x), b = gnc_fabsf(y), inf = gnc_inff_();
    /* |log a| >= 2^-24 unless a = 1, so a larger |y| than 2^40 overflows or underflows all the same. */
    const float power = gnc_copysignf(b > 0x1p40f ? 0x1p40f : b, y);
    const gnc_pairf_ l = gnc_log_pairf_(a);
    gnc_pairf_ e;
    e.hi = power * l.hi;
    e.lo = gnc_product_errorf_(power, l.hi, e.hi) + power * l.lo;
    const float e_hi = gnc_fabsf(e.hi) < 130.0f ? e.hi : gnc_copysignf(130.0f, e.hi);
    const float e_lo = gnc_fabsf(e.hi) < 130.0f ? e.lo : 0.0f;
    const gnc_exp_partsf_ parts = gnc_exp_reducef_(e_hi, e_lo);
    const gnc_pairf_ s = gnc_sum_sortedf_(1.0f, parts.r);
    const float size = gnc_scalef_(s.hi + (s.lo + parts.t), parts.k);

    const float of_zero = y < 0.0f ? inf : 0.0f;
    const float of_inf = y < 0.0f ? 0.0f : inf;
    const float from_zero = a > 0.0f ? size : of_zero;
    const float magnitude = a < inf ? from_zero : of_inf;
    /* Doubles from 2^24 on are even. y is an integer (odd) when rounding y (y/2) changes nothing (something). */
    const float whole = b < 0x1p23f ? (b + 0x1p23f) - 0x1p23f : b;
    const float half = 0.5f * b;
    const float whole_half = half < 0x1p23f ? (half + 0x1p23f) - 0x1p23f : half;
    const float odd_sign = whole_half == half ? 1.0f : gnc_copysignf(1.0f, x);
    const float of_integer = gnc_copysignf(magnitude, odd_sign);
    const float finite_base = a > 0.0f ? gnc_nanf_() : magnitude;
    const float of_fraction = a < inf ? finite_base : magnitude;
    const float negative = whole == b ? of_integer : of_fraction;
    const float any_base = gnc_copysignf(1.0f, x) < 0.0f ? negative : magnitude;
    const float y_ok = y == y ? any_base : gnc_nanf_();
    const float ok = x == x ? y_ok : gnc_nanf_();
    const float y_zero = y == 0.0f ? 1.0f : ok; /* 1 even for a NaN base, by Annex F */
    return x == 1.0f ? 1.0f : y_zero;
}

/* ---- Trigonometry ---------------------------------------------------------------------------------- */

/* a = quarter pi/2 + r, with r a pair. */
typedef struct {
    gnc_pairf_ r;
    uint32_t quarter;
} gnc_trig_partsf_;

/*
 * For a >= 0. pi/2 comes in four parts of 11 bits and one of 24: for a count n below 2^13 the first four
 * products with n are exact. So are the first two differences, and the sums keep their errors, so r is good even
 * where a is next to a multiple of pi/2.
 */
GNC_INLINE gnc_trig_partsf_ gnc_trig_reduce_farf_(float a) {
    const float x = a <= 0x1p17f ? a : 0.0f;
    const float shifted = x * 0x1.45f306p-1f + GNC_ROUNDERF_;
    const float n = shifted - GNC_ROUNDERF_;
    const float r2 = (x - n * 0x1.92p+0f) - n * 0x1.fb4p-12f;
    const gnc_pairf_ r3 = gnc_sumf_(r2, -(n * 0x1.444p-24f));
    const gnc_pairf_ r4 = gnc_sumf_(r3.hi, -(n * 0x1.68cp-39f));
    gnc_trig_partsf_ p;
    p.r = gnc_sum_sortedf_(r4.hi, (r3.lo + r4.lo) - n * 0x1.1a6264p-54f);
    p.quarter = gnc_bitsf_(shifted);
    return p;
}

/* For a >= 0. Below pi/4 nothing is taken off, and the steps above would give a itself. */
GNC_INLINE gnc_trig_partsf_ gnc_trig_reducef_(float a) {
    gnc_trig_partsf_ p = {{a, 0.0f}, 0u};
    if ((GNC_LANES != 0) || !(a <= 0.785f)) {
        p = gnc_trig_reduce_farf_(a);
    }
    return p;
}

/* sin r - r for |r| <= pi/4, where cos r, the slope of the correction by r.lo, is 1 - r^2/2. */
GNC_INLINE float gnc_sin_restf_(gnc_pairf_ r) {
    const float z = r.hi * r.hi;
    const float p = gnc_poly3f_(z, -0x1.555546p-3f, 0x1.11075ep-7f, -0x1.994db8p-13f);
    return r.hi * z * p + (r.lo - 0.5f * z * r.lo);
}

/* cos r for |r| <= pi/4 as a sum hi + lo. */
GNC_INLINE gnc_pairf_ gnc_cos_sumf_(gnc_pairf_ r) {
    const float z = r.hi * r.hi;
    const float p = gnc_poly3f_(z, 0x1.55554ap-5f, -0x1.6c0c88p-10f, 0x1.9a017ap-16f);
    const gnc_pairf_ half = gnc_half_squaref_(r.hi);
    gnc_pairf_ c = gnc_sum_sortedf_(1.0f, -half.hi);
    c.lo += z * z * p - (half.lo + r.hi * r.lo);
    return c;
}

/* sin(a + quarters pi/2) from the reduced a: odd quarters take the cosine, and bit 1 is the sign. */
GNC_INLINE float gnc_sin_quarterf_(gnc_pairf_ r, uint32_t quarter) {
    const gnc_pairf_ c = gnc_cos_sumf_(r);
    const float sine = r.hi + gnc_sin_restf_(r), cosine = c.hi + c.lo;
    const float size = (quarter & 1u) != 0u ? cosine : sine;
    return gnc_from_bitsf_(gnc_bitsf_(size) ^ ((quarter & 2u) << 30));
}

/* sin x. |x| <= 1e4; max 0.81 ulp. */
GNC_INLINE float gnc_sinf(float x) {
    const gnc_trig_partsf_ p = gnc_trig_reducef_(gnc_fabsf(x));
    const float size = gnc_sin_quarterf_(p.r, p.quarter);
    const float y = gnc_from_bitsf_(gnc_bitsf_(size) ^ (gnc_bitsf_(x) & UINT32_C(0x80000000)));
    return gnc_fabsf(x) < gnc_inff_() ? y : gnc_nanf_();
}

/* cos x. |x| <= 1e4; max 0.83 ulp. */
GNC_INLINE float gnc_cosf(float x) {
    const gnc_trig_partsf_ p = gnc_trig_reducef_(gnc_fabsf(x));
    const float y = gnc_sin_quarterf_(p.r, p.quarter + 1u);
    return gnc_fabsf(x) < gnc_inff_() ? y : gnc_nanf_();
}

/* tan x: sin/cos, or -cos/sin in odd quarters, in pairs. |x| <= 1e4; max 0.99 ulp. */
GNC_INLINE float gnc_tanf(float x) {
    const gnc_trig_partsf_ p = gnc_trig_reducef_(gnc_fabsf(x));
    const uint32_t odd = p.quarter & 1u;
    const gnc_pairf_ c_sum = gnc_cos_sumf_(p.r);
    const gnc_pairf_ c = gnc_sum_sortedf_(c_sum.hi, c_sum.lo);
    const gnc_pairf_ s = gnc_sum_sortedf_(p.r.hi, gnc_sin_restf_(p.r));
    gnc_pairf_ n, d;
    n.hi = odd != 0u ? c.hi : s.hi;
    n.lo = odd != 0u ? c.lo : s.lo;
    d.hi = odd != 0u ? s.hi : c.hi;
    d.lo = odd != 0u ? s.lo : c.lo;
    const gnc_pairf_ q = gnc_quotientf_(n, d);
    const uint32_t sign = (odd << 31) ^ (gnc_bitsf_(x) & UINT32_C(0x80000000));
    const float y = gnc_from_bitsf_(gnc_bitsf_(q.hi + q.lo) ^ sign);
    return gnc_fabsf(x) < gnc_inff_() ? y : gnc_nanf_();
}

/* ---- Inverse trigonometry -------------------------------------------------------------------------- */

/* asin s - s for 0 <= |s| <= 1/2, with z = s^2. */
GNC_INLINE float gnc_asin_restf_(float s, float z) {
    const float z3 = z * z * z;
    const float p0 = gnc_poly3f_(z, 0x1.55554cp-3f, 0x1.333892p-4f, 0x1.6cabb4p-5f);
    const float p3 = gnc_poly3f_(z, 0x1.04ab0ap-5f, 0x1.d7a75ep-7f, 0x1.33d75p-5f);
    return s * (z * (p0 + z3 * p3));
}

/* asin of sqrt((1 - a)/2) for 1/2 <= a <= 1 as a sum; half the angle from a to 1, the root's rounding undone. */
GNC_INLINE gnc_pairf_ gnc_asin_rootf_(float a) {
    const float z = a < 1.0f ? 0.5f - 0.5f * a : 0.0f;
    const float root = GNC_ROOTF_(z);
    const float square = root * root;
    const float missing = (z - square) - gnc_product_errorf_(root, root, square);
    gnc_pairf_ s;
    s.hi = root;
    s.lo = gnc_asin_restf_(root, z) + missing / (root > 0.0f ? 2.0f * root : 1.0f);
    return s;
}

/* pi/2 - 2 asin(sqrt((1 - a)/2)) for 1/2 <= a <= 1. */
GNC_INLINE float gnc_asin_farf_(float a) {
    const gnc_pairf_ root = gnc_asin_rootf_(a);
    const gnc_pairf_ far = gnc_sum_sortedf_(0x1.921fb6p+0f, -2.0f * root.hi);
    return far.hi + (far.lo + (-0x1.777a5cp-25f - 2.0f * root.lo));
}

/* |x| <= 1/2 directly. |x| <= 1; max 0.66 ulp. */
GNC_INLINE float gnc_asinf(float x) {
    const float a = gnc_fabsf(x);
    const float y = gnc_copysignf(a <= 0.5f ? a + gnc_asin_restf_(a, a * a) : gnc_asin_farf_(a), x);
    return a <= 1.0f ? y : gnc_nanf_();
}

/* pi/2 - asin x for |x| <= 1/2. */
GNC_INLINE float gnc_acos_nearf_(float x) {
    const gnc_pairf_ near = gnc_sum_sortedf_(0x1.921fb6p+0f, -x);
    return near.hi + (near.lo + (-0x1.777a5cp-25f - gnc_asin_restf_(x, x * x)));
}

/* 2 asin(sqrt((1 - x)/2)) close to 1, pi minus that of -x close to -1. */
GNC_INLINE float gnc_acos_farf_(float x) {
    const gnc_pairf_ root = gnc_asin_rootf_(gnc_fabsf(x));
    const gnc_pairf_ near_minus_1 = gnc_sum_sortedf_(0x1.921fb6p+1f, -2.0f * root.hi);
    const float y_minus_1 = near_minus_1.hi + (near_minus_1.lo + (-0x1.777a5cp-24f - 2.0f * root.lo));
    return x < 0.0f ? y_minus_1 : 2.0f * (root.hi + root.lo);
}

/* |x| <= 1; max 0.65 ulp. */
GNC_INLINE float gnc_acosf(float x) {
    const float a = gnc_fabsf(x);
    const float y = a <= 0.5f ? gnc_acos_nearf_(x) : gnc_acos_farf_(x);
    return a <= 1.0f ? y : gnc_nanf_();
}

/*
 * The angle of the point (x, y) for x, y >= 0, mirrored to the left half plane when left is not zero.
 * With t = tan of the distance to the nearest of 0, pi/4, pi/2, 3 pi/4, pi: |t| <= tan(pi/8), the angle is
 * m pi/4 +- atan t. t and the sums are pairs; pi/4 has three low bits free so that m pi/4 is exact.
 */
GNC_INLINE float gnc_anglef_(float y, float x, uint32_t left) {
    const float small = y < x ? y : x, large = y < x ? x : y;
    const float up = large < 0x1p-40f ? 0x1p70f : 1.0f;
    const float scale = large > 0x1p120f ? 0x1p-4f : up;
    const float a = small * scale, b = large * scale;
    const gnc_pairf_ difference = gnc_sum_sortedf_(-b, a), sum = gnc_sum_sortedf_(b, a);
    const float diagonal = a > 0x1.a8p-2f * b ? 1.0f : 0.0f;
    gnc_pairf_ n, d;
    n.hi = diagonal > 0.0f ? difference.hi : a;
    n.lo = diagonal > 0.0f ? difference.lo : 0.0f;
    d.hi = diagonal > 0.0f ? sum.hi : b;
    d.lo = diagonal > 0.0f ? sum.lo : 0.0f;
    d.hi = d.hi > 0.0f ? d.hi : 1.0f; /* the origin has the angle of the x axis */
    const gnc_pairf_ t = gnc_quotientf_(n, d);
    const float z = t.hi * t.hi, z3 = z * z * z;
    const float p0 = gnc_poly3f_(z, -0x1.555554p-2f, 0x1.99991ap-3f, -0x1.247f04p-3f);
    const float p3 = gnc_poly3f_(z, 0x1.c467b4p-4f, -0x1.5b43a4p-4f, 0x1.84ee0ep-5f);
    const float p = p0 + z3 * p3;
    /* For tiny t the remainder underflows to nonsense, and t itself is the angle. */
    const float t_lo = gnc_fabsf(t.hi) < 0x1p-14f ? 0.0f : t.lo - t.lo * z;
    const float rest = t.hi * z * p + t_lo;

    const float m_octant = y > x ? 2.0f - diagonal : diagonal;
    const float flip_octant = y > x ? -1.0f : 1.0f;
    const float m = left != 0u ? 4.0f - m_octant : m_octant;
    const float flip = left != 0u ? -flip_octant : flip_octant;
    const gnc_pairf_ s = gnc_sum_sortedf_(m * 0x1.921fbp-1f, flip * t.hi);
    return s.hi + (s.lo + (m * 0x1.5110b4p-23f + flip * rest));
}

/* atan x. All x; max 0.72 ulp. */
GNC_INLINE float gnc_atanf(float x) {
    const float y = gnc_copysignf(gnc_anglef_(gnc_fabsf(x), 1.0f, 0u), x);
    return x == x ? y : gnc_nanf_();
}

/* The angle of the point (x, y) in [-pi, pi]. All x and y; max 0.72 ulp. */
GNC_INLINE float gnc_atan2f(float y, float x) {
    const float ay = gnc_fabsf(y), ax = gnc_fabsf(x), inf = gnc_inff_();
    const float ay_finite = ay < inf ? ay : (ax < inf ? ay : 1.0f); /* both infinite: the diagonal */
    const float ax_finite = ay < inf ? ax : (ax < inf ? ax : 1.0f);
    const float angle = gnc_anglef_(ay_finite, ax_finite, gnc_bitsf_(x) >> 31);
    const float signed_angle = gnc_copysignf(angle, y);
    const float y_ok = y == y ? signed_angle : gnc_nanf_();
    return x == x ? y_ok : gnc_nanf_();
}

#endif /* GNC_MATHF_H */
