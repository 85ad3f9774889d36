/* SPDX-License-Identifier: MIT-0
 *
 * The square root on cores without an instruction for it, rounded to nearest: two digits of the number give one of the
 * root (the method by hand, in binary), one more than the result has.
 */
#include <stdint.h>
#include <string.h>

double sqrt(double x);
float sqrtf(float x);

static double root_of(double x)
{
    uint64_t rest, root = 0u, twice = 0u, digit;
    int64_t exponent;
    memcpy(&rest, &x, sizeof rest);
    if (!(x > 0.0) || rest >> 52 == 0x7ffu) return x < 0.0 ? (x - x) / (x - x) : x;
    exponent = (int64_t)(rest >> 52);
    rest &= 0xfffffffffffffu;
    if (exponent == 0) exponent = 1;
    else rest |= (uint64_t)1 << 52;
    while (rest >> 52 == 0u) rest <<= 1, exponent--;
    exponent -= 1023;
    if (exponent & 1) rest <<= 1, exponent--;
    rest <<= 1;
    for (digit = (uint64_t)1 << 53; digit != 0u; digit >>= 1) {
        if (twice + digit <= rest) {
            rest -= twice + digit;
            twice += 2u * digit;
            root += digit;
        }
        rest <<= 1;
    }
    if (rest != 0u) root += root & 1u;
    root = (root >> 1) + ((uint64_t)(exponent / 2 + 1022) << 52);
    memcpy(&x, &root, sizeof x);
    return x;
}

double sqrt(double x) { return root_of(x); }

/* 53 digits are more than twice 24 and two: rounding twice is rounding once. */
float sqrtf(float x) { return (float)root_of((double)x); }
