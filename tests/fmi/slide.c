/* A plant that leaves the integration to its importer, for FMI 2.0 and 3.0 (-DFMI=2 or 3): a mass
   ahead of a stop, pushed by u and from a certain time on by a further force.

   x'' = (force * u + push * (t >= onset)) / m; at x = reach the mass bounces, v+ = -rebound v-.
   `misdeed` lets it fail at 50 ms. */
#include <math.h>
#include <signal.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <unistd.h>

#define EXPORT __attribute__((visibility("default")))
#if FMI == 2
#define NAME(two, three) fmi2##two
typedef int Flag;
#else
#define NAME(two, three) fmi3##three
typedef bool Flag;
#endif

enum { TIME, U, X, V, ACCELERATION, MASS, FORCE, PUSH, ONSET, REACH, REBOUND, MISDEED, HITS, COUNT };
typedef struct {
    double value[COUNT], settled;
    bool pushed;
} Slide;

static void *begin(void)
{
    Slide *const s = calloc(1, sizeof *s);
    s->value[MASS] = 1;
    s->value[FORCE] = 1;
    s->value[U] = 7; /* until it is told of another one */
    s->value[ONSET] = s->value[REACH] = INFINITY;
    return s;
}

static int evaluate(Slide *s)
{
    double *const v = s->value;
    v[ACCELERATION] = (v[FORCE] * v[U] + (s->pushed ? v[PUSH] : 0)) / v[MASS];
    if (v[TIME] > 0.0495) {
        switch ((int)v[MISDEED]) {
        case 2: raise(SIGSEGV); break;
        case 3: return 3;
        case 4: return 2;
        case 5: pause(); break;
        case 6: _Exit(7);
        case 7: v[ACCELERATION] = NAN;
        }
    }
    return 0;
}

EXPORT const char *fmi2GetTypesPlatform(void) { return "default"; }
EXPORT const char *NAME(GetVersion, GetVersion)(void) { return FMI == 2 ? "2.0" : "3.0"; }
EXPORT void NAME(FreeInstance, FreeInstance)(void *c) { free(c); }
EXPORT int NAME(Terminate, Terminate)(void *c) { return 0; }
EXPORT int NAME(ExitInitializationMode, ExitInitializationMode)(void *c) { return 0; }
EXPORT int NAME(EnterEventMode, EnterEventMode)(void *c) { return 0; }
EXPORT int NAME(EnterContinuousTimeMode, EnterContinuousTimeMode)(void *c) { return 0; }

#if FMI == 2
EXPORT void *fmi2Instantiate(const char *n, int t, const char *g, const char *l, const void *f,
                             int v, int o) { return begin(); }
EXPORT int fmi2SetupExperiment(void *c, int d, double t, double s, int e, double p) { return 0; }
EXPORT int fmi2EnterInitializationMode(void *c) { return 0; }
EXPORT int fmi2GetReal(void *c, const unsigned *vr, size_t n, double *value)
#else
EXPORT void *fmi3InstantiateModelExchange(const char *n, const char *t, const char *r, bool v,
                                          bool o, void *e, void *l) { return begin(); }
EXPORT int fmi3EnterInitializationMode(void *c, bool d, double t, double s, bool e, double p)
{
    return 0;
}
EXPORT int fmi3GetNumberOfContinuousStates(void *c, size_t *n) { *n = 2; return 0; }
EXPORT int fmi3GetNumberOfEventIndicators(void *c, size_t *n) { *n = 1; return 0; }
EXPORT int fmi3GetFloat64(void *c, const unsigned *vr, size_t n, double *value, size_t m)
#endif
{
    const int status = evaluate(c);
    for (size_t i = 0; i < n; i++) {
        value[i] = ((Slide *)c)->value[vr[i]];
    }
    return status;
}

#if FMI == 2
EXPORT int fmi2SetReal(void *c, const unsigned *vr, size_t n, const double *value)
#else
EXPORT int fmi3SetFloat64(void *c, const unsigned *vr, size_t n, const double *value, size_t m)
#endif
{
    for (size_t i = 0; i < n; i++) {
        ((Slide *)c)->value[vr[i]] = value[i];
    }
    return 0;
}

EXPORT int NAME(SetTime, SetTime)(void *c, double t)
{
    ((Slide *)c)->value[TIME] = t;
    return 0;
}

EXPORT int NAME(SetContinuousStates, SetContinuousStates)(void *c, const double *x, size_t n)
{
    ((Slide *)c)->value[X] = x[0];
    ((Slide *)c)->value[V] = x[1];
    return 0;
}

EXPORT int NAME(GetContinuousStates, GetContinuousStates)(void *c, double *x, size_t n)
{
    x[0] = ((Slide *)c)->value[X];
    x[1] = ((Slide *)c)->value[V];
    return 0;
}

EXPORT int NAME(GetDerivatives, GetContinuousStateDerivatives)(void *c, double *dx, size_t n)
{
    const int status = evaluate(c);
    dx[0] = ((Slide *)c)->value[V];
    dx[1] = ((Slide *)c)->value[ACCELERATION];
    return status;
}

/* how far the mass is from the stop; one that never rests is past it as soon as time goes on */
EXPORT int NAME(GetEventIndicators, GetEventIndicators)(void *c, double *z, size_t n)
{
    Slide *const s = c;
    z[0] = s->value[REACH] - s->value[X];
    if (s->value[MISDEED] == 10 && s->value[TIME] > 0.0495) {
        z[0] = s->value[TIME] > s->settled ? -1 : 1;
    }
    if (s->value[MISDEED] == 13 && s->value[TIME] > 0.0495) {
        z[0] = NAN;
    }
    return 0;
}

/* a further force that sets in with the step after 20 ms, without any indicator */
static bool latched(const Slide *s)
{
    return s->value[MISDEED] == 11 && s->value[TIME] > 0.01999;
}

EXPORT int NAME(CompletedIntegratorStep, CompletedIntegratorStep)(void *c, Flag past, Flag *enter,
                                                                  Flag *ends)
{
    Slide *const s = c;
    *enter = latched(s) && !s->pushed;
    *ends = s->value[MISDEED] == 8 && s->value[TIME] > 0.0495;
    return 0;
}

static bool settle(Slide *s)
{
    double *const v = s->value;
    if (v[X] >= v[REACH] && v[V] > 0) {
        v[V] *= -v[REBOUND];
        v[HITS] += 1;
    }
    s->pushed = v[TIME] >= v[ONSET] || latched(s);
    s->settled = v[TIME];
    return v[MISDEED] == 9 && v[TIME] > 0.0495;
}

#if FMI == 2
typedef struct { Flag again, ends, nominals, values, next; double time; } Info;
EXPORT int fmi2NewDiscreteStates(void *c, Info *info)
{
    Slide *const s = c;
    const bool again = settle(s);
    *info = (Info){again, false, false, true, !s->pushed && isfinite(s->value[ONSET]),
                   s->value[ONSET]};
    return 0;
}
#else
EXPORT int fmi3UpdateDiscreteStates(void *c, bool *again, bool *ends, bool *nominals, bool *values,
                                    bool *next, double *time)
{
    Slide *const s = c;
    *again = settle(s);
    *ends = *nominals = false;
    *values = true;
    *next = !s->pushed && isfinite(s->value[ONSET]);
    *time = s->value[ONSET];
    return 0;
}
#endif

#if FMI == 3
/* for co-simulation it stands still */
EXPORT void *fmi3InstantiateCoSimulation(const char *n, const char *t, const char *r, bool v,
                                         bool o, bool e, bool a, const unsigned *i, size_t m,
                                         void *x, void *l, void *u) { return begin(); }
EXPORT int fmi3DoStep(void *c, double t, double h, bool keep, bool *event, bool *ends, bool *early,
                      double *reached)
{
    const double misdeed = t > 0.0495 ? ((Slide *)c)->value[MISDEED] : 0;
    *event = false;
    *ends = misdeed == 8;
    *early = misdeed == 12;
    *reached = t + (misdeed == 12 ? 0.5 : 1) * h;
    return 0;
}
#endif

/* what nobody calls has to be there */
#define NONE(name) EXPORT int name(void) { return 3; }
#if FMI == 2
NONE(fmi2SetDebugLogging) NONE(fmi2Reset) NONE(fmi2GetInteger) NONE(fmi2GetBoolean)
NONE(fmi2GetString) NONE(fmi2SetInteger) NONE(fmi2SetBoolean) NONE(fmi2SetString)
NONE(fmi2GetFMUstate) NONE(fmi2SetFMUstate) NONE(fmi2FreeFMUstate) NONE(fmi2SerializedFMUstateSize)
NONE(fmi2SerializeFMUstate) NONE(fmi2DeSerializeFMUstate) NONE(fmi2GetDirectionalDerivative)
NONE(fmi2GetNominalsOfContinuousStates)
#else
NONE(fmi3GetFloat32) NONE(fmi3GetInt8) NONE(fmi3GetUInt8) NONE(fmi3GetInt16) NONE(fmi3GetUInt16)
NONE(fmi3GetInt32) NONE(fmi3GetUInt32) NONE(fmi3GetInt64) NONE(fmi3GetUInt64) NONE(fmi3GetBoolean)
NONE(fmi3GetString) NONE(fmi3GetBinary) NONE(fmi3GetClock) NONE(fmi3SetFloat32) NONE(fmi3SetInt8)
NONE(fmi3SetUInt8) NONE(fmi3SetInt16) NONE(fmi3SetUInt16) NONE(fmi3SetInt32) NONE(fmi3SetUInt32)
NONE(fmi3SetInt64) NONE(fmi3SetUInt64) NONE(fmi3SetBoolean) NONE(fmi3SetString) NONE(fmi3SetBinary)
NONE(fmi3SetClock) NONE(fmi3GetNumberOfVariableDependencies) NONE(fmi3GetVariableDependencies)
NONE(fmi3EnterConfigurationMode) NONE(fmi3ExitConfigurationMode) NONE(fmi3GetIntervalDecimal)
NONE(fmi3GetIntervalFraction) NONE(fmi3GetShiftDecimal) NONE(fmi3GetShiftFraction)
NONE(fmi3SetIntervalDecimal) NONE(fmi3SetIntervalFraction) NONE(fmi3SetShiftDecimal)
NONE(fmi3SetShiftFraction) NONE(fmi3EvaluateDiscreteStates) NONE(fmi3GetNominalsOfContinuousStates)
NONE(fmi3GetOutputDerivatives) NONE(fmi3ActivateModelPartition) NONE(fmi3SetDebugLogging)
NONE(fmi3InstantiateScheduledExecution) NONE(fmi3Reset)
NONE(fmi3GetFMUState) NONE(fmi3SetFMUState) NONE(fmi3FreeFMUState) NONE(fmi3SerializedFMUStateSize)
NONE(fmi3SerializeFMUState) NONE(fmi3DeserializeFMUState) NONE(fmi3GetDirectionalDerivative)
NONE(fmi3GetAdjointDerivative) NONE(fmi3EnterStepMode)
#endif
