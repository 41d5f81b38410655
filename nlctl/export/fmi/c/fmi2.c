/* FMI 2.0, Model Exchange and Co-Simulation. */
#include "fmi2Functions.h"
#include "instance.h"

#define THIS Instance *i = (Instance *)c
#define CHECKED(what) ((what) ? failure(i) : fmi2OK)

static fmi2Status failure(Instance *i)
{
  fmi2CallbackLogger log = (fmi2CallbackLogger)(size_t)i->logger;
  if (log) log(i->environment, i->name, fmi2Error, "logStatusError", "%s", i->machine.message);
  return fmi2Error;
}

static fmi2Status refused(Instance *i, const char *what)
{
  return CHECKED(complain(i, what) < 0);
}

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String names[])
{
  THIS;
  (void)n, (void)names;
  i->logs = on;
  return fmi2OK;
}

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
  if (guid && strcmp(guid, TOKEN) == 0) return i;
  (void)refused(i, "the GUID is that of another FMU");
  free(i);
  return NULL;
}

void fmi2FreeInstance(fmi2Component c) { free(c); }

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean has_tolerance, fmi2Real tolerance,
                               fmi2Real start, fmi2Boolean has_stop, fmi2Real stop)
{
  THIS;
  (void)has_stop, (void)stop;
  if (has_tolerance && tolerance > 0.0) i->machine.tolerance = tolerance;
  i->machine.t = start;
  return fmi2OK;
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
  (void)c;
  return fmi2OK;
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
  THIS;
  return CHECKED(i->co_simulation && machine_event(&i->machine) < 0);
}

fmi2Status fmi2Terminate(fmi2Component c)
{
  (void)c;
  return fmi2OK;
}

fmi2Status fmi2Reset(fmi2Component c)
{
  THIS;
  machine_begin(&i->machine);
  return fmi2OK;
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real values[])
{
  THIS;
  return CHECKED(get_all(i, vr, n, values));
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                       const fmi2Real values[])
{
  THIS;
  return CHECKED(set_all(i, vr, n, values));
}

#define NO_VARIABLES(name, kind)                                                                  \
  fmi2Status name(fmi2Component c, const fmi2ValueReference vr[], size_t n, kind values[])         \
  {                                                                                               \
    (void)vr, (void)values;                                                                       \
    return n ? refused((Instance *)c, "all variables are real numbers") : fmi2OK;                  \
  }
NO_VARIABLES(fmi2GetInteger, fmi2Integer)
NO_VARIABLES(fmi2GetBoolean, fmi2Boolean)
NO_VARIABLES(fmi2GetString, fmi2String)
NO_VARIABLES(fmi2SetInteger, const fmi2Integer)
NO_VARIABLES(fmi2SetBoolean, const fmi2Boolean)
NO_VARIABLES(fmi2SetString, const fmi2String)

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state)
{
  THIS;
  return CHECKED(keep_state(i, state) < 0);
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state)
{
  THIS;
  i->machine = *(const Machine *)state;
  return fmi2OK;
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state)
{
  (void)c;
  free_state(state);
  return fmi2OK;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size)
{
  (void)c, (void)state;
  *size = sizeof(Machine);
  return fmi2OK;
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
{
  THIS;
  return CHECKED(write_state(i, state, bytes, size) < 0);
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size,
                                   fmi2FMUstate *state)
{
  THIS;
  return CHECKED(read_state(i, bytes, size, state) < 0);
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference z[], size_t nz,
                                        const fmi2ValueReference v[], size_t nv,
                                        const fmi2Real dv[], fmi2Real dz[])
{
  (void)z, (void)nz, (void)v, (void)nv, (void)dv, (void)dz;
  return refused((Instance *)c, "directional derivatives are not provided");
}

/* -- Model Exchange */

fmi2Status fmi2EnterEventMode(fmi2Component c)
{
  (void)c;
  return fmi2OK;
}

fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info)
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

fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c)
{
  (void)c;
  return fmi2OK;
}

fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean no_return, fmi2Boolean *event,
                                       fmi2Boolean *terminate)
{
  THIS;
  (void)no_return;
  int needed = machine_completed(&i->machine);
  *event = needed > 0;
  *terminate = fmi2False;
  return CHECKED(needed < 0);
}

fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time)
{
  THIS;
  return CHECKED(machine_set(&i->machine, 0, time) < 0);
}

fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t n)
{
  THIS;
  return CHECKED(set_continuous(i, x, n) < 0);
}

fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real dx[], size_t n)
{
  THIS;
  return CHECKED(get_continuous(i, machine_rates(&i->machine), dx, n) < 0);
}

fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real z[], size_t n)
{
  THIS;
  return CHECKED(get_indicators(i, z, n) < 0);
}

fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t n)
{
  THIS;
  return CHECKED(get_continuous(i, i->machine.x, x, n) < 0);
}

fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real nominal[], size_t n)
{
  (void)c;
  for (size_t k = 0; k < n; ++k) nominal[k] = 1.0;
  return fmi2OK;
}

/* -- Co-Simulation */

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                       const fmi2Integer order[], const fmi2Real values[])
{
  (void)vr, (void)n, (void)order, (void)values;
  return refused((Instance *)c, "inputs are held over a step");
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                        const fmi2Integer order[], fmi2Real values[])
{
  (void)vr, (void)n, (void)order, (void)values;
  return refused((Instance *)c, "derivatives of outputs are not provided");
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real begin, fmi2Real length, fmi2Boolean no_return)
{
  THIS;
  (void)no_return;
  return CHECKED(do_step(i, begin, length) < 0);
}

fmi2Status fmi2CancelStep(fmi2Component c)
{
  return refused((Instance *)c, "a step cannot be cancelled: it ends before it returns");
}

fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Status *value)
{
  (void)c, (void)kind;
  *value = fmi2OK;
  return fmi2OK;
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value)
{
  THIS;
  if (kind != fmi2LastSuccessfulTime) return fmi2Discard;
  *value = i->machine.t;
  return fmi2OK;
}

fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Integer *value)
{
  (void)c, (void)kind, (void)value;
  return fmi2Discard;
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value)
{
  (void)c;
  if (kind != fmi2Terminated) return fmi2Discard;
  *value = fmi2False;
  return fmi2OK;
}

fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind kind, fmi2String *value)
{
  (void)c, (void)kind, (void)value;
  return fmi2Discard;
}
