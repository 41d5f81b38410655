/* The equations for any processor, and which of both is called: fma is a call where the processor
   has none, and there is one in nearly every operation of an exponential. */
#define VERSION(name) name##_plain
#include "equations.h"

#ifdef HAS_WIDE
#include <cpuid.h>

/* Whether there are FMA and AVX2, and the system keeps wide registers. */
static int is_wide(void)
{
  const unsigned needed = 1u << 12 | 1u << 27 | 1u << 28, avx2 = 1u << 5; /* FMA, OSXSAVE, AVX */
  unsigned a, b, c, d, kept, high;
  if (!__get_cpuid(1, &a, &b, &c, &d) || (c & needed) != needed) return 0;
  __asm__ volatile("xgetbv" : "=a"(kept), "=d"(high) : "c"(0));
  return (kept & 6u) == 6u && __get_cpuid_count(7, 0, &a, &b, &c, &d) && (b & avx2);
}

static int wide(void)
{
  static int known = -1;
  if (known < 0) known = is_wide();
  return known;
}

#define CALL(name, ...) (wide() ? name##_wide(__VA_ARGS__) : name##_plain(__VA_ARGS__))
#else
#define CALL(name, ...) name##_plain(__VA_ARGS__)
#endif

void model_prepare(const double p[], double c[]) { CALL(model_prepare, p, c); }

void model_rates(double t, const double x[], const double u[], double c[], double dx[], double g[],
                 double m[])
{
  CALL(model_rates, t, x, u, c, dx, g, m);
}

void model_outputs(double t, const double x[], const double u[], double c[], double y[])
{
  CALL(model_outputs, t, x, u, c, y);
}

void model_sample(int k, double t, const double x[], const double u[], double c[], double s[])
{
  CALL(model_sample, k, t, x, u, c, s);
}

void model_reset(double t, const double x[], const double u[], double c[], double s[])
{
  CALL(model_reset, t, x, u, c, s);
}

void model_sharp(double t, const double x[], const double u[], double c[], double s[])
{
  CALL(model_sharp, t, x, u, c, s);
}
