/* SPDX-License-Identifier: MIT-0 */
/* A compiler of device code knows memcpy and memset without a header. */
#ifndef NULL
#define NULL 0
#endif
