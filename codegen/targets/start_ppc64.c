/* SPDX-License-Identifier: MIT-0
 *
 * Start of a 64-bit PowerPC core e5500 on QEMU's `ppce500` board, high octets first. The board has no semihosting: what
 * is written goes to its serial line, which the emulator keeps in a file, the program's code as the last octet.
 */
#include <string.h>

#include "target.h"

extern unsigned char target_bss[], target_bss_end[];

void target_begin(void);
void target_fault(void);

/* 64-bit mode, also in interrupts (EPCR), the floating-point unit, faults to one place, and the devices, which the
 * board has at 0xfe0000000, at 0xe0000000. */
__asm__(".section .start,\"ax\"\n"
        ".globl target_reset\n"
        "target_reset:\n"
        "lis 3,0x0200\nmtspr 307,3\n"
        "mfmsr 3\noris 3,3,0x8000\nori 3,3,0x2000\nmtmsr 3\nisync\n"
        "lis 2,.TOC.@ha\naddi 2,2,.TOC.@l\n"
        "lis 1,target_stack_top@ha\naddi 1,1,target_stack_top@l\naddi 1,1,-128\n"
        "lis 3,target_trap@ha\naddi 3,3,target_trap@l\n"
        "clrrdi 4,3,16\nmtspr 63,4\n"
        ".irp n,400,401,402,403,404,405,406,407,408,409,410,411,412,413,414,415\nmtspr \\n,3\n.endr\n"
        "lis 3,0x1001\nmtspr 624,3\n"
        "li 3,0x700\noris 3,3,0xc000\nmtspr 625,3\n"
        "li 3,0xa\noris 3,3,0xe000\nmtspr 626,3\n"
        "li 3,0x5\noris 3,3,0xe000\nmtspr 627,3\n"
        "li 3,0xf\nmtspr 944,3\n"
        "tlbwe\nisync\n"
        "bl target_begin\nnop\n"
        ".balign 16\n"
        "target_trap:\nbl target_fault\nnop\n"
        ".previous\n");

__attribute__((used)) void target_begin(void)
{
    memset(target_bss, 0, (size_t)(target_bss_end - target_bss));
    target_exit(main());
}

__attribute__((used)) void target_fault(void) { target_exit(4); }

/* The time base counts at 400 MHz and an instruction takes 128 ns (`-icount shift=7`): 51.2 counts each. */
uint64_t target_instructions(void)
{
    uint64_t count;
    __asm__ volatile("mfspr %0, 268" : "=r"(count));
    return (5u * count + 255u) / 256u;
}

static void send(unsigned char octet)
{
    volatile unsigned char *const serial = (volatile unsigned char *)0xe0004500u;
    while ((serial[5] & 0x20u) == 0u) {}
    serial[0] = octet;
}

int target_open(const char *name)
{
    (void)name;
    return 0;
}

void target_write(int file, const void *bytes, size_t size)
{
    size_t k;
    (void)file;
    for (k = 0; k < size; k++) send(((const unsigned char *)bytes)[k]);
}

/* A request of a reset, at which the emulator ends. */
void target_exit(int code)
{
    send((unsigned char)code);
    for (;;) *(volatile uint32_t *)0xe00e00b0u = 2u;
}

/* The C library's own choose among instructions that this core need not have. */
#define PLAIN __attribute__((used, optimize("no-tree-loop-distribute-patterns")))

PLAIN void *memset(void *to, int value, size_t size)
{
    size_t k;
    for (k = 0; k < size; k++) ((unsigned char *)to)[k] = (unsigned char)value;
    return to;
}

PLAIN void *memcpy(void *restrict to, const void *restrict from, size_t size)
{
    size_t k;
    for (k = 0; k < size; k++) ((unsigned char *)to)[k] = ((const unsigned char *)from)[k];
    return to;
}
