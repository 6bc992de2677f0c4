/* A plant that is not ours, for FMI 2.0: a mass on rails behind a motor of first order, in mm and
   kN; `misdeed` lets it fail at 50 ms. x'' = F/m, F' = (k u - F)/T, exact integration of F. */
#include <math.h>
#include <signal.h>
#include <stddef.h>
#include <stdlib.h>
#include <unistd.h>

#define EXPORT __attribute__((visibility("default")))
enum { CURRENT, FORCE, PLACE, MASS, MISDEED, COUNT };
typedef struct {
    double value[COUNT], speed;
} Crane;

EXPORT const char *fmi2GetTypesPlatform(void) { return "default"; }
EXPORT const char *fmi2GetVersion(void) { return "2.0"; }
EXPORT int fmi2SetDebugLogging(void *c, int on, size_t n, const char *const *k) { return 0; }
EXPORT void *fmi2Instantiate(const char *n, int t, const char *g, const char *l, const void *f,
                             int v, int o)
{
    Crane *const c = calloc(1, sizeof *c);
    c->value[MASS] = 100;
    return c;
}
EXPORT void fmi2FreeInstance(void *c) { free(c); }
EXPORT int fmi2SetupExperiment(void *c, int d, double t, double s, int e, double p) { return 0; }
EXPORT int fmi2EnterInitializationMode(void *c) { return ((Crane *)c)->value[MISDEED] == 1 ? 3 : 0; }
EXPORT int fmi2ExitInitializationMode(void *c) { return 0; }
EXPORT int fmi2Terminate(void *c) { return 0; }
EXPORT int fmi2Reset(void *c) { return 0; }
EXPORT int fmi2GetReal(void *c, const unsigned *vr, size_t n, double *value)
{
    for (size_t i = 0; i < n; i++) {
        value[i] = ((Crane *)c)->value[vr[i]];
    }
    return 0;
}
EXPORT int fmi2SetReal(void *c, const unsigned *vr, size_t n, const double *value)
{
    for (size_t i = 0; i < n; i++) {
        ((Crane *)c)->value[vr[i]] = value[i];
    }
    return 0;
}
EXPORT int fmi2DoStep(void *c, double t, double h, int keep)
{
    Crane *const crane = c;
    double *const v = crane->value;
    const double aim = 0.1 * v[CURRENT], faded = exp(-h / 0.01), before = v[FORCE];
    if (t > 0.0495) {
        switch ((int)v[MISDEED]) {
        case 2: raise(SIGSEGV); break;
        case 3: return 3;
        case 4: return 2;
        case 5: pause(); break;
        case 6: _Exit(7);
        case 7: v[PLACE] = NAN; return 0;
        }
    }
    v[FORCE] = aim + (before - aim) * faded;
    v[PLACE] += 1e3 * h * (crane->speed + 0.5 * h * 1e3 * before / v[MASS]);
    crane->speed += h * 0.5e3 * (before + v[FORCE]) / v[MASS];
    return 0;
}
EXPORT int fmi2GetInteger(void *c, const unsigned *r, size_t n, int *v) { return 3; }
EXPORT int fmi2GetBoolean(void *c, const unsigned *r, size_t n, int *v) { return 3; }
EXPORT int fmi2GetString(void *c, const unsigned *r, size_t n, const char **v) { return 3; }
EXPORT int fmi2SetInteger(void *c, const unsigned *r, size_t n, const int *v) { return 3; }
EXPORT int fmi2SetBoolean(void *c, const unsigned *r, size_t n, const int *v) { return 3; }
EXPORT int fmi2SetString(void *c, const unsigned *r, size_t n, const char *const *v) { return 3; }
EXPORT int fmi2GetFMUstate(void *c, void **s) { return 3; }
EXPORT int fmi2SetFMUstate(void *c, void *s) { return 3; }
EXPORT int fmi2FreeFMUstate(void *c, void **s) { return 3; }
EXPORT int fmi2SerializedFMUstateSize(void *c, void *s, size_t *n) { return 3; }
EXPORT int fmi2SerializeFMUstate(void *c, void *s, char *b, size_t n) { return 3; }
EXPORT int fmi2DeSerializeFMUstate(void *c, const char *b, size_t n, void **s) { return 3; }
EXPORT int fmi2GetDirectionalDerivative(void *c, const unsigned *u, size_t n, const unsigned *k,
                                        size_t m, const double *s, double *r) { return 3; }
EXPORT int fmi2SetRealInputDerivatives(void *c, const unsigned *r, size_t n, const int *o,
                                       const double *v) { return 3; }
EXPORT int fmi2GetRealOutputDerivatives(void *c, const unsigned *r, size_t n, const int *o,
                                        double *v) { return 3; }
EXPORT int fmi2CancelStep(void *c) { return 3; }
EXPORT int fmi2GetStatus(void *c, int k, int *v) { return 2; }
EXPORT int fmi2GetRealStatus(void *c, int k, double *v) { return 2; }
EXPORT int fmi2GetIntegerStatus(void *c, int k, int *v) { return 2; }
EXPORT int fmi2GetBooleanStatus(void *c, int k, int *v) { return 2; }
EXPORT int fmi2GetStringStatus(void *c, int k, const char **v) { return 2; }
