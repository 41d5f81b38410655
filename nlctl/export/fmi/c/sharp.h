/* How far a step may be followed through functions that are flat but for a narrow range. */
#ifndef SHARP_H
#define SHARP_H

#include "machine.h"

/* Up to which part the step from s to x, with the rates k there, may lead: 1, or where it has led
   through more than LEADS of one of these functions. */
double sharp_followed(const Machine *s, const double first[], const double x[], const double k[],
                      double h);

#endif
