/* A stub of the part of Simulink's interface that the printed S-function asks for; its functions are the test's. */
#ifndef SIMSTRUC_H
#define SIMSTRUC_H
#include <stddef.h>
typedef struct SimStruct SimStruct;
typedef double real_T;
typedef int int_T;
enum { SS_UINT8 = 3 };
void ssSetNumSFcnParams(SimStruct *S, int_T n);
int_T ssGetNumSFcnParams(const SimStruct *S);
int_T ssGetSFcnParamsCount(const SimStruct *S);
int_T ssSetNumInputPorts(SimStruct *S, int_T n);
int_T ssSetNumOutputPorts(SimStruct *S, int_T n);
void ssSetInputPortWidth(SimStruct *S, int_T port, int_T width);
void ssSetInputPortRequiredContiguous(SimStruct *S, int_T port, int_T yes);
void ssSetInputPortDirectFeedThrough(SimStruct *S, int_T port, int_T yes);
void ssSetOutputPortWidth(SimStruct *S, int_T port, int_T width);
void ssSetNumSampleTimes(SimStruct *S, int_T n);
void ssSetNumDWork(SimStruct *S, int_T n);
void ssSetDWorkWidth(SimStruct *S, int_T which, int_T width);
void ssSetDWorkDataType(SimStruct *S, int_T which, int_T type);
void ssSetSampleTime(SimStruct *S, int_T which, real_T period);
void ssSetOffsetTime(SimStruct *S, int_T which, real_T offset);
void *ssGetDWork(SimStruct *S, int_T which);
void ssSetErrorStatus(SimStruct *S, const char *why);
const real_T *ssGetInputPortRealSignal(SimStruct *S, int_T port);
real_T *ssGetOutputPortRealSignal(SimStruct *S, int_T port);
real_T ssGetT(SimStruct *S);
#endif
