/* How far a step may be followed through functions that are flat but for a narrow range.

   Neither error control nor a change of sign shows a pulse between two places at which it is 0 to
   rounding.  Its argument moves gently there: from values of that at places of a step, with
   parabolas through three of them in between, follows through how much of it the step leads. */
#include "sharp.h"

#include <math.h>

#define PLACES 17

#if N_SHARP

/* The state within a step: the cubic through both ends and the rates there. */
static void state_at(const Machine *s, const double first[], const double x[], const double k[],
                     double h, double part, double at[])
{
  double rest = 1.0 - part, rise = part * part * (3.0 - 2.0 * part);
  for (int i = 0; i < N_STATES; ++i)
    at[i] = model_continuous[i] ? s->x[i] + rise * (x[i] - s->x[i])
                                      + h * part * rest * (rest * first[i] - part * k[i])
                                : s->x[i];
}

/* Takes the vertex of the parabola through three values into the range of its interval. */
static void bend(const double v[], double least[], double most[], int n)
{
  double slope = 0.5 * (v[n + 1] - v[n - 1]), curve = v[n + 1] - 2.0 * v[n] + v[n - 1];
  double at = -slope / curve, value = v[n] + 0.5 * slope * at;
  if (!(fabs(at) < 1.0)) return;
  int interval = at < 0.0 ? n - 1 : n;
  least[interval] = fmin(least[interval], value);
  most[interval] = fmax(most[interval], value);
}

/* By what a function is measured whose argument is between two numbers. */
static void measure(int kind, double least, double most, double *low, double *high)
{
  if (kind == AREA) {
    least = 2.0 * asinh(least);
    most = 2.0 * asinh(most);
  } else if (kind != ITSELF) {
    double nearest = fmax(fmax(least, -most), exp(-RANGE / kind));
    most = kind * log(fmax(fmax(most, -least), nearest));
    least = kind * log(nearest);
  }
  *low = fmin(fmax(least, -RANGE), RANGE);
  *high = fmin(fmax(most, -RANGE), RANGE);
}

static double followed(int kind, const double v[])
{
  double least[PLACES - 1], most[PLACES - 1], low = RANGE, high = -RANGE;
  for (int n = 0; n + 1 < PLACES; ++n) {
    least[n] = fmin(v[n], v[n + 1]);
    most[n] = fmax(v[n], v[n + 1]);
  }
  for (int n = 1; n + 1 < PLACES; ++n) bend(v, least, most, n);
  for (int n = 0; n + 1 < PLACES; ++n) {
    double from, to;
    measure(kind, least[n], most[n], &from, &to);
    low = fmin(low, from);
    high = fmax(high, to);
    if (high - low > LEADS) return fmax(n, SHORTER * (n + 1)) / (PLACES - 1);
  }
  return 1.0;
}

double sharp_followed(const Machine *s, const double first[], const double x[], const double k[],
                      double h)
{
  double values[N_SHARP][PLACES], at[N_STATES + 1], row[N_SHARP], part = 1.0;
  for (int n = 0; n < PLACES; ++n) {
    double t = s->t + h * n / (PLACES - 1);
    state_at(s, first, x, k, h, (double)n / (PLACES - 1), at);
    model_sharp(fmin(t, nextafter(s->next, -INFINITY)), at, s->u, (double *)s->c, row);
    for (int i = 0; i < N_SHARP; ++i) values[i][n] = row[i];
  }
  for (int i = 0; i < N_SHARP; ++i) part = fmin(part, followed(model_sharp_kinds[i], values[i]));
  return part;
}

#else

double sharp_followed(const Machine *s, const double first[], const double x[], const double k[],
                      double h)
{
  (void)s, (void)first, (void)x, (void)k, (void)h;
  return 1.0;
}

#endif
