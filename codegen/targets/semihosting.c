/* SPDX-License-Identifier: MIT-0
 *
 * Semihosting: files and exit of the emulator's host, by the same three calls on Arm and RISC-V.
 */
#include <string.h>

#include "target.h"

enum { SYS_OPEN = 0x01, SYS_WRITE = 0x05, SYS_EXIT_EXTENDED = 0x20 };
enum { MODE_WRITE_BINARY = 5, STOPPED_BY_APPLICATION = 0x20026 };

static intptr_t call(intptr_t operation, const void *block)
{
#if defined(__arm__)
    register intptr_t r0 __asm__("r0") = operation;
    register const void *r1 __asm__("r1") = block;
    __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
#elif defined(__riscv)
    register intptr_t a0 __asm__("a0") = operation;
    register const void *a1 __asm__("a1") = block;
    __asm__ volatile(".option push\n.option norvc\n.balign 16\n"
                     "slli x0, x0, 0x1f\nebreak\nsrai x0, x0, 7\n.option pop"
                     : "+r"(a0)
                     : "r"(a1)
                     : "memory");
    return a0;
#else
#error "semihosting is written for Arm and RISC-V"
#endif
}

int target_open(const char *name)
{
    const intptr_t block[3] = {(intptr_t)name, MODE_WRITE_BINARY, (intptr_t)strlen(name)};
    return (int)call(SYS_OPEN, block);
}

void target_write(int file, const void *bytes, size_t size)
{
    const intptr_t block[3] = {file, (intptr_t)bytes, (intptr_t)size};
    if (call(SYS_WRITE, block) != 0) target_exit(3);
}

void target_exit(int code)
{
    const intptr_t block[2] = {STOPPED_BY_APPLICATION, code};
    for (;;) (void)call(SYS_EXIT_EXTENDED, block);
}
