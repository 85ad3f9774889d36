/* Runs the printed timer over the package's vectors: the interrupt is a call. */
#include <stdio.h>

#include "counted.h"

int32_t sat_start(void);
void sat_tick(void);
int32_t sat_poll(void);
uint32_t sat_missed(void);

void sat_give(const sat_output *output) { count(output); }

int main(void)
{
    if (sat_poll() != 0 || sat_start() != 0) return 1;
    if (sat_poll() != 0) return 2; /* no tick, no step */
    while (k < REPLAY_STEPS) {
        if (k == 10) sat_tick(), sat_tick(); /* two periods too late */
        sat_tick();
        if (sat_poll() != 1 || sat_poll() != 0) return 3;
    }
    (void)printf("%ld steps, %ld words differ, %u missed, told %ld times\n", k, wrong, (unsigned)sat_missed(), shifted);
    return 0;
}
