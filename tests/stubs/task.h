/* A stub of the part of FreeRTOS that the printed task asks for; its functions are the test's. */
#ifndef INC_TASK_H
#define INC_TASK_H
#include "FreeRTOS.h"
typedef void *TaskHandle_t;
TickType_t xTaskGetTickCount(void);
BaseType_t xTaskDelayUntil(TickType_t *previous, TickType_t period);
void vTaskDelete(TaskHandle_t task);
#endif
