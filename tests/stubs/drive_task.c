/* Runs the printed FreeRTOS task over the package's vectors: FreeRTOS is these few functions. */
#include <stdio.h>
#include <stdlib.h>

#include "FreeRTOS.h"
#include "counted.h"
#include "task.h"

void sat_refused(int32_t why);
void sat_task(void *unused);
extern volatile uint32_t sat_overruns;

static long late;

TickType_t xTaskGetTickCount(void) { return 7; }
void vTaskDelete(TaskHandle_t task) { (void)task, exit(3); }
void sat_refused(int32_t why) { (void)why; }

BaseType_t xTaskDelayUntil(TickType_t *previous, TickType_t period)
{
    if (period != 100 || *previous != 7 + (TickType_t)(k - 1 + late) * period) exit(4);
    *previous += period;
    if ((k == 10 && late == 0) || (k == 20 && late < 3)) return late++, pdFALSE; /* one period missed, then two */
    return pdTRUE;
}

void sat_give(const sat_output *output)
{
    count(output);
    if (k == REPLAY_STEPS) {
        (void)printf("%ld steps, %ld words differ, %u overruns, told %ld times\n", k, wrong, (unsigned)sat_overruns, shifted);
        exit(0);
    }
}

int main(void)
{
    sat_task(0);
    return 5; /* a task never returns */
}
