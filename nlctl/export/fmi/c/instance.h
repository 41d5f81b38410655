/* What both versions of FMI share: an instance, and what it may be asked. */
#ifndef INSTANCE_H
#define INSTANCE_H

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "machine.h"

typedef struct {
  Machine machine;
  int co_simulation, logs;
  void *environment, *logger;
  char name[128];
} Instance;

static Instance *new_instance(const char *name, int co_simulation)
{
  Instance *i = calloc(1, sizeof *i);
  if (!i) return NULL;
  machine_begin(&i->machine);
  i->co_simulation = co_simulation;
  strncpy(i->name, name ? name : "", sizeof i->name - 1);
  return i;
}

static int complain(Instance *i, const char *what)
{
  strncpy(i->machine.message, what, sizeof i->machine.message - 1);
  return -1;
}

static int get_all(Instance *i, const unsigned vr[], size_t n, double values[])
{
  int failed = 0;
  for (size_t k = 0; k < n && !failed; ++k) failed = machine_get(&i->machine, vr[k], &values[k]) < 0;
  return failed;
}

static int set_all(Instance *i, const unsigned vr[], size_t n, const double values[])
{
  int failed = 0;
  for (size_t k = 0; k < n && !failed; ++k) failed = machine_set(&i->machine, vr[k], values[k]) < 0;
  return failed;
}

/* the continuous ones among all states or rates */
static int get_continuous(Instance *i, const double all[], double x[], size_t n)
{
  if (n != N_CONTINUOUS) return complain(i, "another number of continuous states");
  for (int k = 0; k < N_STATES; ++k)
    if (model_continuous[k]) *x++ = all[k];
  return 0;
}

static int set_continuous(Instance *i, const double x[], size_t n)
{
  if (n != N_CONTINUOUS) return complain(i, "another number of continuous states");
  for (int k = 0; k < N_STATES; ++k)
    if (model_continuous[k]) i->machine.x[k] = *x++;
  machine_changed(&i->machine);
  return 0;
}

static int get_indicators(Instance *i, double z[], size_t n)
{
  if (n != N_INDICATORS) return complain(i, "another number of event indicators");
  if (n) machine_indicators(&i->machine, z);
  return 0;
}

static int do_step(Instance *i, double begin, double length)
{
  Machine *s = &i->machine;
  if (fabs(begin - s->t) > 1e-9 * fmax(fabs(s->t), 1.0) || !(length >= 0.0))
    return complain(i, "a step begins where the last one ended, and has a length >= 0");
  machine_changed(s);
  return machine_step(s, begin + length);
}

/* into the copy that is there, or a new one */
static int keep_state(Instance *i, void **state)
{
  if (!*state) *state = malloc(sizeof(Machine));
  if (!*state) return complain(i, "there is no memory for a state");
  *(Machine *)*state = i->machine;
  return 0;
}

static void free_state(void **state)
{
  if (!state) return;
  free(*state);
  *state = NULL;
}

static int write_state(Instance *i, const void *state, void *bytes, size_t size)
{
  if (size < sizeof(Machine)) return complain(i, "too little room for the state");
  memcpy(bytes, state, sizeof(Machine));
  return 0;
}

static int read_state(Instance *i, const void *bytes, size_t size, void **state)
{
  if (size != sizeof(Machine)) return complain(i, "a state of another FMU");
  if (keep_state(i, state) < 0) return -1;
  memcpy(*state, bytes, size);
  return 0;
}

#endif
