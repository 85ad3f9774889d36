/* SPDX-License-Identifier: MIT-0
 *
 * Start of a 64-bit RISC-V core in machine mode on QEMU's `virt` board, which loads all of RAM itself.
 */
#include <string.h>

#include "target.h"

extern unsigned char target_bss[], target_bss_end[];

void target_reset(void);
void target_begin(void);
void target_fault(void);

__attribute__((naked, section(".start"), used)) void target_reset(void)
{
    __asm__ volatile(".option push\n.option norelax\nla gp, __global_pointer$\n.option pop\n"
                     "la sp, target_stack_top\n"
                     "la t0, target_fault\ncsrw mtvec, t0\n"
                     "li t0, 0x6000\ncsrs mstatus, t0\n" /* the floating-point unit */
                     "j target_begin");
}

__attribute__((used)) void target_begin(void)
{
    memset(target_bss, 0, (size_t)(target_bss_end - target_bss));
    target_exit(main());
}

__attribute__((aligned(4), used)) void target_fault(void) { target_exit(4); }

uint64_t target_instructions(void)
{
    uint64_t count;
    __asm__ volatile("csrr %0, minstret" : "=r"(count));
    return count;
}
