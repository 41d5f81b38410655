/* FMI 3.0, Model Exchange and Co-Simulation. */
#include "fmi3Functions.h"
#include "instance.h"

#define THIS Instance *i = (Instance *)instance
#define CHECKED(what) ((what) ? failure(i) : fmi3OK)
#define VR const fmi3ValueReference

static fmi3Status failure(Instance *i)
{
  fmi3LogMessageCallback log = (fmi3LogMessageCallback)(size_t)i->logger;
  if (log) log(i->environment, fmi3Error, "logStatusError", i->machine.message);
  return fmi3Error;
}

static fmi3Status refused(fmi3Instance instance, const char *what)
{
  THIS;
  return CHECKED(complain(i, what) < 0);
}

static fmi3Instance made(fmi3String name, fmi3String token, int co_simulation, void *environment,
                         fmi3LogMessageCallback log)
{
  Instance *i = new_instance(name, co_simulation);
  if (!i) return NULL;
  i->logger = (void *)(size_t)log;
  i->environment = environment;
  if (token && strcmp(token, TOKEN) == 0) return i;
  (void)refused(i, "the instantiation token is that of another FMU");
  free(i);
  return NULL;
}

const char *fmi3GetVersion(void) { return fmi3Version; }

fmi3Status fmi3SetDebugLogging(fmi3Instance instance, fmi3Boolean on, size_t n,
                               const fmi3String names[])
{
  THIS;
  (void)n, (void)names;
  i->logs = on;
  return fmi3OK;
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources,
                                          fmi3Boolean visible, fmi3Boolean logging,
                                          fmi3InstanceEnvironment environment,
                                          fmi3LogMessageCallback log)
{
  (void)resources, (void)visible, (void)logging;
  return made(name, token, 0, environment, log);
}

fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
    fmi3Boolean logging, fmi3Boolean event_mode, fmi3Boolean early_return, VR between[], size_t n,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
    fmi3IntermediateUpdateCallback update)
{
  (void)resources, (void)visible, (void)logging, (void)early_return, (void)between, (void)n;
  (void)update;
  if (event_mode) return NULL; /* hasEventMode is false */
  return made(name, token, 1, environment, log);
}

fmi3Instance fmi3InstantiateScheduledExecution(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
    fmi3Boolean logging, fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
    fmi3ClockUpdateCallback update, fmi3LockPreemptionCallback lock,
    fmi3UnlockPreemptionCallback unlock)
{
  (void)name, (void)token, (void)resources, (void)visible, (void)logging, (void)environment;
  (void)log, (void)update, (void)lock, (void)unlock;
  return NULL;
}

void fmi3FreeInstance(fmi3Instance instance) { free(instance); }

fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean has_tolerance,
                                       fmi3Float64 tolerance, fmi3Float64 start,
                                       fmi3Boolean has_stop, fmi3Float64 stop)
{
  THIS;
  (void)has_stop, (void)stop;
  if (has_tolerance && tolerance > 0.0) i->machine.tolerance = tolerance;
  i->machine.t = start;
  machine_changed(&i->machine);
  return fmi3OK;
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance instance)
{
  THIS;
  return CHECKED(i->co_simulation && machine_event(&i->machine) < 0);
}

fmi3Status fmi3Reset(fmi3Instance instance)
{
  THIS;
  machine_begin(&i->machine);
  return fmi3OK;
}

#define NOTHING_TO_DO(name)                                                                       \
  fmi3Status name(fmi3Instance instance)                                                          \
  {                                                                                               \
    (void)instance;                                                                               \
    return fmi3OK;                                                                                \
  }
NOTHING_TO_DO(fmi3EnterEventMode)
NOTHING_TO_DO(fmi3Terminate)
NOTHING_TO_DO(fmi3EnterConfigurationMode)
NOTHING_TO_DO(fmi3ExitConfigurationMode)
NOTHING_TO_DO(fmi3EvaluateDiscreteStates)
NOTHING_TO_DO(fmi3EnterContinuousTimeMode)
NOTHING_TO_DO(fmi3EnterStepMode)

fmi3Status fmi3GetFloat64(fmi3Instance instance, VR vr[], size_t n, fmi3Float64 values[], size_t m)
{
  THIS;
  if (n != m) return refused(i, "all variables are numbers, a value each");
  return CHECKED(get_all(i, vr, n, values));
}

fmi3Status fmi3SetFloat64(fmi3Instance instance, VR vr[], size_t n, const fmi3Float64 values[],
                          size_t m)
{
  THIS;
  if (n != m) return refused(i, "all variables are numbers, a value each");
  return CHECKED(set_all(i, vr, n, values));
}

#define NO_VARIABLES(name, kind)                                                                  \
  fmi3Status name(fmi3Instance instance, VR vr[], size_t n, kind values[], size_t m)               \
  {                                                                                               \
    (void)vr, (void)values, (void)m;                                                              \
    return n ? refused(instance, "all variables are of type Float64") : fmi3OK;                    \
  }
#define NO_VARIABLES_OF(kind)                                                                     \
  NO_VARIABLES(fmi3Get##kind, fmi3##kind)                                                         \
  NO_VARIABLES(fmi3Set##kind, const fmi3##kind)
NO_VARIABLES_OF(Float32)
NO_VARIABLES_OF(Int8)
NO_VARIABLES_OF(UInt8)
NO_VARIABLES_OF(Int16)
NO_VARIABLES_OF(UInt16)
NO_VARIABLES_OF(Int32)
NO_VARIABLES_OF(UInt32)
NO_VARIABLES_OF(Int64)
NO_VARIABLES_OF(UInt64)
NO_VARIABLES_OF(Boolean)
NO_VARIABLES_OF(String)

fmi3Status fmi3GetBinary(fmi3Instance instance, VR vr[], size_t n, size_t sizes[],
                         fmi3Binary values[], size_t m)
{
  (void)vr, (void)sizes, (void)values, (void)m;
  return n ? refused(instance, "all variables are of type Float64") : fmi3OK;
}

fmi3Status fmi3SetBinary(fmi3Instance instance, VR vr[], size_t n, const size_t sizes[],
                         const fmi3Binary values[], size_t m)
{
  (void)vr, (void)sizes, (void)values, (void)m;
  return n ? refused(instance, "all variables are of type Float64") : fmi3OK;
}

#define NO_CLOCKS(name, ...)                                                                      \
  fmi3Status name(fmi3Instance instance, VR vr[], size_t n, __VA_ARGS__)                           \
  {                                                                                               \
    (void)vr, (void)a, (void)b;                                                                   \
    return n ? refused(instance, "there are no clocks: next event times are given") : fmi3OK;      \
  }
#define NO_CLOCK(name, kind)                                                                      \
  fmi3Status name(fmi3Instance instance, VR vr[], size_t n, kind a[])                              \
  {                                                                                               \
    (void)vr, (void)a;                                                                            \
    return n ? refused(instance, "there are no clocks: next event times are given") : fmi3OK;      \
  }
NO_CLOCK(fmi3GetClock, fmi3Clock)
NO_CLOCK(fmi3SetClock, const fmi3Clock)
NO_CLOCKS(fmi3GetIntervalDecimal, fmi3Float64 a[], fmi3IntervalQualifier b[])
NO_CLOCKS(fmi3GetShiftFraction, fmi3UInt64 a[], fmi3UInt64 b[])
NO_CLOCK(fmi3GetShiftDecimal, fmi3Float64)
NO_CLOCK(fmi3SetIntervalDecimal, const fmi3Float64)
NO_CLOCKS(fmi3SetIntervalFraction, const fmi3UInt64 a[], const fmi3UInt64 b[])
NO_CLOCK(fmi3SetShiftDecimal, const fmi3Float64)
NO_CLOCKS(fmi3SetShiftFraction, const fmi3UInt64 a[], const fmi3UInt64 b[])

fmi3Status fmi3GetIntervalFraction(fmi3Instance instance, VR vr[], size_t n, fmi3UInt64 counters[],
                                   fmi3UInt64 resolutions[], fmi3IntervalQualifier qualifiers[])
{
  (void)vr, (void)counters, (void)resolutions, (void)qualifiers;
  return n ? refused(instance, "there are no clocks: next event times are given") : fmi3OK;
}

fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance instance, fmi3ValueReference vr,
                                               size_t *n)
{
  (void)vr, (void)n;
  return refused(instance, "dependencies are not provided");
}

fmi3Status fmi3GetVariableDependencies(fmi3Instance instance, fmi3ValueReference vr, size_t of[],
                                       fmi3ValueReference on[], size_t elements[],
                                       fmi3DependencyKind kinds[], size_t n)
{
  (void)vr, (void)of, (void)on, (void)elements, (void)kinds, (void)n;
  return refused(instance, "dependencies are not provided");
}

fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState *state)
{
  THIS;
  return CHECKED(keep_state(i, state) < 0);
}

fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState state)
{
  THIS;
  i->machine = *(const Machine *)state;
  return fmi3OK;
}

fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *state)
{
  (void)instance;
  free_state(state);
  return fmi3OK;
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState state, size_t *size)
{
  (void)instance, (void)state;
  *size = sizeof(Machine);
  return fmi3OK;
}

fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState state, fmi3Byte bytes[],
                                 size_t size)
{
  THIS;
  return CHECKED(write_state(i, state, bytes, size) < 0);
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte bytes[], size_t size,
                                   fmi3FMUState *state)
{
  THIS;
  return CHECKED(read_state(i, bytes, size, state) < 0);
}

#define NO_DERIVATIVE(name)                                                                       \
  fmi3Status name(fmi3Instance instance, VR of[], size_t n, VR by[], size_t m,                     \
                  const fmi3Float64 seed[], size_t k, fmi3Float64 result[], size_t l)              \
  {                                                                                               \
    (void)of, (void)n, (void)by, (void)m, (void)seed, (void)k, (void)result, (void)l;              \
    return refused(instance, "directional derivatives are not provided");                         \
  }
NO_DERIVATIVE(fmi3GetDirectionalDerivative)
NO_DERIVATIVE(fmi3GetAdjointDerivative)

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance instance, fmi3Boolean *again,
                                    fmi3Boolean *terminate, fmi3Boolean *nominals,
                                    fmi3Boolean *values, fmi3Boolean *defined, fmi3Float64 *next)
{
  THIS;
  int jumped = machine_event(&i->machine);
  *again = *terminate = *nominals = fmi3False;
  *values = jumped > 0;
  *defined = i->machine.next < INFINITY;
  *next = i->machine.next;
  return CHECKED(jumped < 0);
}

/* -- Model Exchange */

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance instance, fmi3Boolean no_return,
                                       fmi3Boolean *event, fmi3Boolean *terminate)
{
  THIS;
  (void)no_return;
  int needed = machine_completed(&i->machine);
  *event = needed > 0;
  *terminate = fmi3False;
  return CHECKED(needed < 0);
}

fmi3Status fmi3SetTime(fmi3Instance instance, fmi3Float64 time)
{
  THIS;
  return CHECKED(machine_set(&i->machine, 0, time) < 0);
}

fmi3Status fmi3SetContinuousStates(fmi3Instance instance, const fmi3Float64 x[], size_t n)
{
  THIS;
  return CHECKED(set_continuous(i, x, n) < 0);
}

fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance instance, fmi3Float64 dx[], size_t n)
{
  THIS;
  return CHECKED(get_continuous(i, machine_rates(&i->machine), dx, n) < 0);
}

fmi3Status fmi3GetEventIndicators(fmi3Instance instance, fmi3Float64 z[], size_t n)
{
  THIS;
  return CHECKED(get_indicators(i, z, n) < 0);
}

fmi3Status fmi3GetContinuousStates(fmi3Instance instance, fmi3Float64 x[], size_t n)
{
  THIS;
  return CHECKED(get_continuous(i, i->machine.x, x, n) < 0);
}

fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance instance, fmi3Float64 nominals[],
                                             size_t n)
{
  (void)instance;
  for (size_t k = 0; k < n; ++k) nominals[k] = 1.0;
  return fmi3OK;
}

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance instance, size_t *n)
{
  (void)instance;
  *n = N_INDICATORS;
  return fmi3OK;
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance instance, size_t *n)
{
  (void)instance;
  *n = N_CONTINUOUS;
  return fmi3OK;
}

/* -- Co-Simulation */

fmi3Status fmi3GetOutputDerivatives(fmi3Instance instance, VR vr[], size_t n,
                                    const fmi3Int32 orders[], fmi3Float64 values[], size_t m)
{
  (void)vr, (void)n, (void)orders, (void)values, (void)m;
  return refused(instance, "derivatives of outputs are not provided");
}

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 begin, fmi3Float64 length,
                      fmi3Boolean no_return, fmi3Boolean *event, fmi3Boolean *terminate,
                      fmi3Boolean *early, fmi3Float64 *reached)
{
  THIS;
  (void)no_return;
  int result = do_step(i, begin, length);
  *event = *terminate = *early = fmi3False;
  *reached = i->machine.t;
  return CHECKED(result < 0);
}

fmi3Status fmi3ActivateModelPartition(fmi3Instance instance, fmi3ValueReference clock,
                                      fmi3Float64 time)
{
  (void)clock, (void)time;
  return refused(instance, "there is no scheduled execution");
}
