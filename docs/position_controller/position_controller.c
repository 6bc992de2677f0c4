/* A position controller as an FMU for co-simulation, FMI 3.0: the part of the interface that a
   simulation needs. i = gain e + rate times the integral of e, e = target - position, within a
   limit; the integral waits while the current is at it. */

#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdlib.h>

enum { TARGET, POSITION, GAIN, RATE, LIMIT, CURRENT, TIME, INTEGRAL, COUNT };

static void command(double *v)
{
    const double wanted = v[GAIN] * (v[TARGET] - v[POSITION]) + v[INTEGRAL];
    v[CURRENT] = fmin(fmax(wanted, -v[LIMIT]), v[LIMIT]);
}

const char *fmi3GetVersion(void) { return "3.0"; }

void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *resources,
                                  bool visible, bool logging, bool events, bool early,
                                  const unsigned *required, size_t n, void *environment,
                                  void (*log)(void), void (*update)(void))
{
    double *const v = calloc(COUNT, sizeof *v);
    if (v) {
        v[GAIN] = 0.4;
        v[RATE] = 0.5;
        v[LIMIT] = 0.01;
    }
    return v;
}

void fmi3FreeInstance(void *v) { free(v); }

int fmi3EnterInitializationMode(void *v, bool tolerant, double tolerance, double start, bool ends,
                                double stop)
{
    return 0;
}

int fmi3ExitInitializationMode(void *v) { return 0; }

int fmi3Terminate(void *v) { return 0; }

int fmi3SetFloat64(void *v, const unsigned *references, size_t n, const double *values, size_t m)
{
    for (size_t i = 0; i < n; i++) {
        if (references[i] > LIMIT) {
            return 3;
        }
        ((double *)v)[references[i]] = values[i];
    }
    return 0;
}

int fmi3GetFloat64(void *v, const unsigned *references, size_t n, double *values, size_t m)
{
    for (size_t i = 0; i < n; i++) {
        if (references[i] > TIME) {
            return 3;
        }
        values[i] = ((double *)v)[references[i]];
    }
    return 0;
}

int fmi3DoStep(void *instance, double time, double step, bool keeps, bool *event, bool *ends,
               bool *early, double *reached)
{
    double *const v = instance;
    command(v);
    if (fabs(v[CURRENT]) < v[LIMIT]) {
        v[INTEGRAL] += v[RATE] * (v[TARGET] - v[POSITION]) * step;
    }
    *event = *ends = *early = false;
    *reached = v[TIME] = time + step;
    return 0;
}

/* tools look for the whole interface: what it does not offer fails */
#define NONE(name) int fmi3##name(void) { return 3; }
NONE(EnterEventMode) NONE(GetFloat32) NONE(GetInt8) NONE(GetUInt8) NONE(GetInt16) NONE(GetUInt16)
NONE(GetInt32) NONE(GetUInt32) NONE(GetInt64) NONE(GetUInt64) NONE(GetBoolean) NONE(GetString)
NONE(GetBinary) NONE(GetClock) NONE(SetFloat32) NONE(SetInt8) NONE(SetUInt8) NONE(SetInt16)
NONE(SetUInt16) NONE(SetInt32) NONE(SetUInt32) NONE(SetInt64) NONE(SetUInt64) NONE(SetBoolean)
NONE(SetString) NONE(SetBinary) NONE(SetClock) NONE(GetNumberOfVariableDependencies)
NONE(GetVariableDependencies) NONE(EnterConfigurationMode) NONE(ExitConfigurationMode)
NONE(GetIntervalDecimal) NONE(GetIntervalFraction) NONE(GetShiftDecimal) NONE(GetShiftFraction)
NONE(SetIntervalDecimal) NONE(SetIntervalFraction) NONE(SetShiftDecimal) NONE(SetShiftFraction)
NONE(EvaluateDiscreteStates) NONE(UpdateDiscreteStates) NONE(EnterContinuousTimeMode)
NONE(CompletedIntegratorStep) NONE(SetTime) NONE(SetContinuousStates)
NONE(GetContinuousStateDerivatives) NONE(GetEventIndicators) NONE(GetContinuousStates)
NONE(GetNominalsOfContinuousStates) NONE(GetNumberOfEventIndicators)
NONE(GetNumberOfContinuousStates) NONE(GetOutputDerivatives) NONE(ActivateModelPartition)
NONE(SetDebugLogging) NONE(InstantiateModelExchange) NONE(InstantiateScheduledExecution)
NONE(Reset) NONE(GetFMUState) NONE(SetFMUState) NONE(FreeFMUState) NONE(SerializedFMUStateSize)
NONE(SerializeFMUState) NONE(DeserializeFMUState) NONE(GetDirectionalDerivative)
NONE(GetAdjointDerivative) NONE(EnterStepMode)
