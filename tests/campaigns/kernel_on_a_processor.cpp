/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The device code of a campaign on a processor: words of CUDA that say nothing here, and threads one after the other.
 * Built without the compiler's own headers and with __GNUC__ undefined, as a compiler of device code sees the text.
 */
#define __global__
#define __launch_bounds__(...)

struct gnc_place {
    unsigned x;
};
static thread_local gnc_place blockIdx, blockDim, threadIdx;

typedef __SIZE_TYPE__ size_t;
extern "C" {
double sqrt(double x);
float sqrtf(float x);
void *memcpy(void *to, const void *from, size_t size);
void *memset(void *to, int value, size_t size);
}

#include "kernel.cu"

template <class Kernel> static void each(unsigned blocks, unsigned threads, Kernel kernel)
{
    blockDim.x = threads;
    for (blockIdx.x = 0; blockIdx.x < blocks; blockIdx.x++) {
        for (threadIdx.x = 0; threadIdx.x < threads; threadIdx.x++) kernel();
    }
}

extern "C" void launch_begin(unsigned blocks, unsigned threads, const gnc_columns *c)
{
    each(blocks, threads, [=] { gnc_begin(*c); });
}

extern "C" void launch_go_on(unsigned blocks, unsigned threads, const gnc_columns *c, long long first, long long samples)
{
    each(blocks, threads, [=] { gnc_go_on(*c, first, samples); });
}
