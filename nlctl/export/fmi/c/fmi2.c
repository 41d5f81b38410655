/* FMI 2.0, Model Exchange and Co-Simulation. */
#include "fmi2Functions.h"

#define FMI(name) fmi2##name
#define STATE(before, behind) STATE_(before, behind)
#define STATE_(before, behind) fmi2##before##FMUstate##behind
#define DESERIALIZE DeSerialize
#define RATES fmi2GetDerivatives
#define OK fmi2OK
#define FAILED fmi2Error
typedef fmi2Component Component;
typedef fmi2Status Status;
typedef fmi2Real Real;
typedef fmi2Boolean Boolean;
typedef fmi2String Text;
typedef fmi2Byte Byte;
typedef fmi2FMUstate Kept;
#include "common.h"

static void say(Instance *i)
{
  fmi2CallbackLogger log = (fmi2CallbackLogger)(size_t)i->logger;
  log(i->environment, i->name, fmi2Error, "logStatusError", "%s", i->machine.message);
}

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible,
                              fmi2Boolean logging)
{
  (void)resources, (void)visible;
  Instance *i = new_instance(name, type == fmi2CoSimulation);
  if (!i) return NULL;
  i->logger = functions ? (void *)(size_t)functions->logger : NULL;
  i->environment = functions ? functions->componentEnvironment : NULL;
  i->logs = logging;
  return checked(i, guid, "the GUID is that of another FMU");
}

fmi2Status fmi2SetupExperiment(fmi2Component component, fmi2Boolean has_tolerance,
                               fmi2Real tolerance, fmi2Real start, fmi2Boolean has_stop,
                               fmi2Real stop)
{
  THIS;
  (void)has_stop, (void)stop;
  begin_at(i, has_tolerance, tolerance, start);
  return fmi2OK;
}

NOTHING_TO_DO(fmi2EnterInitializationMode)

fmi2Status fmi2GetReal(fmi2Component component, const fmi2ValueReference vr[], size_t n,
                       fmi2Real values[])
{
  THIS;
  return CHECKED(get_all(i, vr, n, values));
}

fmi2Status fmi2SetReal(fmi2Component component, const fmi2ValueReference vr[], size_t n,
                       const fmi2Real values[])
{
  THIS;
  return CHECKED(set_all(i, vr, n, values));
}

#define NO_VARIABLES(name, kind)                                                                  \
  fmi2Status name(fmi2Component component, const fmi2ValueReference vr[], size_t n, kind values[])\
  {                                                                                               \
    (void)vr, (void)values;                                                                       \
    return n ? refused(component, "all variables are real numbers") : fmi2OK;                     \
  }
NO_VARIABLES(fmi2GetInteger, fmi2Integer)
NO_VARIABLES(fmi2GetBoolean, fmi2Boolean)
NO_VARIABLES(fmi2GetString, fmi2String)
NO_VARIABLES(fmi2SetInteger, const fmi2Integer)
NO_VARIABLES(fmi2SetBoolean, const fmi2Boolean)
NO_VARIABLES(fmi2SetString, const fmi2String)

fmi2Status fmi2GetDirectionalDerivative(fmi2Component component, const fmi2ValueReference z[],
                                        size_t nz, const fmi2ValueReference v[], size_t nv,
                                        const fmi2Real dv[], fmi2Real dz[])
{
  (void)z, (void)nz, (void)v, (void)nv, (void)dv, (void)dz;
  return refused(component, "directional derivatives are not provided");
}

/* -- Model Exchange */

fmi2Status fmi2NewDiscreteStates(fmi2Component component, fmi2EventInfo *info)
{
  THIS;
  int jumped = machine_event(&i->machine);
  info->newDiscreteStatesNeeded = info->terminateSimulation = fmi2False;
  info->nominalsOfContinuousStatesChanged = fmi2False;
  info->valuesOfContinuousStatesChanged = jumped > 0;
  info->nextEventTimeDefined = i->machine.next < INFINITY;
  info->nextEventTime = i->machine.next;
  return CHECKED(jumped < 0);
}

/* -- Co-Simulation */

fmi2Status fmi2SetRealInputDerivatives(fmi2Component component, const fmi2ValueReference vr[],
                                       size_t n, const fmi2Integer order[], const fmi2Real values[])
{
  (void)vr, (void)n, (void)order, (void)values;
  return refused(component, "inputs are held over a step");
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component component, const fmi2ValueReference vr[],
                                        size_t n, const fmi2Integer order[], fmi2Real values[])
{
  (void)vr, (void)n, (void)order, (void)values;
  return refused(component, "derivatives of outputs are not provided");
}

fmi2Status fmi2DoStep(fmi2Component component, fmi2Real begin, fmi2Real length,
                      fmi2Boolean no_return)
{
  THIS;
  (void)no_return;
  return CHECKED(do_step(i, begin, length) < 0);
}

fmi2Status fmi2CancelStep(fmi2Component component)
{
  return refused(component, "a step cannot be cancelled: it ends before it returns");
}

fmi2Status fmi2GetStatus(fmi2Component component, const fmi2StatusKind kind, fmi2Status *value)
{
  (void)component, (void)kind;
  *value = fmi2OK;
  return fmi2OK;
}

fmi2Status fmi2GetRealStatus(fmi2Component component, const fmi2StatusKind kind, fmi2Real *value)
{
  THIS;
  if (kind != fmi2LastSuccessfulTime) return fmi2Discard;
  *value = i->machine.t;
  return fmi2OK;
}

fmi2Status fmi2GetIntegerStatus(fmi2Component component, const fmi2StatusKind kind,
                                fmi2Integer *value)
{
  (void)component, (void)kind, (void)value;
  return fmi2Discard;
}

fmi2Status fmi2GetBooleanStatus(fmi2Component component, const fmi2StatusKind kind,
                                fmi2Boolean *value)
{
  (void)component;
  if (kind != fmi2Terminated) return fmi2Discard;
  *value = fmi2False;
  return fmi2OK;
}

fmi2Status fmi2GetStringStatus(fmi2Component component, const fmi2StatusKind kind,
                               fmi2String *value)
{
  (void)component, (void)kind, (void)value;
  return fmi2Discard;
}
