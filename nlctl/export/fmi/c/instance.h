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

static void get_states(const Instance *i, double x[])
{
  int n = 0;
  for (int k = 0; k < N_STATES; ++k)
    if (model_continuous[k]) x[n++] = i->machine.x[k];
}

static void set_states(Instance *i, const double x[])
{
  int n = 0;
  for (int k = 0; k < N_STATES; ++k)
    if (model_continuous[k]) i->machine.x[k] = x[n++];
  machine_changed(&i->machine);
}

static void get_rates(Instance *i, double dx[])
{
  const double *rates = machine_rates(&i->machine);
  int n = 0;
  for (int k = 0; k < N_STATES; ++k)
    if (model_continuous[k]) dx[n++] = rates[k];
}

static int do_step(Instance *i, double begin, double length)
{
  Machine *s = &i->machine;
  if (fabs(begin - s->t) > 1e-9 * fmax(fabs(s->t), 1.0) || !(length >= 0.0)) {
    strncpy(s->message, "a step begins where the last one ended, and has a length >= 0",
            sizeof s->message - 1);
    return -1;
  }
  machine_changed(s);
  return machine_step(s, begin + length);
}

static Machine *copy_of(const Machine *s)
{
  Machine *copy = malloc(sizeof *copy);
  if (copy) *copy = *s;
  return copy;
}

#endif
