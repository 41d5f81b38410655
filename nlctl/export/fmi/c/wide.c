/* The equations for processors with AVX2 and FMA. */
#include "model.h"

#include <float.h>
#include <math.h>
#include <stdint.h>
#include <string.h>

#ifdef HAS_WIDE
#ifdef __clang__
#pragma clang attribute push(__attribute__((target("avx2,fma"))), apply_to = function)
#else
#pragma GCC target("avx2,fma")
#endif
#define VERSION(name) name##_wide
#include "equations.h"
#ifdef __clang__
#pragma clang attribute pop
#endif
#endif
