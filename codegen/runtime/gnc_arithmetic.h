/* SPDX-License-Identifier: MIT-0 */
/*
 * Refuse a compiler that was told to compute otherwise than the text says.
 *
 * The words of a controller, and the tests that keep NaN out of it, hold in IEEE 754 arithmetic only. Each of the flags
 * below changes last bits, the signs of zeros, or takes such tests away. What a compiler does not tell (gcc before
 * version 12 and clang tell of some only, none of fused operations) is found by its effect: by the functions at the end
 * when a controller or an allocator is initialised, and all of it by the replay of a package's vectors.
 *
 * What no compiler can tell, since the processor is switched when the program runs: subnormal numbers must be on (a
 * program that is linked with -ffast-math or -Ofast may switch them off), and rounding must be to nearest.
 */
#ifndef GNC_ARITHMETIC_H
#define GNC_ARITHMETIC_H

#include <stdint.h>

#if defined(__FAST_MATH__) || defined(_M_FP_FAST)
#error "gnc_math needs IEEE arithmetic: build without -ffast-math (-Ofast, /fp:fast)"
#endif
#if defined(__FINITE_MATH_ONLY__) && (__FINITE_MATH_ONLY__ != 0)
#error "gnc_math must see NaN and infinity: build without -ffinite-math-only"
#endif
#if defined(__ASSOCIATIVE_MATH__)
#error "gnc_math needs sums in their order: build without -fassociative-math and -funsafe-math-optimizations"
#endif
#if defined(__RECIPROCAL_MATH__)
#error "gnc_math needs divisions as they stand: build without -freciprocal-math and -funsafe-math-optimizations"
#endif
#if defined(__NO_SIGNED_ZEROS__)
#error "gnc_math needs the signs of zeros: build without -fno-signed-zeros"
#endif
#if defined(__FLT_EVAL_METHOD__) && (__FLT_EVAL_METHOD__ != 0)
#error "gnc_math needs arithmetic in the declared precision: FLT_EVAL_METHOD 0 (on x86: -msse2 -mfpmath=sse)"
#endif

/* ---- What only known answers tell --------------------------------------------------------------------- */

/* What the unit that includes this header was built to do: bits of what the functions below return. */
enum gnc_arithmetic_fault {
    GNC_FUSED = 1,     /* a product and a sum are rounded once: build with -ffp-contract=off */
    GNC_WIDER = 2,     /* numbers keep more digits than their type has */
    GNC_REORDERED = 4, /* sums are taken in another order */
    GNC_RECIPROCAL = 8 /* a division is a product with the reciprocal */
};

/* A unit that shall hold no double at all defines GNC_NO_DOUBLE. */
#ifndef GNC_NO_DOUBLE
/* Return the faults of arithmetic in double, 0 where it rounds to nearest as IEEE 754 says. Numbers come from a volatile
 * one and go into it, so that the processor computes and not the compiler; nothing overflows or is subnormal. */
static inline uint32_t gnc_arithmetic_faults(void) {
    volatile double kept = 0x1p-52; /* from one to the next number */
    const double step = kept;
    kept = 0x1p60;
    const double large = kept;
    kept = 1.0;
    const double one = kept;
    kept = 5.0;
    const double five = kept;
    const double near = one + step;
    kept = one + (step + step); /* near times near, rounded */
    const double square = kept;
    kept = (near * near) - square;
    const double fused = kept;
    kept = (one + (0.25 * step)) - one;
    const double wider = kept;
    kept = (large + one) - large;
    const double reordered = kept;
    kept = five / 3.0;
    const double quotient = kept;
    uint32_t faults = 0U;
    faults |= (fused != 0.0) ? (uint32_t)GNC_FUSED : 0U;
    faults |= (wider != 0.0) ? (uint32_t)GNC_WIDER : 0U;
    faults |= (reordered != 0.0) ? (uint32_t)GNC_REORDERED : 0U;
    faults |= (quotient != 0x1.aaaaaaaaaaaabp+0) ? (uint32_t)GNC_RECIPROCAL : 0U;
    return faults;
}
#endif

/* The same in float. */
static inline uint32_t gnc_arithmetic_faultsf(void) {
    volatile float kept = 0x1p-23F; /* from one to the next number */
    const float step = kept;
    kept = 0x1p30F;
    const float large = kept;
    kept = 1.0F;
    const float one = kept;
    kept = 5.0F;
    const float five = kept;
    const float near = one + step;
    kept = one + (step + step); /* near times near, rounded */
    const float square = kept;
    kept = (near * near) - square;
    const float fused = kept;
    kept = (one + (0.25F * step)) - one;
    const float wider = kept;
    kept = (large + one) - large;
    const float reordered = kept;
    kept = five / 3.0F;
    const float quotient = kept;
    uint32_t faults = 0U;
    faults |= (fused != 0.0F) ? (uint32_t)GNC_FUSED : 0U;
    faults |= (wider != 0.0F) ? (uint32_t)GNC_WIDER : 0U;
    faults |= (reordered != 0.0F) ? (uint32_t)GNC_REORDERED : 0U;
    faults |= (quotient != 0x1.aaaaaap+0F) ? (uint32_t)GNC_RECIPROCAL : 0U;
    return faults;
}

#endif
