/* A diagram between two calls of its importer: what it holds, and what may be done with it. */
#ifndef MACHINE_H
#define MACHINE_H

#include "model.h"

typedef struct {
  double t;      /* time (s) */
  double began;  /* the last instant at which something was due */
  double next;   /* the next one, INFINITY if there is none */
  double until;  /* the last time at which functions of t alone are what they are now */
  double h;      /* the step that the integrator tries next */
  double tolerance;
  double last;   /* length of the last step, 0 in Model Exchange */
  double fell;   /* when a guard fell last */
  double x[N_STATES + 1], u[N_INPUTS + 1], y[N_OUTPUTS + 1], p[N_PARAMETERS + 1], c[N_ROOM + 1];
  double dx[N_STATES + 1], g[N_SIGNS + 1], m[N_MEMORY + 1];
  double index[N_SERIES + 1];     /* of the next instant of each series of samples */
  double side[N_SIGNS + 1];       /* of what switches: 1, -1, or 0 where it is 0 */
  double came[N_SIGNS + 1];       /* the side on which it was last */
  double way[N_MEMORY + 1];       /* in which memories moved last */
  double rising[N_GUARDS + 1];    /* of guards that are to rise behind their jump, or NAN */
  int above[N_GUARDS + 1];        /* whether they were not negative when last seen */
  int moves[N_MEMORY + 1];        /* whether they move now */
  int at_break;                   /* of the instants of conditions of t */
  int prepared, known, outputs_known, started, crowd;
  int turned;                     /* a reversal of a memory has been located, and not passed */
  char message[240];              /* why something failed */
} Machine;

/* All begin as exported. */
void machine_begin(Machine *s);

/* At the start, at an instant that is due, or where a sign has changed: all that jumps there.
   Returns -1 for an error, 1 if a continuous state has jumped, else 0. */
int machine_event(Machine *s);

/* A step of the importer's integrator was accepted: memories follow.  Returns -1 for an error,
   1 if an event is needed, else 0. */
int machine_completed(Machine *s);

/* Integrates to a time; returns -1 for an error. */
int machine_step(Machine *s, double end);

void machine_changed(Machine *s);                /* something of t, x, u was set */
const double *machine_rates(Machine *s);         /* of all states */
const double *machine_outputs(Machine *s);
void machine_indicators(Machine *s, double z[]); /* N_INDICATORS of them */

/* By value reference; set returns -1 for what cannot be set, or not to this value. */
int machine_get(Machine *s, unsigned reference, double *value);
int machine_set(Machine *s, unsigned reference, double value);

#endif
