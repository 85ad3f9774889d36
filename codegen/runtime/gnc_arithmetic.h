/* SPDX-License-Identifier: MIT-0 */
/*
 * Refuse a compiler that was told to compute otherwise than the text says.
 *
 * The words of a controller, and the tests that keep NaN out of it, hold in IEEE 754 arithmetic only. Each of the flags
 * below changes last bits, the signs of zeros, or takes such tests away. Compilers that do not tell a flag (gcc before
 * version 12 and clang tell of some only) are found by the replay of a package's vectors, which looks for each by its effect.
 *
 * What no compiler can tell, since the processor is switched when the program runs: subnormal numbers must be on (a
 * program that is linked with -ffast-math or -Ofast may switch them off), and rounding must be to nearest.
 */
#ifndef GNC_ARITHMETIC_H
#define GNC_ARITHMETIC_H

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

#endif
