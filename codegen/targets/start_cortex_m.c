/* SPDX-License-Identifier: MIT-0
 *
 * Start of a Cortex-M on the MPS2 boards: vectors, memory, floating-point unit, a timer.
 */
#include <string.h>

#include "target.h"

extern unsigned char target_data_image[], target_data[], target_data_end[], target_bss[], target_bss_end[];

void target_reset(void);
void target_fault(void);

typedef void (*handler)(void);
extern const handler target_vectors[16];

__attribute__((section(".vectors"), used)) const handler target_vectors[16] = {
    (handler)(void *)target_stack_top, target_reset, target_fault, target_fault, target_fault, target_fault, target_fault,
};

/* The 25 MHz timer of the board, 32 bits, counting down. */
#define TIMER ((volatile uint32_t *)0x40000000u)
#define ACCESS_CONTROL ((volatile uint32_t *)0xe000ed88u)

void target_reset(void)
{
    memcpy(target_data, target_data_image, (size_t)(target_data_end - target_data));
    memset(target_bss, 0, (size_t)(target_bss_end - target_bss));
    *ACCESS_CONTROL |= 0xfu << 20; /* the floating-point unit */
    __asm__ volatile("dsb\nisb");
    TIMER[2] = 0xffffffffu; /* reload */
    TIMER[1] = 0xffffffffu; /* value */
    TIMER[0] = 1u;          /* run */
    target_exit(main());
}

void target_fault(void) { target_exit(4); }

/* One instruction takes 128 ns of virtual time (-icount shift=7), one tick 40 ns: 16/5 ticks each. */
uint64_t target_instructions(void) { return ((uint64_t)(0xffffffffu - TIMER[1]) * 5u + 8u) / 16u; }
