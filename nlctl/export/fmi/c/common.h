/* Functions that both versions of FMI have, but for their names.

   Before it is included, fmi2.c and fmi3.c say what these are: `FMI(Reset)` and `STATE(Get, )`, the
   types Component, Status, Real, Boolean, Text, Byte and Kept, and OK and FAILED. */
#include "instance.h"

#define THIS Instance *i = (Instance *)component
#define CHECKED(what) ((what) ? failure(i) : OK)

/* log the message of an instance */
static void say(Instance *i);

static Status failure(Instance *i)
{
  if (i->logger) say(i);
  return FAILED;
}

static Status refused(Component component, const char *what)
{
  THIS;
  return CHECKED(complain(i, what) < 0);
}

static Component checked(Instance *i, const char *token, const char *what)
{
  if (token && strcmp(token, TOKEN) == 0) return i;
  (void)refused(i, what);
  free(i);
  return NULL;
}

static void begin_at(Instance *i, int has_tolerance, double tolerance, double start)
{
  if (has_tolerance && tolerance > 0.0) i->machine.tolerance = tolerance;
  i->machine.t = start;
}

const char *FMI(GetVersion)(void) { return FMI(Version); }

Status FMI(SetDebugLogging)(Component component, Boolean on, size_t n, const Text names[])
{
  THIS;
  (void)n, (void)names;
  i->logs = on;
  return OK;
}

void FMI(FreeInstance)(Component component) { free(component); }

Status FMI(ExitInitializationMode)(Component component)
{
  THIS;
  return CHECKED(i->co_simulation && machine_event(&i->machine) < 0);
}

Status FMI(Reset)(Component component)
{
  THIS;
  machine_begin(&i->machine);
  return OK;
}

#define NOTHING_TO_DO(name)                                                                       \
  Status name(Component component)                                                                \
  {                                                                                               \
    (void)component;                                                                              \
    return OK;                                                                                    \
  }
NOTHING_TO_DO(FMI(EnterEventMode))
NOTHING_TO_DO(FMI(EnterContinuousTimeMode))
NOTHING_TO_DO(FMI(Terminate))

Status STATE(Get, )(Component component, Kept *state)
{
  THIS;
  return CHECKED(keep_state(i, state) < 0);
}

Status STATE(Set, )(Component component, Kept state)
{
  THIS;
  i->machine = *(const Machine *)state;
  return OK;
}

Status STATE(Free, )(Component component, Kept *state)
{
  (void)component;
  free_state(state);
  return OK;
}

Status STATE(Serialized, Size)(Component component, Kept state, size_t *size)
{
  (void)component, (void)state;
  *size = sizeof(Machine);
  return OK;
}

Status STATE(Serialize, )(Component component, Kept state, Byte bytes[], size_t size)
{
  THIS;
  return CHECKED(write_state(i, state, bytes, size) < 0);
}

Status STATE(DESERIALIZE, )(Component component, const Byte bytes[], size_t size, Kept *state)
{
  THIS;
  return CHECKED(read_state(i, bytes, size, state) < 0);
}

/* -- Model Exchange */

Status FMI(CompletedIntegratorStep)(Component component, Boolean no_return, Boolean *event,
                                    Boolean *terminate)
{
  THIS;
  (void)no_return;
  int needed = machine_completed(&i->machine);
  *event = needed > 0;
  *terminate = 0;
  return CHECKED(needed < 0);
}

Status FMI(SetTime)(Component component, Real time)
{
  THIS;
  return CHECKED(machine_set(&i->machine, 0, time) < 0);
}

Status FMI(SetContinuousStates)(Component component, const Real x[], size_t n)
{
  THIS;
  return CHECKED(set_continuous(i, x, n) < 0);
}

Status FMI(GetContinuousStates)(Component component, Real x[], size_t n)
{
  THIS;
  return CHECKED(get_continuous(i, i->machine.x, x, n) < 0);
}

Status RATES(Component component, Real dx[], size_t n)
{
  THIS;
  return CHECKED(get_continuous(i, machine_rates(&i->machine), dx, n) < 0);
}

Status FMI(GetEventIndicators)(Component component, Real z[], size_t n)
{
  THIS;
  return CHECKED(get_indicators(i, z, n) < 0);
}

Status FMI(GetNominalsOfContinuousStates)(Component component, Real nominals[], size_t n)
{
  (void)component;
  for (size_t k = 0; k < n; ++k) nominals[k] = 1.0;
  return OK;
}
