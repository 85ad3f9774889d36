/* SPDX-License-Identifier: MIT-0 */
/* Integers of fixed width, for a compiler of device code, which has no headers of the C library. */
#ifndef GNC_KERNEL_STDINT_H
#define GNC_KERNEL_STDINT_H

typedef signed char int8_t;
typedef int int32_t;
typedef long long int64_t;
typedef unsigned char uint8_t;
typedef unsigned int uint32_t;
typedef unsigned long long uint64_t;

#define UINT32_C(number) number##u
#define UINT64_C(number) number##ull

#endif
