/* A stub: what follows the S-function here is a simulation that runs it over the package's vectors. */
#include <stdio.h>
#include <stdlib.h>

#include "replay.h"

struct SimStruct {
    int inputs, outputs, width, in[16], out[16];
    double period, time, given[REPLAY_INPUTS], told[REPLAY_OUTPUTS], *work;
};

void ssSetNumSFcnParams(SimStruct *S, int_T n) { (void)S, (void)n; }
int_T ssGetNumSFcnParams(const SimStruct *S) { (void)S; return 0; }
int_T ssGetSFcnParamsCount(const SimStruct *S) { (void)S; return 0; }
int_T ssSetNumInputPorts(SimStruct *S, int_T n) { S->inputs = n; return 1; }
int_T ssSetNumOutputPorts(SimStruct *S, int_T n) { S->outputs = n; return 1; }
void ssSetInputPortWidth(SimStruct *S, int_T port, int_T width) { S->in[port] = width; }
void ssSetInputPortRequiredContiguous(SimStruct *S, int_T port, int_T yes) { (void)S, (void)port, (void)yes; }
void ssSetInputPortDirectFeedThrough(SimStruct *S, int_T port, int_T yes) { (void)S, (void)port, (void)yes; }
void ssSetOutputPortWidth(SimStruct *S, int_T port, int_T width) { S->out[port] = width; }
void ssSetNumSampleTimes(SimStruct *S, int_T n) { (void)S, (void)n; }
void ssSetNumDWork(SimStruct *S, int_T n) { (void)S, (void)n; }
void ssSetDWorkWidth(SimStruct *S, int_T which, int_T width) { (void)which, S->width = width; }
void ssSetDWorkDataType(SimStruct *S, int_T which, int_T type) { (void)S, (void)which, (void)type; }
void ssSetSampleTime(SimStruct *S, int_T which, real_T period) { (void)which, S->period = period; }
void ssSetOffsetTime(SimStruct *S, int_T which, real_T offset) { (void)S, (void)which, (void)offset; }
void *ssGetDWork(SimStruct *S, int_T which) { (void)which; return S->work; }
void ssSetErrorStatus(SimStruct *S, const char *why) { (void)S, (void)puts(why), exit(1); }
real_T ssGetT(SimStruct *S) { return S->time; }

/* Ports lie one after the other. */
const real_T *ssGetInputPortRealSignal(SimStruct *S, int_T port)
{
    int i, at = 1; /* after the time */
    for (i = 0; i < port; i++) at += S->in[i];
    return S->given + at;
}

real_T *ssGetOutputPortRealSignal(SimStruct *S, int_T port)
{
    int i, at = 0;
    for (i = 0; i < port; i++) at += S->out[i];
    return S->told + at;
}

int main(void)
{
    static SimStruct one;
    long k, wrong = 0;
    int i, width = 0;
    mdlInitializeSizes(&one);
    mdlInitializeSampleTimes(&one);
    one.work = calloc(1, (size_t)one.width);
    mdlInitializeConditions(&one);
    for (i = 0; i < one.outputs; i++) width += one.out[i];
    for (k = 0; k < REPLAY_STEPS; k++) {
        for (i = 0; i < REPLAY_INPUTS; i++) one.given[i] = (double)replay_number(replay_inputs[k][i]);
        one.time = one.given[0];
        mdlOutputs(&one, 0);
        for (i = 0; i < REPLAY_OUTPUTS - 1; i++) wrong += replay_bits((sat_real)one.told[i]) != replay_outputs[k][i];
        wrong += one.told[i] != (double)replay_outputs[k][i];
    }
    mdlTerminate(&one);
    free(one.work);
    (void)printf("%ld steps, %ld words differ, %d in, %d out, %g s\n", k, wrong, one.inputs, width, one.period);
    return 0;
}
