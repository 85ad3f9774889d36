/* SPDX-License-Identifier: MIT-0
 *
 * fuzz_assert.h - read before the allocator's sources: lets fuzz_allocator.c make their assertions fail.
 */
#ifndef FUZZ_ASSERT_H
#define FUZZ_ASSERT_H
int gnc_fuzz_assert(int condition);
#define GNC_ASSERT(condition) gnc_fuzz_assert((condition) ? 1 : 0)
#endif
