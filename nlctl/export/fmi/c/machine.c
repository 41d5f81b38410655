/* What happens between two steps, at events, and within a step of co-simulation.

   Time is seen on the near side of what is due next, until it has happened. */
#include "machine.h"
#include "sharp.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#define MOST_JUMPS 100      /* at one instant, or without progress of time */
#define MOST_CROSSINGS 20000 /* in one step of co-simulation */
#define MOST_STEPS 10000000
#define STILL 1e-11         /* of a time: less is no progress */
#define SOON 1e-11          /* of a time: right behind it */
#define NOISE 1e-13         /* of a memory: less is rounding, and no movement */
#define TURNED 2
#define FIRST_GUARD (N_SIGNS - N_GUARDS)

static int failed(Machine *s, const char *what)
{
  (void)snprintf(s->message, sizeof s->message, "t = %.9g s: %s", s->t, what);
  return -1;
}

static double rounding(double t) { return 1e-12 * fmax(fabs(t), 1.0); }

static double seen(const Machine *s, double t)
{
  if (t < s->began) t = s->began;
  return t < s->until ? t : s->until;
}

void machine_changed(Machine *s) { s->known = s->outputs_known = 0; }

static void evaluate(Machine *s)
{
  if (s->known) return;
  if (!s->prepared) model_prepare(s->p, s->c);
  s->prepared = s->known = 1;
  model_rates(seen(s, s->t), s->x, s->u, s->c, s->dx, s->g, s->m);
  for (int i = 0; i < N_STATES; ++i)
    if (!model_continuous[i]) s->dx[i] = 0.0;
}

const double *machine_rates(Machine *s)
{
  evaluate(s);
  return s->dx;
}

const double *machine_outputs(Machine *s)
{
  evaluate(s);
  if (!s->outputs_known) model_outputs(seen(s, s->t), s->x, s->u, s->c, s->y);
  s->outputs_known = 1;
  return s->y;
}

/* -- instants that are known before */

static double instant(const Machine *s, int k)
{
  const double *series = model_series[k];
  return (series[0] + s->index[k] * series[1]) / series[2];
}

static void look_ahead(Machine *s)
{
  s->next = INFINITY;
  for (int k = 0; k < N_SERIES; ++k) s->next = fmin(s->next, instant(s, k));
  s->until = nextafter(s->next, -INFINITY);
  if (s->at_break == N_BREAKS) return;
  s->next = fmin(s->next, model_breaks[s->at_break][1]);
  s->until = fmin(s->until, model_breaks[s->at_break][0]);
}

static void begin_instants(Machine *s)
{
  double early = s->t - rounding(s->t);
  for (int k = 0; k < N_SERIES; ++k) {
    const double *series = model_series[k];
    s->index[k] = fmax(0.0, floor((early * series[2] - series[0]) / series[1]) - 1.0);
    while (instant(s, k) < early) s->index[k] += 1.0;
  }
  s->at_break = 0;
  while (s->at_break < N_BREAKS && model_breaks[s->at_break][1] <= s->t) ++s->at_break;
  s->began = s->t;
  look_ahead(s);
}

/* Takes what is due off the lists; returns the series that sample as bits. */
static unsigned due(Machine *s)
{
  unsigned which = 0;
  double late = s->t + rounding(s->t);
  s->began = fmax(s->began, s->t);
  for (int k = 0; k < N_SERIES; ++k) {
    if (instant(s, k) > late) continue;
    which |= 1u << k;
    s->began = fmax(s->began, instant(s, k));
    s->index[k] += 1.0;
  }
  while (s->at_break < N_BREAKS && model_breaks[s->at_break][1] <= late)
    s->began = fmax(s->began, model_breaks[s->at_break++][1]);
  look_ahead(s);
  return which;
}

static int sample(Machine *s, unsigned which)
{
  double after[N_SAMPLED + 1];
  for (int k = 0; k < N_MEETINGS; ++k) {
    if (model_meetings[k] != which) continue;
    if (!s->prepared) model_prepare(s->p, s->c);
    s->prepared = 1;
    for (int i = 0; i < N_SAMPLED; ++i) after[i] = s->x[model_sampled[i]];
    model_sample(k, s->began, s->x, s->u, s->c, after);
    for (int i = 0; i < N_SAMPLED; ++i) s->x[model_sampled[i]] = after[i];
    machine_changed(s);
    return 0;
  }
  return failed(s, "clocks meet that should not");
}

/* -- memories and guards */

static int commit(Machine *s)
{
  int moved = 0;
  evaluate(s);
  for (int i = 0; i < N_MEMORY; ++i) {
    double *kept = &s->x[model_memory[i]];
    if (*kept != s->m[i] && !(isnan(*kept) && isnan(s->m[i]))) {
      *kept = s->m[i];
      moved = 1;
    }
  }
  if (moved) machine_changed(s);
  return moved;
}

/* How memories are about to move: a difference over a short time along the rates. */
static void movement(Machine *s, double t, const double x[], const double dx[], const double m[],
                     double moved[])
{
  double ahead[N_STATES + 1], rates[N_STATES + 1], signs[N_SIGNS + 1];
  double soon = s->last > 0.0 ? fmin(SHORT_TIME, 0.01 * s->last) : SHORT_TIME;
  for (int i = 0; i < N_STATES; ++i)
    ahead[i] = x[i] + (model_continuous[i] ? soon * dx[i] : 0.0);
  model_rates(seen(s, t + soon), ahead, s->u, s->c, rates, signs, moved);
  for (int i = 0; i < N_MEMORY; ++i) {
    moved[i] -= m[i];
    if (fabs(moved[i]) <= 10.0 * NOISE * (1.0 + fabs(m[i]))) moved[i] = 0.0;
  }
}

/* Up to which number a switching function is 0 but for rounding. */
static double level(const Machine *s)
{
  double most = 1.0;
  for (int i = 0; i < N_MEMORY; ++i) most = fmax(most, fabs(s->m[i]));
  return 10.0 * NOISE * most;
}

static void see_sides(Machine *s)
{
  evaluate(s);
  double least = level(s);
  for (int i = 0; i < N_SIGNS; ++i) { /* what blocks declare is 0 while a memory is carried along */
    if (i < N_DECLARED && fabs(s->g[i]) <= least) s->side[i] = 0.0;
    else if (s->g[i] != 0.0) s->side[i] = s->came[i] = s->g[i] > 0.0 ? 1.0 : -1.0;
  }
  for (int i = 0; i < N_GUARDS; ++i) s->above[i] = s->g[FIRST_GUARD + i] >= 0.0;
  if (N_MEMORY) {
    double moved[N_MEMORY + 1];
    movement(s, s->t, s->x, s->dx, s->m, moved);
    for (int i = 0; i < N_MEMORY; ++i) {
      s->moves[i] = moved[i] != 0.0;
      if (s->moves[i]) s->way[i] = moved[i] > 0.0 ? 1.0 : -1.0;
    }
  }
}

/* Memories that are about to reverse have done so when they are committed. */
static void reverse(Machine *s)
{
  double moved[N_MEMORY + 1];
  evaluate(s);
  movement(s, s->t, s->x, s->dx, s->m, moved);
  for (int i = 0; i < N_MEMORY; ++i)
    if (s->way[i] * moved[i] < 0.0) s->way[i] = -s->way[i];
}

/* A memory that jumps, where an importer has stopped right before: what it becomes right behind. */
static void leap(Machine *s)
{
  double ahead[N_STATES + 1], rates[N_STATES + 1], signs[N_SIGNS + 1], m[N_MEMORY + 1];
  double soon = SOON * fmax(fabs(s->t), 1.0);
  evaluate(s);
  for (int k = 0; k < N_STATES; ++k) ahead[k] = s->x[k] + soon * s->dx[k];
  model_rates(seen(s, s->t + soon), ahead, s->u, s->c, rates, signs, m);
  for (int i = 0; i < N_MEMORY; ++i) {
    if (!(fabs(m[i] - s->m[i]) > 1e-6 * (1.0 + fabs(s->m[i])))) continue;
    s->x[model_memory[i]] = m[i];
    machine_changed(s);
  }
}

/* Whether a guard at 0 is on its way down: an importer may stop right before. */
static int falls_now(Machine *s, int i)
{
  double ahead[N_STATES + 1], rates[N_STATES + 1], signs[N_SIGNS + 1], m[N_MEMORY + 1];
  double soon = SOON * fmax(fabs(s->t), 1.0);
  for (int k = 0; k < N_STATES; ++k) ahead[k] = s->x[k] + soon * s->dx[k];
  model_rates(seen(s, s->t + soon), ahead, s->u, s->c, rates, signs, m);
  return signs[FIRST_GUARD + i] < 0.0;
}

static int fall(Machine *s, const int fallen[])
{
  double after[N_RESETS + 1];
  model_reset(seen(s, s->t), s->x, s->u, s->c, after);
  for (int m = 0; m < N_RESETS; ++m)
    for (int i = 0; i < N_GUARDS; ++i)
      if (fallen[i] && model_owned[i][m]) s->x[model_reset_states[m]] = after[m];
  machine_changed(s);
  s->crowd = s->t - s->fell <= STILL * fmax(fabs(s->t), 1e-300) ? s->crowd + 1 : 0;
  s->fell = s->t;
  return s->crowd > MOST_JUMPS ? failed(s, "jumps follow each other without end (Zeno)") : 1;
}

/* Lets all guards jump that have fallen, together, and again what falls by that. */
static int jump(Machine *s)
{
  int any = 0;
  for (int again = 0; N_GUARDS && again <= MOST_JUMPS; ++again) {
    int fallen[N_GUARDS + 1] = {0}, some = 0;
    evaluate(s);
    for (int i = 0; i < N_GUARDS; ++i) {
      double value = s->g[FIRST_GUARD + i];
      if (isnan(value)) return failed(s, "a guard is NaN");
      fallen[i] = s->above[i] && (value < 0.0 || (again == 0 && falls_now(s, i)));
      some |= fallen[i];
    }
    for (int i = 0; i < N_GUARDS; ++i) s->above[i] = s->g[FIRST_GUARD + i] >= 0.0;
    if (!some) return any;
    any = 1;
    if (fall(s, fallen) < 0) return -1;
    while (commit(s) && again <= MOST_JUMPS) ++again;
    evaluate(s);
    for (int i = 0; i < N_GUARDS; ++i)
      if (fallen[i]) {
        double value = s->g[FIRST_GUARD + i];
        s->above[i] = value >= 0.0;
        s->rising[i] = value < 0.0 ? value : NAN;
      }
  }
  return N_GUARDS ? failed(s, "jumps at one instant have no end") : 0;
}

/* A guard that was negative behind its jump has to rise: else jumps come faster than steps. */
static int check_rising(Machine *s)
{
  for (int i = 0; i < N_GUARDS; ++i) {
    if (isnan(s->rising[i]) || s->t <= s->fell) continue;
    if (s->g[FIRST_GUARD + i] < s->rising[i])
      return failed(s, "jumps accumulate: a guard does not rise behind its jump (Zeno)");
    s->rising[i] = NAN;
  }
  return 0;
}

/* Conditions of t alone were solved from 0 to the exported stop time. */
static int check_known(Machine *s, double t)
{
  if (isinf(KNOWN_UNTIL) || (s->t >= 0.0 && t <= KNOWN_UNTIL + rounding(t))) return 0;
  return failed(s, "when conditions of t switch is known from 0 until stop_time alone: export "
                   "with a later one");
}

int machine_event(Machine *s)
{
  int jumped = 0;
  if (!s->started) {
    begin_instants(s);
    machine_changed(s);
  }
  if (check_known(s, s->t) < 0) return -1;
  unsigned which = due(s);
  machine_changed(s);
  if (N_MEMORY && s->started) reverse(s);
  if (which && sample(s, which) < 0) return -1;
  for (int i = 0; i <= N_MEMORY && commit(s); ++i) continue;
  if (s->started) {
    if (N_MEMORY) leap(s);
    jumped = jump(s);
    if (jumped < 0) return -1;
  }
  see_sides(s);
  s->started = 1;
  return jumped;
}

int machine_completed(Machine *s)
{
  double before[N_STATES + 1];
  evaluate(s);
  if (check_known(s, s->t) < 0 || check_rising(s) < 0) return -1;
  for (int i = 0; i < N_GUARDS; ++i)
    if (s->above[i] && s->g[FIRST_GUARD + i] < 0.0) return 1;
  memcpy(before, s->dx, sizeof before);
  if (N_MEMORY) reverse(s);
  if (commit(s)) {
    evaluate(s);
    for (int i = 0; i < N_STATES; ++i)
      if (model_continuous[i] && before[i] != s->dx[i]) return 1;
  }
  if (N_MEMORY) see_sides(s);
  return 0;
}

void machine_indicators(Machine *s, double z[])
{
  evaluate(s);
  memcpy(z, s->g, N_SIGNS * sizeof(double));
  if (N_MEMORY) {
    double least = level(s);
    for (int i = 0; i < N_DECLARED; ++i)
      if (s->side[i] == 0.0) z[i] -= 2.0 * least * s->came[i];
    movement(s, s->t, s->x, s->dx, s->m, z + N_SIGNS);
    for (int i = 0; i < N_MEMORY; ++i)
      if (z[N_SIGNS + i] == 0.0) z[N_SIGNS + i] = s->way[i] * DBL_MIN;
  }
}

/* -- the integrator of co-simulation: an explicit pair whose steps end right before a sign changes */

typedef struct {
  double k[STAGES][N_STATES + 1], x[N_STATES + 1], g[N_SIGNS + 1], m[N_MEMORY + 1];
  double error;
} Trial;

static int beyond(const Machine *s, const double g[])
{
  for (int i = 0; i < FIRST_GUARD; ++i)
    if (s->side[i] * g[i] < 0.0) return 1;
  for (int i = FIRST_GUARD; i < N_SIGNS; ++i)
    if (s->above[i - FIRST_GUARD] && g[i] < 0.0) return 1;
  return 0;
}

/* Whether a memory that moves has stopped since `before`, which becomes `m`. */
static int turns(const Machine *s, double before[], const double m[])
{
  int found = 0;
  for (int i = 0; i < N_MEMORY; ++i) {
    int back = s->way[i] * (m[i] - before[i]) < -NOISE * (1.0 + fabs(m[i]));
    found |= s->moves[i] && (back || m[i] == s->x[model_memory[i]]);
    before[i] = m[i];
  }
  return found;
}

/* A step of length h; returns what it has met: signs on another side, memories that turn. */
static int attempt(const Machine *s, Trial *r, double h)
{
  int over = 0;
  double before[N_MEMORY + 1];
  for (int i = 0; i < N_MEMORY; ++i) before[i] = s->x[model_memory[i]];
  for (int j = 1; j < STAGES; ++j) {
    memcpy(r->x, s->x, N_STATES * sizeof(double));
    for (int l = 0; l < j; ++l) {
      double part = h * model_a[j - 1][l];
      for (int i = 0; i < N_STATES; ++i) r->x[i] += part * r->k[l][i];
    }
    for (int i = 0; N_STILL && i < N_STATES; ++i)
      if (!model_continuous[i]) r->x[i] = s->x[i];
    model_rates(seen(s, s->t + model_nodes[j] * h), r->x, s->u, (double *)s->c, r->k[j], r->g, r->m);
    over |= beyond(s, r->g);
    if (j != STAGES - 2 && turns(s, before, r->m)) over |= TURNED;
  }
  r->error = 0.0;
  double difference[N_STATES + 1] = {0.0};
  for (int l = 0; l < STAGES; ++l)
    for (int i = 0; i < N_STATES; ++i) difference[i] += model_error[l] * r->k[l][i];
  for (int i = 0; i < N_STATES; ++i) {
    if (!model_continuous[i]) continue;
    double sum = fabs(h * difference[i]) / (s->tolerance * (1.0 + fmax(fabs(s->x[i]), fabs(r->x[i]))));
    if (r->error < INFINITY && !(sum <= r->error)) r->error = isfinite(sum) ? sum : INFINITY;
  }
  return over;
}

static void accept(Machine *s, const Trial *r, double t)
{
  s->t = t;
  memcpy(s->x, r->x, N_STATES * sizeof(double));
  memcpy(s->dx, r->k[STAGES - 1], N_STATES * sizeof(double));
  memcpy(s->g, r->g, N_SIGNS * sizeof(double));
  memcpy(s->m, r->m, N_MEMORY * sizeof(double));
  s->known = 1;
  s->outputs_known = 0;
}

/* Over a change of sign: so short a step that only rounding counts in it. */
static int cross(Machine *s, double h)
{
  evaluate(s);
  for (int i = 0; i < N_STATES; ++i)
    if (model_continuous[i]) s->x[i] += h * s->dx[i];
  s->t += h;
  machine_changed(s);
  commit(s);
  if (jump(s) < 0) return -1;
  see_sides(s);
  return 0;
}

/* Whether a memory has moved by more than error control would see. */
static int leads_far(const Machine *s, const Trial *r)
{
  double least = fmax(NOISE, 0.01 * s->tolerance);
  for (int i = 0; i < N_MEMORY; ++i)
    if (fabs(r->m[i] - s->x[model_memory[i]]) > least * (1.0 + fabs(r->m[i]))) return 1;
  return 0;
}

/* Finds where the first sign changes in a step, and leads over that. */
static int locate(Machine *s, Trial *r, double h)
{
  double low = 0.0, high = h, least = 4.0 * DBL_EPSILON * fmax(fabs(s->t), h);
  int met = 0, far = 0;
  while (high - low > least) {
    double middle = 0.5 * (low + high);
    int here = attempt(s, r, middle);
    if (here) {
      high = middle;
      met = here;
    } else low = middle;
  }
  if (low > 0.0) {
    (void)attempt(s, r, low);
    if (!(r->error <= 1.0)) return 1; /* too long a step to be trusted */
    far = leads_far(s, r);
    accept(s, r, s->t + low);
    if (check_rising(s) < 0) return -1;
    commit(s);
  }
  s->turned = met == TURNED && !far;
  return cross(s, high - low);
}

static double factor(double error)
{
  double by = 0.9 * pow(fmax(error, 1e-10), -1.0 / ORDER);
  return fmin(fmax(by, 0.2), 5.0);
}

/* One step, to `stop` at most; crossings are counted. */
static int advance(Machine *s, double stop, int *crossings)
{
  Trial r;
  double room = stop - s->t, h = fmin(fmin(s->h, LONGEST), room);
  evaluate(s);
  see_sides(s);
  for (int i = 0; s->turned && i < N_MEMORY; ++i) s->moves[i] = 0; /* it has been located */
  memcpy(r.k[0], s->dx, sizeof r.k[0]);
  for (int tries = 0; tries < 200; ++tries) {
    int over = attempt(s, &r, h);
    double part = r.error < 1e3 ? sharp_followed(s, s->dx, r.x, r.k[STAGES - 1], h) : 1.0;
    if (part < 1.0 && part * h > SHORT_TIME) {
      s->h = h *= part;
      continue;
    }
    if (over && r.error < 1e3) {
      int found = locate(s, &r, h);
      if (++*crossings > MOST_CROSSINGS) return failed(s, "it switches over and over again");
      if (found <= 0) return found;
    } else if (r.error <= 1.0) {
      double longer = h * factor(r.error);
      s->h = h < s->h ? fmax(s->h, longer) : longer;
      s->turned = 0;
      s->last = h;
      accept(s, &r, h < room ? s->t + h : stop);
      if (check_rising(s) < 0) return -1;
      commit(s);
      return 0;
    }
    s->h = h *= r.error < INFINITY ? fmin(factor(r.error), 0.5) : 0.1;
    if (h <= 1e-15 * fmax(fabs(s->t), 1e-3)) break;
  }
  return failed(s, "no finite state, or no step short enough");
}

int machine_step(Machine *s, double end)
{
  int crossings = 0;
  if (check_known(s, end) < 0) return -1;
  for (int steps = 0; steps < MOST_STEPS; ++steps) {
    double stop = fmin(end, s->next), close = rounding(s->t);
    if (stop - s->t > close) {
      if (advance(s, stop, &crossings) < 0) return -1;
      continue;
    }
    s->t = stop;
    machine_changed(s);
    if (s->next > stop + close) return 0;
    if (machine_event(s) < 0) return -1;
    if (stop >= end - close && s->next > end + close) {
      s->t = end;
      return 0;
    }
  }
  return failed(s, "too many steps");
}

/* -- variables */

void machine_begin(Machine *s)
{
  memset(s, 0, sizeof *s);
  memcpy(s->x, model_start, N_STATES * sizeof(double));
  memcpy(s->p, model_parameters, N_PARAMETERS * sizeof(double));
  s->next = s->until = s->h = INFINITY;
  s->began = s->fell = -INFINITY;
  s->tolerance = TOLERANCE;
  for (int i = 0; i < N_GUARDS; ++i) s->rising[i] = NAN;
  for (int i = 0; i < N_MEMORY; ++i) s->way[i] = 1.0;
}

int machine_get(Machine *s, unsigned reference, double *value)
{
  if (reference == 0) *value = s->t;
  else if (reference < OF_RATES) *value = s->x[reference - OF_STATES];
  else if (reference < OF_INPUTS) *value = machine_rates(s)[reference - OF_RATES];
  else if (reference < OF_OUTPUTS) *value = s->u[reference - OF_INPUTS];
  else if (reference < OF_INDICATORS) *value = machine_outputs(s)[reference - OF_OUTPUTS];
  else if (reference < OF_PARAMETERS) {
    double z[N_INDICATORS + 1];
    machine_indicators(s, z);
    *value = z[reference - OF_INDICATORS];
  } else if (reference < OF_NOTHING) *value = s->p[reference - OF_PARAMETERS];
  else return failed(s, "there is no variable of this value reference");
  return 0;
}

static int set_parameter(Machine *s, unsigned i, double value)
{
  const Bounds *b = &model_bounds[i];
  int inside = b->open_below ? value > b->low : value >= b->low;
  inside = inside && (b->open_above ? value < b->high : value <= b->high);
  if (!b->may_change && value != model_parameters[i]) inside = 0;
  if (!inside) {
    (void)snprintf(s->message, sizeof s->message, "parameter '%s' cannot be %.9g", b->name, value);
    return -1;
  }
  s->p[i] = value;
  s->prepared = 0;
  return 0;
}

int machine_set(Machine *s, unsigned reference, double value)
{
  machine_changed(s);
  if (reference == 0) s->t = value;
  else if (reference < OF_RATES) s->x[reference - OF_STATES] = value;
  else if (reference >= OF_INPUTS && reference < OF_OUTPUTS) s->u[reference - OF_INPUTS] = value;
  else if (reference >= OF_PARAMETERS && reference < OF_NOTHING)
    return set_parameter(s, reference - OF_PARAMETERS, value);
  else return failed(s, "this variable cannot be set");
  return 0;
}
