/* SPDX-License-Identifier: MIT-0
 *
 * What a board offers the measuring program: a counter of instructions, a file on the host, an end.
 */
#ifndef GNC_TARGET_H
#define GNC_TARGET_H

#include <stddef.h>
#include <stdint.h>

/* Instructions executed since some moment; differences count. Exact under an emulator that advances
 * its clock with each instruction. */
uint64_t target_instructions(void);

/* Open a file on the host for writing, write to it, end the program with a code. */
int target_open(const char *name);
void target_write(int file, const void *bytes, size_t size);
void target_exit(int code);

/* Entered from the start-up code. */
int main(void);

/* Limits of the stack, from the linker script. */
extern unsigned char target_stack_bottom[], target_stack_top[];

#endif
