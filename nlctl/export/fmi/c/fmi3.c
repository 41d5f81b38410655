/* FMI 3.0, Model Exchange and Co-Simulation. */
#include "fmi3Functions.h"

#define FMI(name) fmi3##name
#define STATE(before, behind) STATE_(before, behind)
#define STATE_(before, behind) fmi3##before##FMUState##behind
#define DESERIALIZE Deserialize
#define RATES fmi3GetContinuousStateDerivatives
#define OK fmi3OK
#define FAILED fmi3Error
#define VR const fmi3ValueReference
typedef fmi3Instance Component;
typedef fmi3Status Status;
typedef fmi3Float64 Real;
typedef fmi3Boolean Boolean;
typedef fmi3String Text;
typedef fmi3Byte Byte;
typedef fmi3FMUState Kept;
#include "common.h"

static void say(Instance *i)
{
  fmi3LogMessageCallback log = (fmi3LogMessageCallback)(size_t)i->logger;
  log(i->environment, fmi3Error, "logStatusError", i->machine.message);
}

static fmi3Instance made(fmi3String name, fmi3String token, int co_simulation, void *environment,
                         fmi3LogMessageCallback log)
{
  Instance *i = new_instance(name, co_simulation);
  if (!i) return NULL;
  i->logger = (void *)(size_t)log;
  i->environment = environment;
  return checked(i, token, "the instantiation token is that of another FMU");
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

fmi3Status fmi3EnterInitializationMode(fmi3Instance component, fmi3Boolean has_tolerance,
                                       fmi3Float64 tolerance, fmi3Float64 start,
                                       fmi3Boolean has_stop, fmi3Float64 stop)
{
  THIS;
  (void)has_stop, (void)stop;
  begin_at(i, has_tolerance, tolerance, start);
  machine_changed(&i->machine);
  return fmi3OK;
}

NOTHING_TO_DO(fmi3EnterConfigurationMode)
NOTHING_TO_DO(fmi3ExitConfigurationMode)
NOTHING_TO_DO(fmi3EvaluateDiscreteStates)
NOTHING_TO_DO(fmi3EnterStepMode)

fmi3Status fmi3GetFloat64(fmi3Instance component, VR vr[], size_t n, fmi3Float64 values[], size_t m)
{
  THIS;
  if (n != m) return refused(i, "all variables are numbers, a value each");
  return CHECKED(get_all(i, vr, n, values));
}

fmi3Status fmi3SetFloat64(fmi3Instance component, VR vr[], size_t n, const fmi3Float64 values[],
                          size_t m)
{
  THIS;
  if (n != m) return refused(i, "all variables are numbers, a value each");
  return CHECKED(set_all(i, vr, n, values));
}

#define NO_VARIABLES(name, kind)                                                                  \
  fmi3Status name(fmi3Instance component, VR vr[], size_t n, kind values[], size_t m)             \
  {                                                                                               \
    (void)vr, (void)values, (void)m;                                                              \
    return n ? refused(component, "all variables are of type Float64") : fmi3OK;                  \
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

fmi3Status fmi3GetBinary(fmi3Instance component, VR vr[], size_t n, size_t sizes[],
                         fmi3Binary values[], size_t m)
{
  (void)vr, (void)sizes, (void)values, (void)m;
  return n ? refused(component, "all variables are of type Float64") : fmi3OK;
}

fmi3Status fmi3SetBinary(fmi3Instance component, VR vr[], size_t n, const size_t sizes[],
                         const fmi3Binary values[], size_t m)
{
  (void)vr, (void)sizes, (void)values, (void)m;
  return n ? refused(component, "all variables are of type Float64") : fmi3OK;
}

#define NO_CLOCKS(name, ...)                                                                      \
  fmi3Status name(fmi3Instance component, VR vr[], size_t n, __VA_ARGS__)                         \
  {                                                                                               \
    (void)vr, (void)a, (void)b;                                                                   \
    return n ? refused(component, "there are no clocks: next event times are given") : fmi3OK;    \
  }
#define NO_CLOCK(name, kind)                                                                      \
  fmi3Status name(fmi3Instance component, VR vr[], size_t n, kind a[])                            \
  {                                                                                               \
    (void)vr, (void)a;                                                                            \
    return n ? refused(component, "there are no clocks: next event times are given") : fmi3OK;    \
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

fmi3Status fmi3GetIntervalFraction(fmi3Instance component, VR vr[], size_t n, fmi3UInt64 counters[],
                                   fmi3UInt64 resolutions[], fmi3IntervalQualifier qualifiers[])
{
  (void)vr, (void)counters, (void)resolutions, (void)qualifiers;
  return n ? refused(component, "there are no clocks: next event times are given") : fmi3OK;
}

fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance component, fmi3ValueReference vr,
                                               size_t *n)
{
  (void)vr, (void)n;
  return refused(component, "dependencies are not provided");
}

fmi3Status fmi3GetVariableDependencies(fmi3Instance component, fmi3ValueReference vr, size_t of[],
                                       fmi3ValueReference on[], size_t elements[],
                                       fmi3DependencyKind kinds[], size_t n)
{
  (void)vr, (void)of, (void)on, (void)elements, (void)kinds, (void)n;
  return refused(component, "dependencies are not provided");
}

#define NO_DERIVATIVE(name)                                                                       \
  fmi3Status name(fmi3Instance component, VR of[], size_t n, VR by[], size_t m,                   \
                  const fmi3Float64 seed[], size_t k, fmi3Float64 result[], size_t l)             \
  {                                                                                               \
    (void)of, (void)n, (void)by, (void)m, (void)seed, (void)k, (void)result, (void)l;             \
    return refused(component, "directional derivatives are not provided");                        \
  }
NO_DERIVATIVE(fmi3GetDirectionalDerivative)
NO_DERIVATIVE(fmi3GetAdjointDerivative)

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance component, fmi3Boolean *again,
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

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance component, size_t *n)
{
  (void)component;
  *n = N_INDICATORS;
  return fmi3OK;
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance component, size_t *n)
{
  (void)component;
  *n = N_CONTINUOUS;
  return fmi3OK;
}

/* -- Co-Simulation */

fmi3Status fmi3GetOutputDerivatives(fmi3Instance component, VR vr[], size_t n,
                                    const fmi3Int32 orders[], fmi3Float64 values[], size_t m)
{
  (void)vr, (void)n, (void)orders, (void)values, (void)m;
  return refused(component, "derivatives of outputs are not provided");
}

fmi3Status fmi3DoStep(fmi3Instance component, fmi3Float64 begin, fmi3Float64 length,
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

fmi3Status fmi3ActivateModelPartition(fmi3Instance component, fmi3ValueReference clock,
                                      fmi3Float64 time)
{
  (void)clock, (void)time;
  return refused(component, "there is no scheduled execution");
}
