/* SPDX-License-Identifier: MIT-0
 *
 * Uniform random numbers as a function of (seed, draw, place): Philox4x32-10 of Salmon, Moraes,
 * Dror and Shaw (2011), doi:10.1145/2063384.2063405. No state; the same words on every machine.
 * For simulated flights; casadi_gnc/noise.py is the same in Python.
 */
#ifndef GNC_RANDOM_H
#define GNC_RANDOM_H

#include <stdint.h>

static inline void gnc_philox(const uint32_t counter[4], const uint32_t key[2], uint32_t words[4])
{
    uint32_t c0 = counter[0], c1 = counter[1], c2 = counter[2], c3 = counter[3];
    uint32_t k0 = key[0], k1 = key[1];
    int round;
    for (round = 0; round < 10; round++) {
        const uint64_t left = (uint64_t)0xD2511F53u * c0;
        const uint64_t right = (uint64_t)0xCD9E8D57u * c2;
        c0 = (uint32_t)(right >> 32) ^ c1 ^ k0;
        c1 = (uint32_t)right;
        c2 = (uint32_t)(left >> 32) ^ c3 ^ k1;
        c3 = (uint32_t)left;
        k0 += 0x9E3779B9u;
        k1 += 0xBB67AE85u;
    }
    words[0] = c0;
    words[1] = c1;
    words[2] = c2;
    words[3] = c3;
}

/* Fill `numbers` with `count` numbers in (0, 1], multiples of 2^-53. */
static inline void gnc_uniforms(uint64_t seed, uint64_t draw, uint32_t count, double *numbers)
{
    const uint32_t key[2] = {(uint32_t)seed, (uint32_t)(seed >> 32)};
    uint32_t i;
    for (i = 0; i < count; i++) {
        const uint32_t counter[4] = {i / 2u, 0u, (uint32_t)draw, (uint32_t)(draw >> 32)};
        const uint32_t pair = 2u * (i % 2u);
        uint32_t words[4];
        gnc_philox(counter, key, words);
        numbers[i] =
            ((double)(words[pair] >> 5) * 67108864.0 + (double)(words[pair + 1u] >> 6) + 1.0) / 9007199254740992.0;
    }
}

#endif
